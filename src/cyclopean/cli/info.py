"""`info`: what is in a model file, and what a check of it would assume; or what stones are in a folder."""

import math
import os
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

from cyclopean.api.inputs import Reading
from cyclopean.api.walls import interlocked
from cyclopean.cli.command import argument, command, written
from cyclopean.cli.outputs import Files
from cyclopean.cli.terminal import long_work, warn
from cyclopean.errors import InputError
from cyclopean.options import Option

if TYPE_CHECKING:
    from cyclopean.arrays import Floats
    from cyclopean.assembly import Assembly, Contacts, MendedAssembly, SteepBed

NAMED = 5  # faults, outliers and warnings named one by one; the rest are counted
BAR = 30  # signs for the class of sizes with most stones


@command()
def info(
    model: Annotated[str, argument("MODEL", "Model file, or a folder of scanned stones.", source=True)],
    stones: Annotated[bool, Option("The file holds found stones, not a structure.", "flag")] = False,
    interlock: Annotated[bool, Option("Also J, the line of minimum trace and the rules of masons.", "flag")] = False,
    courses: Annotated[
        int | None,
        Option("Of `interlock`: by which J is judged [those drawn].", "whole", metavar="N", least=1),
    ] = None,
    reading: Reading = Reading(),
    files: Annotated[Files, written("json")] = Files({}),
) -> int:
    """Say what is in a model file, or in a folder of stones."""
    if courses is not None and not interlock:
        raise InputError.of("courses", None, "is of the interlock; give `interlock` too")
    if stones or os.path.isdir(model):
        if interlock:
            raise InputError.of("interlock", None, "is that of a wall; found stones have none before they are laid")
        return _info_of_stones(model, reading, files)

    from cyclopean import io
    from cyclopean.view.masons_words import interlock_lines

    found, warnings = io.read_mended(model, reading.units, reading.strict)
    done = [{"block": name, "done": [one.text for one in what]} for name, what in found.done]
    data = _contents(found) | {"format": io.file_format(model), "mended": done}
    told = _lines(data)
    if interlock:
        with long_work(f"measuring {model}"):
            bond, said = interlocked(model, courses, None, reading)
        warnings = tuple(dict.fromkeys((*warnings, *said)))
        data["interlock"] = io.interlock_dict(bond)
        told += interlock_lines(bond)
    for warning in warnings:
        warn(warning)
    files.write({"json": lambda: data})
    files.tell(data, told)
    return 0


def _info_of_stones(path: str, reading: Reading, files: Files) -> int:
    from cyclopean import io

    with long_work(f"reading {path}"):
        inventory, warnings = io.read_stones(path, reading.units, reading.strict)
        data = io.inventory_dict(inventory, warnings, every=files.only_json or "json" in files.to)
    for warning in warnings:
        warn(warning)
    files.write({"json": lambda: data})
    files.tell(data, _stone_lines(data, [stone.id for stone in inventory.stones]))
    return 0


def _stone_lines(data: dict[str, Any], ids: "Sequence[str]") -> list[str]:
    """Write of an inventory what a person wants to know."""
    volume = data["volume"]
    carved, off = (sum(name.startswith(f"{what}-") for name in ids) for what in ("carved", "offcuts"))
    of_carving = f": {carved} carved, {off} offcuts" if carved and carved + off == len(ids) else ""
    quartiles = ", ".join(f"{q:.4g}" for q in volume["quartiles"])
    lines = [
        data["source"],
        f"  stones      {data['count']}{of_carving}",
        f"  volume      {volume['total']:.4g} m3, stones {volume['least']:.4g} to {volume['most']:.4g} m3,"
        f" quartiles {quartiles}",
        *_histogram(volume["classes"], "  sizes       "),
    ]
    shown = {"elongation": "b/a", "thinness": "c/a", "solidity": "V/hull", "sphericity": "sphericity"}
    lines += [f"  {shown[name]:12}{data['shape'][name][0]:.3f} +- {data['shape'][name][1]:.3f}" for name in shown]
    classes = ", ".join(f"{count} {name}" for name, count in data["classes"].items() if count)
    lines.append(f"  classes     {classes}")
    return lines + _some("note        ", data["repaired"]) + _some("REFUSED     ", data["refused"])


