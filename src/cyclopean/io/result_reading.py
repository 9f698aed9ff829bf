"""A result file read back, to be looked at: its verdict, with the blocks from its certificate or from the model."""

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.assembly import Assembly, Block, Contacts, supports
from cyclopean.errors import InputError
from cyclopean.io.fields import array, found, label, mapping, number, read_json, text, vector
from cyclopean.io.files import PathLike, one_line
from cyclopean.io.findings import ForceRow, force_rows, listed
from cyclopean.io.formats import MESH_SUFFIXES
from cyclopean.io.model_json import SCHEMA, read_document
from cyclopean.io.models import read_model

if TYPE_CHECKING:
    from cyclopean.analysis import Result

__all__ = ["is_result", "read_result"]

RESULT, CERTIFICATE = "cyclopean.result/1", "cyclopean.certificate/2"
WORDS = ("stable", "unstable", "undecided")
DOWN = (0.0, 0.0, -9.80665)  # m/s2


_Source = tuple[Assembly, Floats | None, dict[str, Any] | None]  # blocks; of a certificate its gravity, and itself


def is_result(path: PathLike) -> bool:
    """Whether a file is a result of a check rather than a model.

    Raises
    ------
    InputError
        It cannot be read, or is a .json file that is not JSON.
    """
    if PurePath(os.fspath(path)).suffix.lower() != ".json":
        return False
    document = read_json(path)
    return isinstance(document, dict) and document.get("schema") == RESULT


def read_result(
    path: PathLike, model: PathLike | None = None, units: str | None = None
) -> tuple["Result", tuple[str, ...]]:
    """Read a result with the blocks it is about.

    The blocks are looked for in the certificate that the result names, then in a model file beside it of the same name
    (`arch.json` for `arch.result.json`), in `model.json` there, and in a file of the model's name.

    Parameters
    ----------
    path : path
        The result.
    model : path, optional
        Where its model is.
    units : str, optional
        Unit of length of a model file that does not say it.

    Returns
    -------
    result : Result
        As the file says; nothing of it is checked again. Without a model its blocks have names and no shape.
    warnings : tuple of str
        Where the blocks were found, and what had to be guessed.

    Raises
    ------
    InputError
        It is not a result, or the model named is another one.
    """
    from cyclopean.analysis import Result

    shown = one_line(path)
    data = mapping(read_json(path), shown)
    if data.get("schema") != RESULT:
        raise InputError(f'{shown}: its schema is {found(data.get("schema"))}; a result has "schema": "{RESULT}"')
    verdict = text(data.get("verdict"), f"{shown}: verdict")
    if verdict not in WORDS:
        raise InputError(f"{shown}: verdict {label(verdict)} is not one of {', '.join(WORDS)}")
    (assembly, gravity, proof), warnings = _source(path, shown, data, model, units)
    index = {block.id: k for k, block in enumerate(assembly.blocks)}
    rows = force_rows(shown, data, index)
    motion = {name: _motion(shown, name, data.get(name), index) for name in ("mechanism", "displacement")}
    kind = data.get("certificate")
    known = {"kind": str(mapping(kind, f"{shown}: certificate").get("kind", ""))} if kind is not None else None
    assumed = mapping(data.get("assumed") or {}, f"{shown}: assumed")
    if gravity is None:
        gravity = vector(assumed["gravity"], f"{shown}: assumed.gravity") if "gravity" in assumed else np.array(DOWN)
        if "gravity" not in assumed:
            warnings += (f"{shown}: does not say its gravity and no certificate is beside it; straight down is drawn",)
    used = np.array([np.nan if row.utilisation is None else row.utilisation for row in rows])
    result = Result(
        assembly=assembly,
        contacts=_contacts(shown, rows, assembly, assumed),
        fixed=_fixed(assembly, proof, motion, data),
        method=text(data.get("method"), f"{shown}: method"),
        verdict=verdict,  # type: ignore[arg-type]
        reason=text(data.get("reason"), f"{shown}: reason"),
        assumed=assumed,
        gravity=gravity,
        residuals=_residuals(shown, data),
        force=None if (force := _given(rows, "force")) is None else np.concatenate(force),
        frame=None if (frame := _given(rows, "frame")) is None else np.stack(frame),
        utilisation=used if np.isfinite(used).any() else None,
        mechanism=motion["mechanism"],
        displacement=motion["displacement"],
        certificate=known if proof is None else proof,
        provenance=mapping(data.get("provenance") or {}, f"{shown}: provenance"),
        seconds=mapping(data.get("seconds") or {}, f"{shown}: seconds"),
    )
    return result, warnings


def _source(
    path: PathLike, shown: str, data: dict[str, Any], model: PathLike | None, units: str | None
) -> tuple[_Source, tuple[str, ...]]:
    """The blocks of a result, wherever they are."""
    names = _names(shown, data)
    if model is not None:
        assembly, warnings = read_model(model, units)
        if (why := _differs(assembly, names, data)) is not None:
            raise InputError(f"{one_line(model)}: is not the model of {shown}: {why}")
        return (assembly, None, None), warnings
    place = Path(os.fspath(path)).parent
    proof = data.get("certificate")
    file = proof.get("file") if isinstance(proof, dict) else None
    if isinstance(file, str) and file and (place / file).is_file():
        certified = _certified(place / file, data)
        if certified is not None and _differs(certified[0], names, data) is None:
            return certified, ()
    for candidate in _beside(place, os.fspath(path), data):
        if candidate.is_file() and not candidate.samefile(path):
            try:
                assembly, warnings = read_model(candidate, units)
            except InputError:  # some other file of that name
                continue
            if _differs(assembly, names, data) is None:
                return (assembly, None, None), warnings
    more = data.get("blocks")
    rest = max(more - len(names), 0) if isinstance(more, int) else 0
    blank = tuple(
        Block(name, np.zeros((0, 3)), ()) for name in (*names, *(f"(not named) {k + 1}" for k in range(rest)))
    )
    lost = f"{shown}: its model was not found beside it, so blocks are not drawn; name it with `model`"
    return (Assembly(blank, name=_title(data)), None, None), (lost,)


