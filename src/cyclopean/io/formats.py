"""Every format of models, one card each: its ending, what it holds, who reads and who writes it."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import PurePath
from typing import Any

from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from cyclopean.io.files import PathLike, json_text, one_line
from cyclopean.io.findings import Findings

__all__ = ["FORMATS", "MESH_SUFFIXES", "Format", "exchange_format", "loaded"]


@dataclass(frozen=True, slots=True)
class Format:
    """A format, what it holds of a model, and functions of this room (module.name), loaded when they are called."""

    suffix: str
    name: str
    writer: str = ""  # of an assembly, and of findings where it holds them: bytes, text, a JSON document, list of texts
    holds: frozenset[str] | None = None  # fields beside ids and shapes; None = all that a model says
    findings: bool = False  # forces, utilisation, lambda of a result
    shapes: bool = True  # blocks as solids
    reader: str = ""  # of path, stem, bytes and unit (or None): an assembly and warnings
    bodies: str = ""  # of path and bytes: the meshes of a file that knows of nothing else
    begins: tuple[bytes, ...] = ()  # what a file without such an ending looks like

    @property
    def reads(self) -> bool:
        """Whether models are read from it."""
        return bool(self.reader or self.bodies)

    def written(self, assembly: Assembly, findings: Findings | None = None) -> list[bytes]:
        """Contents of the files that hold a model; errors as the writer's."""
        known = Findings() if findings is None else findings
        made = loaded(self.writer)(*((assembly, known) if self.findings else (assembly,)))
        return [_encoded(part) for part in (made if isinstance(made, list) else [made])]


def loaded(name: str) -> Callable[..., Any]:
    """A function of this room by its module and name."""
    module, _, function = name.partition(".")
    found: Callable[..., Any] = getattr(import_module(f"cyclopean.io.{module}"), function)
    return found


def _encoded(content: Any) -> bytes:
    text = json_text(content) if isinstance(content, dict) else content
    return text.encode() if isinstance(text, str) else bytes(text)


_TABLES = frozenset({"group", "density", "fixed", "material", "contacts", "mu", "tension"})
_STONES = frozenset({"group", "density", "fixed"})
FORMATS = {
    form.suffix: form
    for form in (
        Format(".json", "cyclopean.model/1", "model_json.model_dict", reader="models.read_json", begins=(b"{", b"[")),
        Format(".compas.json", "COMPAS JSON", "compas_json.compas_dict", findings=True, reader="models.read_json"),
        Format(
            ".3dm",
            "Rhino 3DM",
            "rhino.rhino_bytes",
            findings=True,
            reader="rhino.read_rhino",
            begins=(b"3D Geometry File Format",),
        ),
        Format(".ifc", "IFC4", "ifc.ifc_bytes", findings=True, reader="ifc.read_ifc", begins=(b"ISO-10303-21",)),
        Format(
            ".glb",
            "GLB",
            "glb.glb_bytes",
            findings=True,
            reader="glb.read_glb_model",
            bodies="glb.read_glb",
            begins=(b"glTF",),
        ),
        Format(
            ".dxf",
            "DXF",
            reader="dxf.read_dxf",
            begins=(b"0\nSECTION", b"0\r\nSECTION", b"999\n", b"AutoCAD Binary DXF"),
        ),
        Format(".obj", "OBJ", "obj.obj_text", frozenset({"group"}), bodies="obj.read_obj"),
        Format(".ply", "PLY", "ply.ply_bytes", frozenset(), bodies="ply.read_ply", begins=(b"ply",)),
        Format(".stl", "STL", "stl.stl_text", frozenset(), bodies="stl.read_stl", begins=(b"solid",)),
        Format(".3ddat", "3DEC", "blocklist.blocklist_text", _STONES),
        Format(".csv", "CSV", "block_tables.tables_csv", _TABLES, findings=True, shapes=False),
    )
}
MESH_SUFFIXES = tuple(sorted(form.suffix for form in FORMATS.values() if form.bodies))


def exchange_format(path: PathLike) -> Format:
    """Tell the format of a file that is to be written by its ending.

    Raises
    ------
    InputError
        The ending is not one of `FORMATS`.
    """
    name = PurePath(path).name.lower()
    known = [suffix for suffix, form in FORMATS.items() if form.writer]
    for suffix in sorted(known, key=len, reverse=True):
        if name.endswith(suffix):
            return FORMATS[suffix]
    raise InputError(f"{one_line(path)}: unknown ending; use {', '.join(known)}")
