"""Blocks of a certificate have to bound solids, and the claim tells of what is odd about them.

Meshes made by hand, beside a cube that stands on the ground, upright and turned by rotations that keep every
coordinate exact: a quaternion (a, b, c, d) of whole numbers turns multiples of a^2 + b^2 + c^2 + d^2 into whole
numbers. Random solids of unit cells, of which the number of pieces is known.
"""

import copy
import itertools
import random

import numpy as np
import pytest
from scipy.optimize import linprog

from cyclopean.proof import checker, verify
from test_proof_checker import CUBE_FACES, box, contact, cube_on_ground, level, sealed

# --- meshes ----------------------------------------------------------------------------------------------------------


def cuboid(low, high):
    corners = box("", low, high)
    return corners["vertices"], CUBE_FACES


def inward(mesh):
    return mesh[0], [face[::-1] for face in mesh[1]]


def joined(*meshes):
    vertices, faces = [], []
    for more, around in meshes:
        faces += [[i + len(vertices) for i in face] for face in around]
        vertices += more
    return vertices, faces


def extruded(outline, low=0, high=1):
    """Prism along y over an outline (x, z), clockwise seen along y."""
    n = len(outline)
    vertices = [[x, y, z] for y in (low, high) for x, z in outline]
    sides = [[i, n + i, n + (i + 1) % n, (i + 1) % n] for i in range(n)]
    return vertices, [list(range(n)), list(range(n, 2 * n))[::-1], *sides]


def fans(mesh, turn=0):
    """The same mesh in triangles, fans from the corner `turn` of each face: right for convex faces."""
    rings = [[*face[turn:], *face[:turn]] for face in mesh[1]]
    return mesh[0], [[ring[0], i, j] for ring in rings for i, j in itertools.pairwise(ring[1:])]


