"""`info`, `convert`, `verify`: what is in a file, the same in another format, and does it prove what it says?"""

import os
import stat
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cyclopean.cli.outputs import STANDARD_OUTPUT, planned
from cyclopean.cli.terminal import long_work, say, say_json, warn
from cyclopean.errors import InputError

if TYPE_CHECKING:
    from cyclopean.assembly import Assembly

__all__ = ["convert", "info", "verify"]

MESHES = (".glb", ".obj", ".ply", ".stl")
LARGEST = 1 << 30  # bytes that a certificate may have

Units = Annotated[str | None, typer.Option(metavar="U", help="Unit of the lengths that are read, such as mm.")]
Json = Annotated[str | None, typer.Option(metavar="F|-", help="Write it as JSON; - prints that and nothing else.")]


def verify(
    certificate: Annotated[str, typer.Argument(metavar="CERTIFICATE", show_default=False, help="Certificate file.")],
    json: Json = None,
) -> int:
    """Check a certificate in exact arithmetic.

    Exit status: 0 it proves what it claims, 1 it does not, 2 it cannot be read.
    """
    files = planned({"--json": json}, keep=certificate)

    from cyclopean.proof import NotACertificateError, verify_file

    try:
        _refuse_endless(certificate)
        with long_work(f"verifying {certificate}"):
            report = verify_file(certificate)
    except OSError as error:
        why = (error.strerror or str(error)).lower()
        raise InputError(f"{certificate or repr(certificate)}: cannot be read: {why}") from None
    except NotACertificateError as error:
        raise InputError(f"{certificate}: {error}") from None
    data = {
        "proved": report.proved,
        "kind": report.kind,
        "claim": report.claim,
        "reason": report.reason,
        "figures": report.figures,
    }
    if files:
        from cyclopean import io

        io.write_json(files["--json"], data)
    if json == STANDARD_OUTPUT:
        say_json(data)
    else:
        say(f"{'proved' if report.proved else 'NOT proved'}: {report.claim or 'no claim that can be read'}")
        say(f"  {report.reason}")
    return 0 if report.proved else 1


def _refuse_endless(path: str) -> None:
    """Refuse what would be read for ever, or would not fit into memory.

    Raises
    ------
    InputError
        A folder, a device, a named pipe, a path that is none, or a file of more than `LARGEST` bytes.
    OSError
        There is no such file.
    """
    try:
        found = os.stat(path)
    except ValueError:  # a null character
        raise InputError(f"{path}: is not a path") from None
    mode = found.st_mode
    if stat.S_ISDIR(mode):
        raise InputError(f"{path}: is a folder; name a file in it")
    if stat.S_ISCHR(mode) or stat.S_ISBLK(mode):
        raise InputError(f"{path}: is a device; name a file")
    if stat.S_ISFIFO(mode) and not path.startswith("/dev/"):  # a shell's own pipes end, others need not
        raise InputError(f"{path}: is a pipe; name a file")
    if found.st_size > LARGEST:
        raise InputError(f"{path}: holds {found.st_size / 1e9:.1f} GB, more than any certificate; is it one?")


def info(
    model: Annotated[str, typer.Argument(metavar="MODEL", show_default=False, help="Model file.")],
    units: Units = None,
    json: Json = None,
) -> int:
    """Say what is in a model file."""
    files = planned({"--json": json}, keep=model)

    from cyclopean import io

    assembly, warnings = io.read_model(model, units)
    for warning in warnings:
        warn(warning)
    data = _contents(assembly)
    if files:
        io.write_json(files["--json"], data)
    if json == STANDARD_OUTPUT:
        say_json(data)
    else:
        say("\n".join(_lines(data)))
    return 0


def convert(
    source: Annotated[str, typer.Argument(metavar="IN", show_default=False, help="Model file to read.")],
    target: Annotated[
        str, typer.Argument(metavar="OUT", show_default=False, help="File to write; its ending decides.")
    ],
    units: Units = None,
) -> int:
    """Write a model in another format, in metres."""
    path = planned({"OUT": target}, keep=source)["OUT"]
    mesh = path.suffix.lower() in MESHES
    if not mesh and path.suffix.lower() != ".json":
        raise InputError(f"OUT {target}: unknown ending; use .json, {', '.join(MESHES)}")

    from cyclopean import io

    assembly, warnings = io.read_model(source, units)
    (io.write_mesh if mesh else io.write_model)(path, assembly)
    for warning in (*warnings, *(_lost(path.name, assembly) if mesh else ())):
        warn(warning)
    say(f"{assembly.name}: {len(assembly)} blocks; written {path}")
    return 0