def _contents(found: "MendedAssembly") -> dict[str, Any]:
    """Count and measure a model; contacts are detected where it gives none and its meshes are sound."""
    from cyclopean.analysis import DENSITY, MU
    from cyclopean.assembly import detect, size_classes, survey

    assembly = found.assembly
    contacts = assembly.contacts
    notes: tuple[str, ...] = ()
    if contacts is None and len(assembly) and not found.faults:
        detected = detect(assembly)
        contacts, notes = detected.contacts, detected.warnings
    facts = survey(assembly, contacts)
    assumed: dict[str, Any] = {}
    if facts.without_mu:
        assumed["mu"] = MU
    if facts.without_density:
        assumed["density"] = DENSITY
    if facts.support_rule == "lowest":
        assumed["supports"] = "lowest"
    volumes = facts.volumes
    vertex = assembly.mesh.vertex
    density = [b.density for b in assembly.blocks if b.density is not None]
    return {
        "schema": "cyclopean.info/1",
        "model": facts.name,
        "blocks": facts.blocks,
        "fixed": facts.supports,
        "free": facts.blocks - facts.supports,
        "supports": facts.support_rule,
        "groups": facts.groups,
        "bounds": [vertex.min(axis=0).tolist(), vertex.max(axis=0).tolist()] if len(vertex) else None,
        "volume": {
            "total": volumes.total if volumes else 0.0,
            "least": volumes.minimum if volumes else 0.0,
            "quartiles": [volumes.lower_quartile, volumes.median, volumes.upper_quartile] if volumes else None,
            "most": volumes.maximum if volumes else 0.0,
            "classes": [list(row) for row in size_classes(_of_stones(found))],
        },
        "outliers": list(facts.outliers),
        "density": [min(density), max(density)] if density else None,
        "without_density": facts.without_density,
        "contacts": _joints(contacts, detected=assembly.contacts is None),
        "steep_beds": [asdict(one) for one in ([] if found.faults else _steep_beds(assembly, contacts))],
        "loads": facts.loads,
        "warped_faces": facts.warped_faces,
        "faults": [{"block": block, "fault": fault} for block, fault in found.faults],
        "assumed": assumed,
        "warnings": list(notes),
    }


def _of_stones(found: "MendedAssembly") -> "Floats":
    """Volumes (n,) m3 of the blocks that are sound and no supports."""
    import numpy as np

    from cyclopean.assembly import supports

    wrong, assembly = {block for block, _ in found.faults}, found.assembly
    try:
        held = supports(assembly)[0]
    except InputError:  # none are held; a check says so
        held = np.zeros(len(assembly), bool)
    sound = np.array([block.id not in wrong for block in assembly.blocks], bool)
    return np.asarray(assembly.mass.volume[sound & ~held])


def _steep_beds(assembly: "Assembly", contacts: "Contacts | None") -> "Sequence[SteepBed]":
    """Stones without a bed, at the friction and the gravity that a check would assume."""
    import numpy as np

    from cyclopean.analysis import GRAVITY, MU
    from cyclopean.assembly import check_contacts, paired_friction, steep_beds, supports

    if contacts is None or not len(contacts):
        return ()
    try:
        middle, normal = assembly.mass.centroid, contacts.frame[:, 0]
        if np.any(((middle[contacts.b] - middle[contacts.a]) * normal).sum(1) < 0.0):  # wound the wrong way, or hooked
            contacts = check_contacts(assembly, contacts)[0]
        fixed, _ = supports(assembly)
    except InputError:  # a check says what is wrong
        return ()
    friction = paired_friction(assembly, contacts)[0].with_mu(MU)
    return steep_beds(assembly, friction, fixed, np.array(GRAVITY))


def _joints(contacts: "Contacts | None", detected: bool) -> dict[str, Any] | None:
    import numpy as np

    if contacts is None:
        return None
    mu = contacts.mu[~np.isnan(contacts.mu)]
    return {
        "detected": detected,
        "count": len(contacts),
        "points": len(contacts.point),
        "area": float(contacts.area.sum()),
        "mu": [float(mu.min()), float(mu.max())] if len(mu) else None,
        "without_mu": len(contacts) - len(mu),
    }


