"""The JSON of Hops: descriptions of components, requests and answers, to and from our own types.

As McNeel's Hops component of Rhino 7 and 8 sends and reads it (`RemoteDefinition.cs` and `Schema.cs` in the public
source of Rhino.Compute, MIT). What is known from there and nowhere written:

- An input is an item where AtLeast and AtMost are 1, a tree where TreeAccess is set or both are -1, else a list; it is
  optional where AtLeast is 0.
- Every value is text: {"type": "System.Double", "data": "0.84"}. Text itself is JSON text in it, quotes and all.
  Hops strips the quotes and undoes the escapes only of text that begins with a brace, so whatever else we send must
  need none: it stays on one line.
- An answer without values shows its errors, whatever its HTTP status. One with values must have all of them, or Hops
  asks for the description again. It caches answers of status 200, so trouble that may pass must have another one.
- Status 500 with the first error "Bad inputs" makes Hops fetch the description anew: the component has changed since
  the Grasshopper file was saved.
- Hops cannot receive transforms. Where a stone goes is told by a plane, for Grasshopper's Orient.
"""

import json
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from cyclopean.errors import InputError, spelt
from cyclopean.io.fields import array, mapping, parsed, text
from cyclopean.io.files import one_line
from cyclopean.io.rhino_faces import surface_bodies
from cyclopean.io.rhino_json import (
    Units,
    curve_pieces,
    mesh_body,
    mesh_json,
    plane_json,
    plane_of,
    point_json,
    point_of,
    polyline_json,
    units_of,
    vector_json,
    vector_of,
)
from cyclopean.service.icons import icon
from cyclopean.service.inputs import input_name
from cyclopean.service.parameters import Answer, Component, Input, Kind, Output

MOST = 2_147_483_647  # of a list
CATEGORY = "Cyclopean"
TYPES: dict[Kind, str] = {
    "Number": "System.Double", "Integer": "System.Int32", "Text": "System.String", "Boolean": "System.Boolean",
    "Mesh": "Rhino.Geometry.Mesh", "Curve": "Rhino.Geometry.PolylineCurve", "Line": "Rhino.Geometry.Line",
    "Point": "Rhino.Geometry.Point3d", "Vector": "Rhino.Geometry.Vector3d", "Plane": "Rhino.Geometry.Plane",
    "Surface": "Rhino.Geometry.Brep",  # so Grasshopper sends what flows through its parameter of surfaces
}  # fmt: skip
Request = Mapping[str, Any]


class OutdatedError(InputError):
    """The request has an input that the component has not, or lacks one: its description is an old one."""


def described(component: Component) -> dict[str, Any]:
    """A component as Hops wants it told before it can be used."""
    return {
        "Uri": f"/{component.path}",
        "Name": component.name,
        "Nickname": component.nickname,
        "Description": component.about,
        "Category": CATEGORY,
        "Subcategory": "Stone",
        "Icon": icon(component.path),
        "Inputs": [_parameter(given) for given in component.inputs],
        "Outputs": [_parameter(made) for made in component.outputs],
    }


def _parameter(one: Input | Output) -> dict[str, Any]:
    told = {
        "Name": one.name,
        "Nickname": one.nickname,
        "Description": one.about,
        "ParamType": one.kind,
        "ResultType": TYPES[one.kind],
        "AtLeast": 0 if isinstance(one, Input) and one.optional else 1,
        "AtMost": 1 if one.access == "item" else MOST,
        "TreeAccess": one.access == "tree",
    }
    return told | {"Default": one.default} if isinstance(one, Input) and one.default is not None else told


def request_of(body: bytes) -> Request:
    """Parse a request.

    Raises
    ------
    InputError
        It is not a JSON object, or nested too deeply.
    """
    try:
        content = body.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("request: is not UTF-8 text") from None
    return mapping(parsed("request", content), "request")


def inputs_of(component: Component, request: Request) -> tuple[dict[str, Any], Units, tuple[str, ...]]:
    """Read the values that a component is given.

    Returns
    -------
    values : dict
        By the names of the inputs, as `parameters` says.
    units : Units
        Of the lengths in the request, and of those in the answer.
    warnings : tuple of str
        What was assumed.

    Raises
    ------
    OutdatedError
        The request is for another version of the component.
    InputError
        A value that is missing, or is not of its kind; names the input.
    """
    trees: dict[str, Any] = {}
    for k, row in enumerate(array(request.get("values"), "request: values")):
        tree = mapping(row, f"request: values[{k}]")
        name = text(tree.get("ParamName"), f"request: values[{k}].ParamName").removeprefix("RH_IN:")
        if name in trees:
            raise InputError(f"request: input '{one_line(name, 40)}' stands twice")
        trees[name] = tree.get("InnerTree")
    known = {given.name for given in component.inputs}
    if strange := next((name for name in trees if name not in known), None):
        raise OutdatedError(
            f"{component.name}: has no input '{one_line(strange, 40)}'; its inputs are brought up to date"
        )
    said = request.get("modelunits")
    units = None if said is None else units_of(text(said, "request: modelunits"))
    warnings = () if units is not None else ("the document has no units; metres are assumed",)
    used = units or (1, 1)
    return {given.name: _given(given, trees.get(given.name), used) for given in component.inputs}, used, warnings