U = [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)]
STEPS = [(0, 0), (3, 0), (3, 1), (2, 1), (2, 2), (1, 2), (1, 3), (0, 3)]
COMB = [(0, 0), (9, 0), *((9 - k // 2 - (k % 2), 3 if k % 4 < 2 else 1) for k in range(18)), (0, 3)]


def tube():
    """Square ring: its top and bottom are four trapezoids each, in one plane."""
    square = [(0, 0), (3, 0), (3, 3), (0, 3)], [(1, 1), (2, 1), (2, 2), (1, 2)]
    vertices = [[x, y, z] for z in (0, 1) for ring in square for x, y in ring]
    faces = []
    for i in range(4):
        j = (i + 1) % 4
        faces += [
            [8 + i, 8 + j, 12 + j, 12 + i],
            [i, 4 + i, 4 + j, j],
            [i, j, 8 + j, 8 + i],
            [4 + j, 4 + i, 12 + i, 12 + j],
        ]
    return vertices, faces


def step_of_l():
    """Cube of two without one of its eight cells: three L-shaped faces, fans of which cover too much."""
    cut = [(2, 2, 1), (2, 1, 2), (1, 2, 2), (2, 1, 1), (1, 2, 1), (1, 1, 2), (1, 1, 1)]
    points = [*itertools.product((0, 2), repeat=3)][:-1]
    points += cut
    index = {p: i for i, p in enumerate(points)}
    rings = [
        [(0, 0, 0), (0, 2, 0), (2, 2, 0), (2, 0, 0)], [(0, 0, 0), (2, 0, 0), (2, 0, 2), (0, 0, 2)],
        [(0, 0, 0), (0, 0, 2), (0, 2, 2), (0, 2, 0)],
        [(2, 1, 1), (2, 1, 2), (2, 0, 2), (2, 0, 0), (2, 2, 0), (2, 2, 1)],
        [(1, 2, 1), (2, 2, 1), (2, 2, 0), (0, 2, 0), (0, 2, 2), (1, 2, 2)],
        [(1, 1, 2), (1, 2, 2), (0, 2, 2), (0, 0, 2), (2, 0, 2), (2, 1, 2)],
        [(1, 1, 1), (2, 1, 1), (2, 2, 1), (1, 2, 1)], [(1, 1, 1), (1, 2, 1), (1, 2, 2), (1, 1, 2)],
        [(1, 1, 1), (1, 1, 2), (2, 1, 2), (2, 1, 1)],
    ]  # fmt: skip
    return [list(p) for p in points], [[index[p] for p in ring] for ring in rings]


BLOCK = cuboid((0, 0, 0), (4, 4, 4))
HOLE = inward(cuboid((1, 1, 1), (3, 3, 3)))
SHEET = [[0, 0, 6], [1, 0, 6], [1, 1, 6], [0, 1, 6]]
OCTAHEDRON = (
    [[3, 2, 2], [2, 3, 2], [2, 2, 3], [1, 2, 2], [2, 1, 2], [2, 2, 1]],
    [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]],
)
SOLIDS = {
    "cube": (BLOCK, 1),
    "cube in triangles": (fans(BLOCK), 1),
    "hexagonal prism": (extruded([(0, 1), (1, 0), (2, 0), (3, 1), (2, 2), (1, 2)]), 1),
    "U": (extruded(U), 1),
    "stairs": (extruded(STEPS), 1),
    "comb": (extruded(COMB), 1),
    "tube": (tube(), 1),
    "tube in triangles": (fans(tube()), 1),
    "cube without a corner": (step_of_l(), 1),
    "hollow": (joined(BLOCK, HOLE), 1),
    "hollow, in triangles": (fans(joined(HOLE, BLOCK)), 1),
    "hollow with a loose stone": (joined(BLOCK, HOLE, cuboid((1.5, 1.5, 1.5), (2, 2, 2))), 2),
    "hollow with a stone that touches all sides": (joined(BLOCK, HOLE, OCTAHEDRON), 2),
    "two holes": (joined(BLOCK, inward(cuboid((1, 1, 1), (2, 2, 2))), inward(cuboid((2.5, 2, 2), (3, 3, 3)))), 1),
    "two pieces": (joined(BLOCK, cuboid((5, 0, 0), (6, 1, 1))), 2),
    "pieces that meet in an edge": (joined(cuboid((0, 0, 0), (1, 1, 1)), cuboid((1, 0, 1), (2, 1, 2))), 2),
    "pieces that meet in a corner": (joined(cuboid((0, 0, 0), (1, 1, 1)), cuboid((1, 1, 1), (2, 2, 2))), 2),
    "piece in the mouth of a U": (joined(extruded(U), cuboid((1.25, 0, 1.25), (1.75, 1, 3))), 2),
}
SLIT = [(0, 0), (4, 0), (4, 2), (2, 2), (2, 1), (2, 1), (2, 2), (0, 2)]
BRIM = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1], [2, 0, 1], [2, 1, 1]]
BRIMMED = (
    BRIM,
    [[0, 3, 2, 1], [0, 1, 5, 4], [2, 3, 7, 6], [3, 0, 4, 7], [1, 2, 6, 5], [4, 5, 8, 9, 6, 7], [6, 9, 8, 5]],
)


def twice_round():
    """A cube's surface that goes round twice, as a sphere over two branch points: corners 0 and 5, cut by way of 1.

    All its edges close, it is one shell, and every corner is behind every face.
    """
    vertices, faces = cuboid((0, 0, 0), (1, 1, 1))
    rings = []
    for sheet in (0, 1):
        for face in faces:
            left = {0, 1, 5} <= set(face)
            copied = {i: i if i in (0, 5) else i + 8 * sheet for i in face}
            if 1 in face:
                copied[1] = 1 + 8 * (sheet if left else 1 - sheet)
            rings.append([copied[i] for i in face])
    return vertices + vertices, rings


