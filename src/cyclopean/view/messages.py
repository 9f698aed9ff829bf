"""What a client of a served page may send: the six messages that ours need, each field with its type and range.

viser itself takes any of its messages, by name, and puts their values into its elements unread. Its messages are
msgpack, which it reads by msgspec; so do we, into types that say what is there and that nothing else may be.
"""

from collections.abc import Callable
from typing import Annotated, Any, Literal, TypeAlias

import msgspec
from viser import (
    GuiButtonGroupHandle,
    GuiButtonHandle,
    GuiCheckboxHandle,
    GuiDropdownHandle,
    GuiSliderHandle,
    GuiTextHandle,
)

LONGEST = 200  # characters of a name
FAR = 1e4  # units of the drawing, which is 4 long
UNIT = 1e-3  # that the square of a quaternion may be off 1

Value: TypeAlias = bool | float | str
Three: TypeAlias = tuple[float, float, float]
Four: TypeAlias = tuple[float, float, float, float]
Short: TypeAlias = Annotated[str, msgspec.Meta(max_length=LONGEST)]
Pixels: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=1e6)]


class _Message(msgspec.Struct, frozen=True, tag_field="type", forbid_unknown_fields=True):
    """The field `type` says which."""


class _Update(_Message, frozen=True, tag="GuiUpdateMessage"):
    uuid: Short
    updates: Annotated[dict[Literal["value"], Value], msgspec.Meta(min_length=1)]


class _Camera(_Message, frozen=True, tag="ViewerCameraMessage"):
    wxyz: Four
    position: Three
    fov: float
    near: float
    far: float
    image_height: Pixels
    image_width: Pixels
    look_at: Three
    up_direction: Three


class _Click(_Message, frozen=True, tag="ScenePointerMessage"):
    event_type: Literal["click"]
    ray_origin: Three
    ray_direction: Three
    screen_pos: Annotated[list[tuple[float, float]], msgspec.Meta(min_length=1, max_length=1)]
    modifier: Short | None


class _Dragged(_Message, frozen=True, tag="TransformControlsUpdateMessage"):
    name: Short
    wxyz: Four
    position: Three
    owner: Short = ""


class _DragStart(_Message, frozen=True, tag="TransformControlsDragStartMessage"):
    name: Short
    owner: Short = ""


class _DragEnd(_Message, frozen=True, tag="TransformControlsDragEndMessage"):
    name: Short
    owner: Short = ""


Message: TypeAlias = _Update | _Camera | _Click | _Dragged | _DragStart | _DragEnd

_DECODER = msgspec.msgpack.Decoder(Message)


def read(raw: str | bytes) -> Message | None:
    """The message that these bytes are; None where they are none that a page of ours sends."""
    try:
        return None if isinstance(raw, str) else _DECODER.decode(raw)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError):
        return None


def fits(message: Message, accepts: Callable[[str, Value], bool]) -> bool:
    """Whether the values of a message are in range; `accepts` is asked with an element's id and its new value."""
    match message:
        case _Update(uuid, updates):
            return accepts(uuid, updates["value"])
        case _Click():
            return _near(message.ray_origin) and _near(message.ray_direction)
        case _Dragged():
            return _near(message.position) and abs(sum(x * x for x in message.wxyz) - 1.0) <= UNIT
    return True


def _near(point: Three) -> bool:
    return all(abs(x) <= FAR for x in point)  # which no NaN is


def takes(element: Any, value: Value) -> bool:
    """Whether an element of the page can have this value."""
    match element:
        case GuiSliderHandle():
            return not isinstance(value, bool | str) and element.min <= value <= element.max  # which no NaN is
        case GuiCheckboxHandle() | GuiButtonHandle():
            return isinstance(value, bool)
        case GuiDropdownHandle() | GuiButtonGroupHandle():
            return value in element.options
        case GuiTextHandle():
            return isinstance(value, str) and len(value) <= LONGEST
    return False