def _given(given: Input, tree: object, units: Units) -> Any:
    """The value of one input."""
    shown = f"{given.name} ({given.nickname})"
    branches = {} if tree is None else mapping(tree, shown)
    read: dict[str, list[Any]] = {}
    for path, value in branches.items():
        rows = array(value, shown)
        at = [f"{shown}[{k}]" for k in range(len(rows))] if len(rows) > 1 else [shown]
        read[path] = [_read(given.kind, where, row, units) for where, row in zip(at, rows, strict=False)]
    values = [value for rows in read.values() for value in rows]
    if not values:
        if given.default is not None or given.optional:
            nothing: dict[str, Any] = {"item": given.default, "list": [], "tree": {}}
            return nothing[given.access]
        raise InputError(f"{shown}: nothing is connected")
    if given.access == "item" and len(values) > 1:
        raise InputError(f"{shown}: takes one value, got {len(values)}")
    return {"item": values[0], "list": values, "tree": read}[given.access]


def _read(kind: Kind, where: str, row: object, units: Units) -> Any:
    """One value from {"type", "data"}."""
    item = mapping(row, where)
    data = item.get("data")
    if kind == "Text":
        return _text(where, data)
    value = parsed(where, data) if isinstance(data, str) else data
    return READERS[kind](where, value, units)


def _text(where: str, data: object) -> str:
    """Text that is JSON text in the data; plain text, as some clients send it, is taken as it is."""
    if not isinstance(data, str):
        raise InputError(f"{where}: expected text")
    return str(parsed(where, data)) if len(data) > 1 and data[0] == data[-1] == '"' else data


def _number(where: str, value: object, _: Units) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e300:
        raise InputError(f"{where}: expected a finite number")
    return float(value)


def _whole(where: str, value: object, units: Units) -> int:
    number = _number(where, value, units)
    if number != math.floor(number) or not abs(number) <= MOST:
        raise InputError(f"{where}: expected a whole number")
    return int(number)


def _truth(where: str, value: object, _: Units) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"{where}: expected true or false")
    return value


READERS: dict[Kind, Callable[[str, object, Units], Any]] = {
    "Number": _number,
    "Integer": _whole,
    "Boolean": _truth,
    "Mesh": mesh_body,
    "Curve": curve_pieces,
    "Point": point_of,
    "Vector": lambda where, value, _: vector_of(where, value),
    "Plane": plane_of,
    "Surface": surface_bodies,
}


def answered(component: Component, answer: Answer, units: Units, request: Request) -> dict[str, Any]:
    """An answer as Hops reads it: every output is there, with no value where the component found none."""
    values = [_tree(made, answer.values.get(made.name), units) for made in component.outputs]
    return {
        "pointer": request.get("pointer") if isinstance(request.get("pointer"), str) else component.path,
        "values": values,
        "errors": [],
        "warnings": [one_line(spelt(warning, input_name)) for warning in answer.warnings],
    }


def _tree(made: Output, value: Any, units: Units) -> dict[str, Any]:
    if made.access == "tree":
        branches = {f"{{0;{k}}}": branch for k, branch in enumerate(value or ())}
    elif made.access == "list":
        branches = {"{0}": () if value is None else value}
    else:
        branches = {"{0}": () if value is None else (value,)}
    write, text_of = WRITERS[made.kind], json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    kind = TYPES[made.kind]
    inner = {
        path: [{"type": kind, "data": text_of.encode(write(item, units))} for item in branch]
        for path, branch in branches.items()
    }
    return {"ParamName": made.name, "InnerTree": inner}


WRITERS: dict[Kind, Callable[[Any, Units], Any]] = {
    "Number": lambda value, _: float(value),
    "Integer": lambda value, _: int(value),
    "Text": lambda value, _: str(value),
    "Boolean": lambda value, _: bool(value),
    "Mesh": lambda value, units: mesh_json(value[0], value[1], units),
    "Curve": polyline_json,
    "Line": lambda value, units: {end: point_json(at, units) for end, at in zip(("From", "To"), value, strict=True)},
    "Point": point_json,
    "Vector": lambda value, _: vector_json(value),
    "Plane": plane_json,
}


def refusal(errors: Iterable[str], warnings: Iterable[str] = ()) -> dict[str, Any]:
    """An answer that shows what was wrong on the component, also where a description was asked for.

    Examples
    --------
    >>> refusal(["Blocks (B): nothing is connected"])["errors"]
    ['Blocks (B): nothing is connected']
    """
    said = {"errors": [one_line(e) for e in errors], "warnings": [one_line(w) for w in warnings]}
    return {"values": [], **said, "Inputs": [], "Outputs": []}