FAULTY = {
    "sheet": (joined(BLOCK, (SHEET, [[0, 1, 2, 3], [3, 2, 1, 0]])), "no volume (faces 6 and 7)"),
    "sheet in triangles": (joined(BLOCK, (SHEET, [[0, 1, 2], [0, 2, 3], [3, 2, 1], [3, 1, 0]])), "has no volume"),
    "inside out, apart": (joined(BLOCK, inward(cuboid((5, 0, 0), (6, 1, 1)))), "turned inside out (faces 6"),
    "inside out, boxes overlap": (joined(extruded(U), inward(cuboid((1.2, 0.2, 1.2), (1.5, 0.5, 1.5)))), "inside out"),
    "stone in stone": (joined(BLOCK, cuboid((1, 1, 1), (3, 3, 3))), "stone that would count twice (faces 6"),
    "stone in stone, another piece between them": (
        joined(BLOCK, cuboid((9, 0.5, 0), (10, 2, 1)), cuboid((1, 1, 1), (3, 3, 3))),
        "stone that would count twice (faces 12",
    ),
    "stone twice": (joined(BLOCK, BLOCK), "lies on another"),
    "stone twice, other triangles": (joined(fans(BLOCK), fans(BLOCK, 1)), "lies on another"),
    "hole in a hole": (joined(BLOCK, HOLE, inward(cuboid((1.5, 1.5, 1.5), (2, 2, 2)))), "turned inside out (faces 12"),
    "hole up to the top": (joined(BLOCK, inward(cuboid((1, 1, 1), (3, 3, 4)))), "faces 1 and 7 lie on each other back"),
    "pieces back to back": (joined(BLOCK, cuboid((4, 1, 1), (5, 2, 2))), "faces 3 and 11 lie on each other back"),
    "cubes face to face": (joined(cuboid((0, 0, 0), (1, 1, 1)), cuboid((1, 0, 0), (2, 1, 1))), "faces 3 and 11 lie on"),
    "cut without width": (extruded(SLIT), "lie on each other"),
    "brim without thickness": (BRIMMED, "faces 5 and 6 lie on each other back to back"),
    "top twice": (joined(BLOCK, cuboid((3, 1, 3), (5, 2, 4))), "twice"),
    "crossing pieces": (joined(cuboid((0, 1, 0), (3, 2, 1)), cuboid((1, 0, 0), (2, 3, 1))), "facing the same way"),
    "crossed face": (extruded([(0, 2), (3, 0), (3, 3), (0, 0)]), "crosses itself"),
    "twice round": (twice_round(), "lie on each other"),
}  # fmt: skip


# --- what the checker says -------------------------------------------------------------------------------------------


def beside_cube(mesh, shift=(40, 0, 0), scale=1.0):
    """The certificate of a cube on the ground, with one more support of this mesh."""
    vertices = [[float(scale * x + s) for x, s in zip(vertex, shift, strict=True)] for vertex in mesh[0]]
    odd = {"id": "odd", "vertices": vertices, "faces": copy.deepcopy(mesh[1]), "density": 1.0, "fixed": True}
    given = cube_on_ground()
    return sealed({**given, "blocks": [*given["blocks"], odd]})


def turned(mesh, rng):
    """The mesh, larger and turned, without any rounding."""
    a, b, c, d = (rng.randint(-3, 3) for _ in range(4))
    a += not any((a, b, c, d))
    rotation = np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
    )
    return (np.array(mesh[0]) @ rotation.T).tolist(), mesh[1]


def rotated(mesh, seed):
    """The mesh turned, and rounded to doubles."""
    q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    q *= np.linalg.det(q)
    return (np.array(mesh[0], float) @ q.T).tolist(), mesh[1]


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_pass_and_pieces_are_told(name):
    mesh, pieces = SOLIDS[name]
    rng = random.Random(name)
    for given in [mesh, *(turned(mesh, rng) for _ in range(4)), rotated(mesh, 1), rotated(mesh, 2)]:
        report = verify(beside_cube(given, (400, 0, 0)))
        assert report.proved, report.reason
        assert ("1 block of several detached pieces" in report.claim) is (pieces > 1)
        assert report.figures.get("pieces") == (1.0 if pieces > 1 else None)


@pytest.mark.parametrize("name", FAULTY)
def test_meshes_that_bound_no_solid_are_refused(name):
    mesh, reason = FAULTY[name]
    rng = random.Random(name)
    report = verify(beside_cube(mesh))
    assert not report.proved
    assert report.reason.startswith("block odd: ")
    assert reason in report.reason
    for given in (turned(mesh, rng) for _ in range(4)):
        other = verify(beside_cube(given, (400, 0, 0)))
        assert not other.proved
        assert "\n" not in other.reason
        assert other.reason.startswith("block odd: ")
        assert "volume is not positive" not in other.reason


