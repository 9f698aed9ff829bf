"""Small structures whose building can be followed by hand."""

import numpy as np

from cyclopean.assembly import Assembly, Block


def prism(name: str, outline: list[tuple[float, float]], depth: float = 1.0, fixed: bool = False) -> Block:
    """A polygon in x and z, counter-clockwise seen from -y, drawn out from y = 0 to `depth`."""
    n = len(outline)
    vertices = np.array([(x, y, z) for y in (0.0, depth) for x, z in outline])
    sides = [(i, n + i, n + (i + 1) % n, (i + 1) % n) for i in range(n)]
    return Block(name, vertices, (tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1)), *sides), fixed=fixed)


def box(name: str, x: tuple[float, float], z: tuple[float, float], fixed: bool = False) -> Block:
    return prism(name, [(x[0], z[0]), (x[1], z[0]), (x[1], z[1]), (x[0], z[1])], fixed=fixed)


def diamond() -> Assembly:
    """Four squares on their corners: left and right rest on the fixed bottom by joints of 45 degrees, top on both."""

    def square(name: str, x: float, z: float, fixed: bool = False) -> Block:
        return prism(name, [(x, z - 1.0), (x + 1.0, z), (x, z + 1.0), (x - 1.0, z)], fixed=fixed)

    return Assembly(
        (square("bottom", 0, 1, True), square("left", -1, 2), square("right", 1, 2), square("top", 0, 3)),
        name="diamond",
    )


def interlocked() -> Assembly:
    """A tongue of `b` in the mouth of `a`: b rests on a by 1 m2, a's lip on b by half of that, both on the ground."""
    a = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (1.5, 2), (1.5, 3), (0, 3)]
    b = [(2, 0), (3, 0), (3, 2), (1, 2), (1, 1), (2, 1)]
    return Assembly((box("ground", (-1, 4), (-1, 0), True), prism("a", a), prism("b", b)), name="interlocked pair")


def four_legs(r: float = 4.0, R: float = 5.0) -> Assembly:
    """Two arches that cross in one keystone: on each of four legs a springer, a lower and an upper voussoir."""
    low, mid, top = np.pi / 2.0, np.radians(55.0), np.radians(20.0)  # from the vertical
    half = r * np.sin(top)

    def voussoir(name: str, start: float, end: float, turn: int, fixed: bool = False) -> Block:
        ring = [(rad * np.sin(t), rad * np.cos(t)) for rad, t in ((r, end), (r, start), (R, start), (R, end))]
        flat = prism("", ring, 2.0 * half).vertices - [0.0, half, 0.0]
        c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][turn]
        return Block(name, flat @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), prism("", ring).faces, fixed=fixed)

    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    rings = [[(x * k * np.sin(top), y * k * np.sin(top), k * np.cos(top)) for x, y in corners] for k in (r, R)]
    faces = ((3, 2, 1, 0), (4, 5, 6, 7), *((i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i) for i in range(4)))
    stones = [voussoir(f"springer-{k}", low + 0.1, low, k, True) for k in range(4)]
    stones += [voussoir(f"lower-{k}", low, mid, k) for k in range(4)]
    stones += [voussoir(f"upper-{k}", mid, top, k) for k in range(4)]
    return Assembly((*stones, Block("key", np.array(rings[0] + rings[1]), faces)), name="four-legged arch")
