"""Read a mesh file, see where the stones touch, ask whether they stand.

Two posts and a lintel, drawn in millimetres as a modelling program would export them. An OBJ file holds no contacts,
no supports, no density and no unit: contacts are found, the lowest blocks become supports, the rest is assumed or told.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import cyclopean


def cuboid(name: str, low: tuple[int, int, int], high: tuple[int, int, int], before: int) -> str:
    """One OBJ object; `before` vertices stand above it in the file."""
    (x, y, z), (X, Y, Z) = low, high
    corners = [(x, y, z), (X, y, z), (X, Y, z), (x, Y, z), (x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z)]
    faces = [(1, 4, 3, 2), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8)]
    lines = [f"o {name}", *("v {} {} {}".format(*c) for c in corners)]
    return "\n".join([*lines, *("f " + " ".join(str(before + i) for i in face) for face in faces)]) + "\n"


drawing = (
    cuboid("left", (0, 0, 0), (400, 400, 2000), 0)
    + cuboid("right", (1600, 0, 0), (2000, 400, 2000), 8)
    + cuboid("lintel", (0, 0, 2000), (2000, 400, 2400), 16)
)
with TemporaryDirectory() as folder:
    path = Path(folder) / "lintel.obj"
    path.write_text(drawing)
    model, warnings = cyclopean.read_model(path, units="mm")

print("\n".join(warnings))
found = cyclopean.detect(model)
for a, b, area in zip(found.contacts.a, found.contacts.b, found.contacts.area, strict=True):
    print(f"{model.blocks[a].id} touches {model.blocks[b].id} over {area:.2f} m2")
assert [round(float(area), 9) for area in found.contacts.area] == [0.16, 0.16]

result = cyclopean.check(model, cyclopean.Settings(density=2600.0, mu=0.6))
print(f"{result.verdict}; assumed: {', '.join(result.assumed)}")
assert result.verdict == "stable"
assert result.force is not None

# Half of the lintel rests on each post: 2600 kg/m3 x 0.32 m3 x 9.80665 m/s2 / 2.
on_the_left = float(result.force[:4, 0].sum())
print(f"the left post carries {on_the_left:.1f} N")
assert abs(on_the_left - 2600 * 0.32 * 9.80665 / 2) < 1e-3