WHOLE = [
    "sheet", "sheet in triangles", "stone twice", "inside out, apart", "twice round", "cubes face to face",
    "cut without width",
]  # fmt: skip


@pytest.mark.parametrize("name", WHOLE)
def test_rounding_hides_nothing_of_whole_shells(name):
    for seed in range(5):
        report = verify(beside_cube(rotated(FAULTY[name][0], seed)))
        assert not report.proved
        assert report.reason.startswith("block odd: ")


@pytest.mark.parametrize("what", ["membrane", "inverted shell"])
def test_what_held_a_floating_stone(what):
    """A sheet under a stone four metres up; a counterweight that is turned inside out."""
    if what == "membrane":
        sheet = [[0, 0, 5], [1, 0, 5], [1, 1, 5], [0, 1, 5]]
        ground = joined(cuboid((0, 0, 0), (1, 1, 1)), (sheet, [[0, 1, 2, 3], [3, 2, 1, 0]]))
        stone, place = cuboid((0, 0, 5), (1, 1, 6)), level(0, 0, 1, 1, 5)
    else:
        ground = cuboid((0, 0, 0), (1, 1, 1))
        stone = joined(cuboid((0.5, 0, 1), (3, 1, 2)), inward(cuboid((4, 0, 1), (4.75, 1, 2))))
        place = level(0.5, 0, 1, 1, 1)
    blocks = [
        {"id": name, "vertices": vertices, "faces": faces, "density": 2400.0, "fixed": name == "ground"}
        for name, (vertices, faces) in (("ground", ground), ("stone", stone))
    ]
    blocks = [{**b, "vertices": [[float(x) for x in v] for v in b["vertices"]]} for b in blocks]
    given = {**cube_on_ground(), "blocks": blocks, "contacts": [contact("ground", "stone", place)]}
    report = verify(sealed(given))
    assert not report.proved
    assert ("has no volume" if what == "membrane" else "turned inside out") in report.reason


def test_equal_blocks_are_looked_at_once(monkeypatch):
    calls = []
    real = checker._require_single_faces
    monkeypatch.setattr(checker, "_require_single_faces", lambda *a: (calls.append(1), real(*a)))
    given = beside_cube(extruded(U))
    odd = given["blocks"][-1]
    more = [
        {**odd, "id": f"odd {k}", "vertices": [[x, y + 8.0 * k, z] for x, y, z in odd["vertices"]]} for k in range(5)
    ]
    assert verify(sealed({**given, "blocks": [*given["blocks"], *more]})).proved
    assert len(calls) == 1


# --- laws ------------------------------------------------------------------------------------------------------------


def of_cells(cells):
    """Surface of a set of unit cells, in squares; None where an edge would have four faces."""
    index, faces = {}, []
    for cell in sorted(cells):
        for axis, side in itertools.product(range(3), (0, 1)):
            other = list(cell)
            other[axis] += 2 * side - 1
            if tuple(other) not in cells:
                ring = []
                for u, v in ((0, 0), (1, 0), (1, 1), (0, 1))[:: 1 if side else -1]:
                    corner = list(cell)
                    corner[axis] += side
                    corner[(axis + 1) % 3] += u
                    corner[(axis + 2) % 3] += v
                    ring.append(index.setdefault(tuple(corner), len(index)))
                faces.append(ring)
    return ([list(p) for p in index], faces) if checker._is_closed(faces) else None


def parts_of(cells):
    """Number of parts that hang together by sides of cells."""
    left, parts = set(cells), 0
    while left:
        parts += 1
        todo = [left.pop()]
        while todo:
            cell = todo.pop()
            for axis, step in itertools.product(range(3), (-1, 1)):
                other = (*cell[:axis], cell[axis] + step, *cell[axis + 1 :])
                if other in left:
                    left.remove(other)
                    todo.append(other)
    return parts


