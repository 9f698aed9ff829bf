"""What a component is: a name, inputs and outputs with their kinds, and a pure function between them.

Values are of these types, lengths of geometry in m:

    Number   float            Mesh    Body, in; (vertices, faces), out
    Integer  int              Curve   pieces, in; (n, 3) corners of a closed polyline, out
    Text     str              Line    (2, 3) from and to, out only
    Boolean  bool             Point, Vector  (3,)
                              Plane   Pose
                              Surface list of Body, one a face, in only

A function is given one value for an input of access "item" (None where it is optional and nothing is connected), a
list for "list", and a dict from path to list for "tree". It gives the same, where "tree" is a list of branches.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

Kind = Literal["Number", "Integer", "Text", "Boolean", "Mesh", "Curve", "Line", "Point", "Vector", "Plane", "Surface"]
Access = Literal["item", "list", "tree"]


@dataclass(frozen=True, slots=True)
class Input:
    """What may be connected to a component."""

    name: str  # unique in the component
    nickname: str
    kind: Kind
    about: str  # one sentence
    access: Access = "item"
    default: float | int | str | bool | None = None
    optional: bool = False  # nothing need be connected, and there is no default


@dataclass(frozen=True, slots=True)
class Output:
    """What comes out of a component."""

    name: str
    nickname: str
    kind: Kind
    about: str
    access: Access = "item"


@dataclass(frozen=True, slots=True)
class Context:
    """What a component may do for whoever asks."""

    seconds: float = 60.0  # after which the solve is ended from outside
    folder: Path | None = None  # that stones may be read from; None = no folder is read


@dataclass(frozen=True, slots=True)
class Answer:
    """Values by the names of the outputs, and remarks for a person."""

    values: Mapping[str, Any]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Component:
    """A function that Grasshopper can call."""

    path: str  # of its address
    name: str
    nickname: str
    about: str
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    run: Callable[[Mapping[str, Any], Context], Answer] = field(compare=False)