def _lost(name: str, assembly: "Assembly") -> tuple[str, ...]:
    """Say what of the model a mesh file does not hold."""
    blocks = assembly.blocks
    lost = {
        "contacts": assembly.contacts is not None,
        "loads": bool(assembly.loads),
        "supports": any(b.fixed is not None for b in blocks),
        "densities": any(b.density is not None for b in blocks),
        "groups": any(b.group is not None for b in blocks),
    }
    kinds = [kind for kind, there in lost.items() if there]
    return (f"{name}: a mesh file holds no {', '.join(kinds)}",) if kinds else ()


def _contents(assembly: "Assembly") -> dict[str, Any]:
    """Count and measure a model."""
    import numpy as np

    from cyclopean.geometry import mesh_faults

    blocks, contacts, vertex = assembly.blocks, assembly.contacts, assembly.mesh.vertex
    volume = assembly.mass.volume
    faults = [{"block": blocks[i].id, "fault": fault} for i, fault in mesh_faults(assembly.mesh)]
    given: dict[str, Any] | None = None
    if contacts is not None:
        mu = contacts.mu[~np.isnan(contacts.mu)]
        given = {
            "count": len(contacts),
            "points": len(contacts.point),
            "area": float(contacts.area.sum()),
            "mu": [float(mu.min()), float(mu.max())] if len(mu) else None,
            "without_mu": len(contacts) - len(mu),
        }
    density = [b.density for b in blocks if b.density is not None]
    return {
        "schema": "cyclopean.info/1",
        "model": assembly.name,
        "blocks": len(blocks),
        "fixed": sum(b.fixed is True for b in blocks),
        "free": sum(b.fixed is False for b in blocks),
        "groups": len({b.group for b in blocks} - {None}),
        "bounds": [vertex.min(axis=0).tolist(), vertex.max(axis=0).tolist()] if len(vertex) else None,
        "volume": {
            "total": float(volume.sum()),
            "least": float(volume.min(initial=np.inf)) if len(volume) else 0.0,
            "most": float(volume.max(initial=0.0)),
        },
        "density": [min(density), max(density)] if density else None,
        "without_density": len(blocks) - len(density),
        "contacts": given,
        "loads": len(assembly.loads),
        "faults": faults,
    }


def _lines(data: dict[str, Any]) -> list[str]:
    """Write the same for a person."""
    unsaid = data["blocks"] - data["fixed"] - data["free"]
    said = f"{data['fixed']} fixed, {data['free']} free" + (f", {unsaid} not said" if unsaid else "")
    lines = [data["model"], f"  blocks    {data['blocks']} ({said}), {data['groups']} groups"]
    if data["bounds"] is not None:
        sides = (high - low for low, high in zip(*data["bounds"], strict=True))
        lines.append(
            f"  size      {' x '.join(f'{s:.4g}' for s in sides)} m, lowest point z = {data['bounds'][0][2]:.4g} m"
        )
    volume = data["volume"]
    lines.append(f"  volume    {volume['total']:.4g} m3, blocks {volume['least']:.4g} to {volume['most']:.4g} m3")
    lines.append(f"  density   {_span(data['density'], data['without_density'], 'kg/m3')}")
    given = data["contacts"]
    if given is None:
        lines.append("  contacts  not given; they will be detected")
    else:
        lines.append(f"  contacts  {given['count']} given, {given['points']} points, {given['area']:.4g} m2")
        lines.append(f"  mu        {_span(given['mu'], given['without_mu'], '')}")
    if data["loads"]:
        lines.append(f"  loads     {data['loads']}")
    lines += [f"  FAULT     block '{f['block']}' {f['fault']}" for f in data["faults"][:5]]
    if len(data["faults"]) > 5:
        lines.append(f"  FAULT     {len(data['faults']) - 5} more blocks with faults")
    return lines


def _span(ends: list[float] | None, unsaid: int, unit: str) -> str:
    if ends is None:
        return "not given"
    low, high = ends
    value = f"{low:g}" if low == high else f"{low:g} to {high:g}"
    return f"{value} {unit}".rstrip() + (f", {unsaid} not given" if unsaid else "")