def solid_of(mesh):
    vertices = [tuple(int(4 * x) for x in v) for v in mesh[0]]
    faces = tuple(map(tuple, mesh[1]))
    surface = checker._Surface(faces, frozenset(range(len(vertices))), True, checker._shells(faces))
    return checker._require_solid("odd", surface, vertices)[0]


def test_random_cells_bound_as_many_pieces_as_they_have_parts():
    rng = random.Random(5)
    seen = {}
    for _ in range(250):
        size, share = rng.choice([(3, 0.5), (4, 0.25), (5, 0.93), (6, 0.06)])
        cells = {c for c in itertools.product(range(size), repeat=3) if rng.random() < share}
        mesh = of_cells(cells)
        if mesh is None or not cells:
            continue
        pieces = solid_of(turned(mesh, rng))
        assert pieces == parts_of(cells)
        shells = checker._shells(mesh[1])
        seen[pieces, len(shells)] = seen.get((pieces, len(shells)), 0) + 1
        for shell in shells if len(shells) > 1 else ():
            flipped = [face[::-1] if k in shell else face for k, face in enumerate(mesh[1])]
            with pytest.raises(checker._RefusedError, match=r"inside out|count twice"):
                solid_of((mesh[0], flipped))
    assert any(pieces > 2 for pieces, _ in seen)
    assert any(shells > pieces for pieces, shells in seen), "no hole was tried"