def _lines(data: dict[str, Any]) -> list[str]:
    """Write the same for a person."""
    said = f"{data['fixed']} fixed, {data['free']} free"
    lines = [
        data["model"],
        f"  format    {data['format']}",
        f"  blocks    {data['blocks']} ({said}), {data['groups']} groups",
    ]
    rules = {"file": "as the file says", "lowest": "every block at the lowest point", "none": "none"}
    lines.append(f"  supports  {rules.get(data['supports'], data['supports'])}")
    if data["bounds"] is not None:
        sides = (high - low for low, high in zip(*data["bounds"], strict=True))
        lines.append(
            f"  size      {' x '.join(f'{s:.4g}' for s in sides)} m, lowest point z = {data['bounds'][0][2]:.4g} m"
        )
    lines += _sizes(data)
    lines.append(f"  density   {_span(data['density'], data['without_density'], 'kg/m3')}")
    joints = data["contacts"]
    if joints is None:
        lines.append("  contacts  not given; they will be detected once the meshes are sound")
    else:
        how = "detected" if joints["detected"] else "given"
        lines.append(f"  contacts  {joints['count']} {how}, {joints['points']} points, {joints['area']:.4g} m2")
        lines.append(f"  mu        {_span(joints['mu'], joints['without_mu'], '')}")
    if data["steep_beds"]:
        lines += _thrust(data["steep_beds"])
    if data["loads"]:
        lines.append(f"  loads     {data['loads']}")
    if data["assumed"]:
        lines.append(f"  assumes   {', '.join(f'{name} {value}' for name, value in data['assumed'].items())}")
    if data["warped_faces"]:
        lines.append(f"  faces     {data['warped_faces']} are not flat and count as triangles")
    lines += _some("mended    ", _alike(data["mended"]))
    lines += _some("FAULT     ", [f"block '{f['block']}' {f['fault']}" for f in data["faults"]])
    return lines + _some("note      ", data["warnings"])


def _thrust(steep: list[dict[str, Any]]) -> list[str]:
    """Stones without a bed: one line, then their names."""
    count = f"{len(steep)} stone{' stands' if len(steep) == 1 else 's stand'}"
    named = [f"'{one['block']}': {one['angle']:.0f} degrees, friction {one['friction']:.0f}" for one in steep]
    told = f"  beds      {count} only if the neighbours hold them by thrust: all faces below are steeper than friction"
    return [told.replace("hold them", "hold it") if len(steep) == 1 else told, *_some("          ", named)]


def _alike(mended: list[dict[str, Any]]) -> list[str]:
    """Blocks to which the same was done in one line."""
    blocks: dict[str, list[str]] = {}
    for one in mended:
        blocks.setdefault(", ".join(one["done"]), []).append(one["block"])
    return [
        f"block '{names[0]}'{f' and {len(names) - 1} more' if len(names) > 1 else ''}: {what}"
        for what, names in blocks.items()
    ]


def _sizes(data: dict[str, Any]) -> list[str]:
    volume = data["volume"]
    lines = [f"  volume    {volume['total']:.4g} m3, blocks {volume['least']:.4g} to {volume['most']:.4g} m3"]
    if volume["quartiles"] is not None:
        lines[0] += f", quartiles {', '.join(f'{q:.4g}' for q in volume['quartiles'])}"
    lines += _histogram(volume["classes"], "  sizes     ")
    return lines + _some("outlier   ", [f"block '{name}' is far from the usual size" for name in data["outliers"]])


def _histogram(classes: list[list[float]], label: str) -> list[str]:
    """A line for each class of sizes, with a bar as long as it has stones."""
    most = max((row[2] for row in classes), default=0)
    spans = [f"{low:.3g} to {high:.3g} m3" for low, high, _ in classes]
    wide, digits = max(map(len, spans), default=0), len(str(most))
    rows = zip(spans, [row[2] for row in classes], [label, *[" " * len(label)] * len(classes)], strict=False)
    bars = [(f"{first}{span:>{wide}}  {n:>{digits}}", math.ceil(BAR * n / most)) for span, n, first in rows]
    return [f"{told}  {'#' * long}".rstrip() for told, long in bars]


def _some(label: str, texts: list[str]) -> list[str]:
    lines = [f"  {label}{text}" for text in texts[:NAMED]]
    return lines + ([f"  {label}{len(texts) - NAMED} more"] if len(texts) > NAMED else [])


def _span(ends: list[float] | None, unsaid: int, unit: str) -> str:
    if ends is None:
        return "not given"
    low, high = ends
    value = f"{low:g}" if low == high else f"{low:g} to {high:g}"
    return f"{value} {unit}".rstrip() + (f", {unsaid} not given" if unsaid else "")