def _title(data: dict[str, Any]) -> str:
    name = data.get("model")
    return name if isinstance(name, str) and name else "model"


def _beside(place: Path, path: str, data: dict[str, Any]) -> list[Path]:
    """Model files that a result of this name may be of."""
    stem = PurePath(path).stem
    stems = [stem.removesuffix(".result"), "model", _title(data)]
    endings = (".json", *MESH_SUFFIXES)
    names = dict.fromkeys(f"{s}{e}" for s in stems if s.isprintable() and os.sep not in s for e in endings)
    return [place / name for name in names]


def _names(shown: str, data: dict[str, Any]) -> list[str]:
    """Ids of all blocks that the result names."""
    names: dict[str, None] = {}
    for k, row in enumerate(array(data.get("forces") or [], f"{shown}: forces")):
        for end in ("a", "b"):
            names[text(mapping(row, f"{shown}: forces[{k}]").get(end), f"{shown}: forces[{k}].{end}")] = None
    for key in ("mechanism", "displacement"):
        names |= dict.fromkeys(mapping(data.get(key) or {}, f"{shown}: {key}"))
    return list(names)


def _differs(assembly: Assembly, names: list[str], data: dict[str, Any]) -> str | None:
    """Why these cannot be the blocks of the result; None where they can."""
    missing = set(names) - {block.id for block in assembly.blocks}
    if missing:
        return f"it has no block {label(min(missing))}"
    count = data.get("blocks")
    return f"it has {len(assembly)} blocks, the result {count}" if count != len(assembly) else None


def _certified(path: Path, data: dict[str, Any]) -> _Source | None:
    """The model in a certificate; None where the file is something else."""
    document = read_json(path)
    if not isinstance(document, dict) or document.get("schema") != CERTIFICATE:
        return None
    shown = one_line(path)
    rows = {
        "schema": SCHEMA,
        "units": "m",
        "blocks": document.get("blocks"),
        "contacts": document.get("contacts") or [],
    }
    assembly, _ = read_document(shown, _title(data), rows, None)  # its stones and joints are written as a model's
    return assembly, vector(document.get("gravity"), f"{shown}: gravity"), document


def _contacts(shown: str, rows: list[ForceRow], assembly: Assembly, assumed: dict[str, Any]) -> Contacts:
    """Those that the result lists, or those of the model; friction as far as it is known."""
    known = assembly.contacts
    if not rows:
        return Contacts.of([], []) if known is None else known
    here = listed(rows)
    if known is not None and np.array_equal(known.a, here.a) and np.array_equal(known.b, here.b):
        here = replace(here, mu=known.mu)
    mu = assumed.get("mu")
    return here if mu is None else here.with_mu(number(mu, f"{shown}: assumed.mu"))


def _given(rows: list[ForceRow], name: str) -> list[Floats] | None:
    """An array of each row; None where one has none."""
    found = [getattr(row, name) for row in rows]
    return None if not rows or any(part is None for part in found) else found


def _motion(shown: str, name: str, value: Any, index: Mapping[str, int]) -> Floats | None:
    if value is None:
        return None
    rows = np.zeros((len(index), 6))
    for block, motion in mapping(value, f"{shown}: {name}").items():
        where = f"{shown}: {name}.{one_line(block, 40)}"
        if len(array(motion, where)) != 6:
            raise InputError(f"{where} must be six numbers, found {len(motion)}")
        if block not in index:
            raise InputError(f"{shown}: names block {label(block)}, which is not in its model")
        rows[index[block]] = [number(x, where) for x in motion]
    return rows


def _fixed(
    assembly: Assembly, proof: dict[str, Any] | None, motion: Mapping[str, Floats | None], data: dict[str, Any]
) -> Bools:
    """Supports: from the certificate, from the blocks that move, or by the model's own rule."""
    if proof is not None:
        return np.array([block.fixed is True for block in assembly.blocks], bool)
    for name, rows in motion.items():
        if rows is not None:
            return np.array([block.id not in data[name] for block in assembly.blocks], bool)
    if len(assembly.mesh.vertex):
        return supports(assembly)[0]
    free = data.get("free")  # how many; which ones, nobody sees where nothing is drawn
    return np.asarray(np.arange(len(assembly)) >= (free if isinstance(free, int) else len(assembly)))


def _residuals(shown: str, data: dict[str, Any]) -> dict[str, float]:
    rows = mapping(data.get("residuals") or {}, f"{shown}: residuals")
    return {  # a bound may be as large as a double
        name: np.nan if value is None else number(value if name != "bound" else 0, f"{shown}: residuals.{name}")
        for name, value in rows.items()
    } | ({"bound": float(rows["bound"])} if isinstance(rows.get("bound"), float) else {})