def test_winding_is_one_in_cells_and_nothing_outside():
    rng = random.Random(6)
    tried = 0
    while tried < 25:
        cells = {c for c in itertools.product(range(3), repeat=3) if rng.random() < 0.5}
        mesh = of_cells(cells)
        if mesh is None or not cells:
            continue
        tried += 1
        vertices = [tuple(4 * x for x in v) for v in mesh[0]]
        surface = checker._Surface(mesh[1], frozenset(), True)
        shell = checker._shell("", surface, range(len(mesh[1])), vertices, 0)
        for _ in range(60):
            point = tuple(rng.randint(-2, 14) for _ in range(3))
            around = {
                tuple((x - (x % 4 == 0) * back) // 4 for x, back in zip(point, side, strict=True)) in cells
                for side in itertools.product((0, 1), repeat=3)
            }
            expected = None if len(around) == 2 else int(True in around)
            assert checker._winding(shell.triangles, point) == expected


def have_area_in_common(one, two):
    """Triangles, counter-clockwise: no edge of either keeps them apart."""
    for first, second in ((one, two), (two, one)):
        for (ax, ay), (bx, by) in zip(first, first[1:] + first[:1], strict=True):
            if all((bx - ax) * (y - ay) - (by - ay) * (x - ax) <= 0 for x, y in second):
                return False
    return True


def test_the_sweep_finds_exactly_the_overlaps():
    """Random triangles on a small grid, so that corners, edges and whole triangles coincide often."""
    rng = random.Random(7)
    found = 0
    for _ in range(4000):
        rings = []
        while len(rings) < rng.choice((2, 2, 3, 5)):
            ring = [(rng.randint(0, 4), rng.randint(0, 4)) for _ in range(3)]
            (ax, ay), (bx, by), (cx, cy) = ring
            area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
            if area and not (
                rings
                and rng.random() < 0.7
                and any(have_area_in_common(r, ring[:: 1 if area > 0 else -1]) for r in rings)
            ):
                rings.append(ring if area > 0 else ring[::-1])
        expected = any(have_area_in_common(a, b) for a, b in itertools.combinations(rings, 2))
        pieces = [checker._Piece(k, ring, bool(k % 2)) for k, ring in enumerate(rings)]
        found += expected
        if expected:
            with pytest.raises(checker._RefusedError) as refusal:
                checker._require_apart("", pieces)
            named = [int(word) for word in str(refusal.value).replace(":", " ").split() if word.isdigit()]
            assert have_area_in_common(*(rings[k] for k in named))
            assert ("same way" in str(refusal.value)) is (named[0] % 2 == named[1] % 2)
        else:
            checker._require_apart("", pieces)
    assert 500 < found < 3500


def test_edges_that_become_neighbours_in_several_places_at_once_are_all_looked_at():
    rings = [[(1, 1), (4, 2), (4, 3)], [(0, 4), (0, 1), (2, 2)], [(3, 3), (1, 3), (3, 1)]]
    with pytest.raises(checker._RefusedError, match="faces 0 and 2 lie on each other"):
        checker._require_apart("", [checker._Piece(k, ring, False) for k, ring in enumerate(rings)])


# --- work that is bounded --------------------------------------------------------------------------------------------


def comb(teeth):
    """A plate whose outline goes up and down: one face of thousands of corners."""
    rng = random.Random(8)
    top = [(2 * teeth - k + rng.random() / 2, 900 + rng.random() if k % 2 else rng.random()) for k in range(2 * teeth)]
    return extruded([(0, -5), (2 * teeth + 1, -5), *top])


def nested(count):
    """Shells each around the next, outward and inward by turns."""
    meshes = [cuboid((k, k, k), (9999 - k, 9999 - k, 9999 - k)) for k in range(count)]
    return joined(*(inward(mesh) if k % 2 else mesh for k, mesh in enumerate(meshes)))


BESIDE = joined(*(cuboid((0, 0, 3 * k), (1, 1, 3 * k + 1)) for k in range(700)))
STRIPS = joined(*(cuboid((k, side * 3 * k, 0), (999, side * 3 * k + 1, 1)) for k in range(1, 300) for side in (-1, 1)))
LARGE = {
    "comb": (comb(500), None),
    "strips": (STRIPS, "too many faces in one plane"),
    "piled": (BESIDE, None),
    "nested": (nested(40), "too many shells of its mesh are beside each other"),
}


@pytest.mark.parametrize("name", LARGE)
def test_what_would_take_too_long_is_refused(name):
    mesh, reason = LARGE[name]
    report = verify(beside_cube(mesh, (9e4, 0, 0)))
    assert report.proved is (reason is None)
    assert reason is None or report.reason == f"block odd: {reason}"


# --- blocks that run into each other ---------------------------------------------------------------------------------


def told(*blocks):
    """What is told of blocks beside a cube on the ground."""
    given = cube_on_ground()
    return verify(sealed({**given, "blocks": [*given["blocks"], *blocks]}))


def test_an_overlap_is_told_with_its_depth():
    low = box("low", [20, 0, 0], [21, 1, 1])
    report = told({**low, "fixed": True}, box("high", [20, 0, 0.875], [21, 1, 2], fixed=True))
    assert "run into" not in report.claim, "fixed blocks may"
    given = cube_on_ground()
    cube = box("neighbour", [0.375, -0.25, 0.25], [1, 0.25, 0.75], fixed=True)
    other = box("other", [-1, -0.25, 0.25], [-0.4375, 0.25, 0.75], fixed=True)
    report = verify(sealed({**given, "blocks": [*given["blocks"], cube, other]}))
    assert report.proved
    assert ", blocks 'cube' and 'neighbour' run into each other by 0.125 m (and 1 more pair);" in report.claim
    assert report.figures["overlap"] == pytest.approx(0.125, abs=1e-9)


def test_blocks_that_are_not_convex_are_not_looked_at():
    given = cube_on_ground()
    vertices = [[x / 1.0 - 1.5, y - 0.5, z - 0.5] for x, y, z in extruded(U)[0]]
    around = {**box("around", [0, 0, 0], [1, 1, 1], fixed=True), "vertices": vertices, "faces": extruded(U)[1]}
    report = verify(sealed({**given, "blocks": [*given["blocks"], around]}))
    assert report.proved
    assert "overlaps   none of 1 pair of blocks, not convex or of many faces, that were not looked at" in report.assumed
    assert "overlap" not in report.figures


def overlaps_of(blocks):
    """Depth and numbers of the pairs that run into each other, and how many were not looked at."""
    given = cube_on_ground()
    sheet = checker._read(sealed({**given, "blocks": [*given["blocks"], *blocks]}))
    return checker._overlaps(checker._weigh(sheet))


def test_depths_of_random_boxes():
    """Boxes share a ball of radius r iff a linear programme says so, edge against edge too; depth 2 r at least."""
    rng = np.random.default_rng(9)
    shared = 0
    for _ in range(150):
        blocks, rows, bounds = [], [], []
        for name in ("one", "two"):
            q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            q *= np.linalg.det(q)
            half, centre = rng.uniform(0.2, 1.0, 3), rng.uniform([29.1, -0.9, -0.9], [30.9, 0.9, 0.9])
            corners = np.array(box("", -half, half)["vertices"]) @ q.T + centre
            blocks.append({**box(name, [0, 0, 0], [1, 1, 1]), "vertices": corners.tolist()})
            for sign in (1, -1):
                rows += [[*(sign * q[:, k]), 1.0] for k in range(3)]
                bounds += [half[k] + sign * float(q[:, k] @ centre) for k in range(3)]
        best = linprog([0, 0, 0, -1], A_ub=rows, b_ub=bounds, bounds=[(None, None)] * 4)
        radius = -best.fun
        found, unseen = overlaps_of(blocks)
        assert unseen == 0
        if abs(radius) > 1e-5:
            assert (len(found) == 1) is (radius > 0)
        if radius > 1e-5:
            shared += 1
            depth, *names = found[0]
            assert depth >= 2 * radius * (1 - 1e-9)
            assert names == [2, 3]
            moved = [dict(blocks[0]), dict(blocks[1])]
            moved[0]["vertices"] = (1000 * np.array(moved[0]["vertices"])).tolist()
            moved[1]["vertices"] = (1000 * np.array(moved[1]["vertices"])).tolist()
            assert overlaps_of(moved)[0][0][0] == pytest.approx(1000 * depth, rel=1e-6)
    assert 30 < shared < 120


def test_many_blocks_in_many_places_are_compared_with_those_near():
    """Every pair of random boxes with sides along the axes, against all pairs compared one by one."""
    rng = np.random.default_rng(10)
    low = rng.uniform(0, 12, (250, 3))
    high = low + rng.choice([0.3, 1.0, 16.0], (250, 1), p=[0.6, 0.39, 0.01]) * rng.uniform(0.5, 1.0, (250, 3))
    blocks = [box(f"b{k}", (low[k] + [50, 0, 0]).tolist(), (high[k] + [50, 0, 0]).tolist()) for k in range(250)]
    both = np.minimum(high[:, None], high) - np.maximum(low[:, None], low)
    depth = np.minimum(high[:, None] - low, high - low[:, None]).min(axis=2)
    pairs = np.argwhere(np.triu((both > 1e-6).all(axis=2), 1))
    found, _ = overlaps_of(blocks)
    assert len(found) == len(pairs) > 20
    assert max(found)[0] == pytest.approx(max(depth[i, j] for i, j in pairs), rel=1e-9)
    for k in (1, 2):
        turned_blocks = [{**b, "vertices": rotated((b["vertices"], []), k)[0]} for b in blocks]
        again, _ = overlaps_of(turned_blocks)
        assert len(again) == len(found)
        assert max(again)[0] == pytest.approx(max(found)[0], rel=1e-6)


@pytest.mark.parametrize(("limit", "at"), [("MAX_BOXES", (0, 99)), ("MAX_BOXES", (99, 0)), ("MAX_PROJECTED", 0)])
def test_what_takes_too_long_is_told_not_kept_quiet(monkeypatch, limit, at):
    monkeypatch.setattr(checker, limit, at)
    report = told(*(box(f"b{k}", [20 + k / 4, 0, 0], [21 + k / 4, 1, 1]) for k in range(9)))
    assert any("not looked at" in line for line in report.assumed)
    assert "run into" not in report.claim


@pytest.mark.parametrize("scale", [1e-90, 1e-20, 1e90])
def test_absurd_sizes_raise_nothing(scale):
    blocks = [box("one", [0, 0, 0], [2, 2, 2]), box("two", [1, 1, 1], [3, 3, 3])]
    blocks = [{**b, "vertices": (scale * np.array(b["vertices"])).tolist()} for b in blocks]
    assert verify(sealed({**cube_on_ground(), "blocks": blocks, "contacts": [], "forces": []})).reason
    assert all(depth > 0.0 for depth, *_ in overlaps_of(blocks)[0])
