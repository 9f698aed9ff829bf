"""Options of polygonal walls whose text says more than one number."""

from typing import TYPE_CHECKING

from cyclopean.errors import InputError
from cyclopean.texts import choice, number, numbers

if TYPE_CHECKING:
    from cyclopean.design.walls.dressing import Coping, Quoins
    from cyclopean.design.walls.openings import Opening
    from cyclopean.design.walls.surfaces import Surface

AUTO = "auto"
LEAN = 10.0  # degrees, of a cone


def surface_file(text: str) -> str | None:
    """The text, if it names a file of a surface."""
    from cyclopean.io.surfaces import SURFACE_SUFFIXES

    return text if text.lower().endswith(SURFACE_SUFFIXES) else None


def surface(option: str, text: str, width: float, height: float) -> "Surface":
    """Read plane, cylinder:R, cone:R[,LEAN], sphere:R[,LATITUDE] or twist:DEG; files are read by `io.surfaces`.

    Raises
    ------
    InputError
        Another word, or numbers that do not fit it.
    """
    from cyclopean.design.walls.surfaces import Cone, Cylinder, Plane, Sphere

    kind, colon, rest = text.partition(":")
    takes = {"plane": (0, 0), "cylinder": (1, 1), "cone": (1, 2), "sphere": (1, 2), "twist": (1, 1)}
    least, most = takes[choice(option, kind, tuple(takes))]
    given = numbers(option, rest) if colon else ()
    if not least <= len(given) <= most:
        wanted = "no number" if not most else "one number" if most == 1 else "one or two numbers"
        raise InputError(f"{option}: {kind} takes {wanted} after a colon, got '{text}'")
    middle = width / 2.0
    if kind == "cylinder":
        return Cylinder(given[0], middle)
    if kind == "cone":
        return Cone(given[0], given[1] if len(given) == 2 else LEAN, middle)
    if kind == "sphere":
        return Sphere(given[0], given[1] if len(given) == 2 else 0.0, middle)
    return _twist(option, given[0], width, height) if kind == "twist" else Plane()


def opening(option: str, text: str) -> "Opening":
    """Read X,Z,W,H[,lintel|arch]: left jamb, sill, clear width and height."""
    from cyclopean.design.walls.openings import Opening

    first, comma, last = text.rpartition(",")
    head = last if comma and last.isalpha() else "lintel"
    values = numbers(option, first if comma and last.isalpha() else text)
    if len(values) != 4:
        raise InputError(f"{option}: '{text}' should be X,Z,W,H or X,Z,W,H,arch")
    left, sill, width, height = values
    arched = choice(option, head, ("lintel", "arch")) == "arch"
    return Opening(left, width, height, sill, "arch" if arched else "lintel")


def quoins(option: str, text: str | None, depth: float | None = None) -> "Quoins | None":
    """Read LONG,SHORT[,HEIGHT] or auto; None where the option was not given.

    At a corner of walls of a known depth (m), short quoins are as wide as the walls are deep.
    """
    from cyclopean.design.walls.dressing import Quoins

    if text is None:
        return None
    if text == AUTO and depth is not None:
        from dataclasses import replace

        from cyclopean.design.walls.corner import corner_quoins

        return replace(corner_quoins(depth), left=True)
    if text == AUTO:
        return Quoins()
    long, short, *high = _some(option, text, "LONG,SHORT[,HEIGHT] or auto", 2, 3)
    return Quoins(long, short, high[0] if high else None)


def coping(option: str, text: str | None) -> "Coping | None":
    """Read HEIGHT[,LENGTH] or auto; None where the option was not given."""
    from cyclopean.design.walls.dressing import Coping

    if text is None:
        return None
    return Coping() if text == AUTO else Coping(*_some(option, text, "HEIGHT[,LENGTH] or auto", 1, 2))


def base(option: str, text: str | None) -> tuple[tuple[tuple[float, float], ...] | None, float | None]:
    """Read U:V,U:V,... (a line of heights) or radius:R: the line, and the radius of round ground."""
    if text is None:
        return None, None
    if text.startswith("radius:"):
        return None, number(option, text.removeprefix("radius:"))
    points = []
    for part in text.split(","):
        u, colon, v = part.partition(":")
        if not colon:
            raise InputError(f"{option}: '{text}' should be U:V,U:V,... or radius:R")
        points.append((number(option, u), number(option, v)))
    return tuple(points), None


def _some(option: str, text: str, form: str, least: int, most: int) -> tuple[float, ...]:
    values = numbers(option, text)
    if not least <= len(values) <= most:
        raise InputError(f"{option}: '{text}' should be {form}")
    return values


def _twist(option: str, degrees: float, width: float, height: float) -> "Surface":
    """Straight foot, and a straight top turned in plan about the middle."""
    from cyclopean.design.walls.surfaces import Twist

    if not abs(degrees) <= 80.0:
        raise InputError(f"{option}: a twist of {degrees:g} degrees is too much; at most 80")
    return Twist(degrees, width, height)
