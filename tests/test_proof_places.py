"""Contacts on blocks of many faces: those near it are found by place, and how many are looked at is bounded."""

import itertools
import json
import math
import random

import pytest

from cyclopean.io import json_text, write_json
from cyclopean.proof import checker, seal, verify, verify_file
from laws import examples
from test_proof_checker import CUBE, GROUND, W, box, contact, cube_on_ground, level, mechanism, sealed, state

DOWN = [0, 0, -1, 0, 0, 0]


def meshed(name, xs, ys, top=None):
    """A block under z = 0 whose top and bottom are divided at these coordinates; `top` are heights at the corners."""
    n, m = len(xs), len(ys)
    heights = [0.0] * (n * m) if top is None else top
    vertices = [[x, y, heights[i * m + j]] for i, x in enumerate(xs) for j, y in enumerate(ys)]
    vertices += [[x, y, -1.0] for x in xs for y in ys]

    def at(i, j, low=0):
        return low * n * m + i * m + j

    faces = []
    for i, j in itertools.product(range(n - 1), range(m - 1)):
        faces.append([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
        faces.append([at(i, j + 1, 1), at(i + 1, j + 1, 1), at(i + 1, j, 1), at(i, j, 1)])
    for i in range(n - 1):
        faces.append([at(i, 0, 1), at(i + 1, 0, 1), at(i + 1, 0), at(i, 0)])
        faces.append([at(i + 1, m - 1, 1), at(i, m - 1, 1), at(i, m - 1), at(i + 1, m - 1)])
    for j in range(m - 1):
        faces.append([at(0, j + 1, 1), at(0, j, 1), at(0, j), at(0, j + 1)])
        faces.append([at(n - 1, j, 1), at(n - 1, j + 1, 1), at(n - 1, j + 1), at(n - 1, j)])
    return {**box(name, [0, 0, 0], [1, 1, 1], fixed=True), "vertices": vertices, "faces": faces}


def places(rng):
    """Contacts anywhere on bumpy ground, on its edge or beside it, leaning or not; some rough."""
    xs, ys = (sorted(rng.sample(range(-9, 10), rng.randint(2, 7))) for _ in range(2))
    bump = rng.choice([0.0, 0.0, 1e-3, 2e-2])
    ground = meshed("ground", xs, ys, [bump * rng.random() for _ in range(len(xs) * len(ys))])
    blocks, joints = [ground, box("cube", [-9, -9, 0], [9, 9, 4])], []
    for _ in range(rng.randint(1, 6)):
        x, y = rng.choice(xs[:-1]) + rng.choice([0, 0.25]), rng.choice(ys[:-1]) + rng.choice([0, 0.5])
        x1, y1 = x + rng.choice([0.5, 1, 3]), y + rng.choice([0.5, 2])
        polygon = level(x, y, min(x1, 9), min(y1, 9), rng.choice([0.0, bump / 2]))
        polygon[0][2] += rng.choice([0.0, 0.0, bump / 4])
        if rng.random() < 0.3:
            polygon = [[(x + x1) / 2 + math.cos(t / 3), (y + y1) / 2 + math.sin(t / 3), 0.0] for t in range(19)]
        joints.append(contact("ground", "cube", polygon) | ({"surface": "rough"} if rng.random() < 0.5 else {}))
    return mechanism(blocks, joints, {"cube": DOWN}, tolerance=rng.choice([1e-6, 1e-3, 5e-2]))


def test_short_ways_change_nothing(monkeypatch):
    """Without sorting by place, and without knowing again what has been seen, the reports are the same."""
    rng, seen = random.Random(3), {"on": 0, "off": 0}
    count = examples(150, 3)
    for _ in range(count):
        certificate = places(rng)
        reports = []
        for few, kept in ((1, 256), (10**9, 0), (2, 0), (16, 256)):
            monkeypatch.setattr(checker, "FEW", few)
            monkeypatch.setattr(checker, "MAX_KEPT", kept)
            reports.append(verify(certificate))
        assert reports[1:] == reports[:-1]
        seen["off" if "not on a face" in reports[0].reason else "on"] += 1
    assert min(seen.values()) > count / 5, seen


def test_an_index_finds_what_is_near():
    rng = random.Random(1)
    for count, axes in itertools.product((1, 2, 40, 300), (1, 2, 3)):
        lows = [[rng.randrange(10 ** rng.randint(1, 4)) for _ in range(axes)] for _ in range(count)]
        highs = [[x + rng.choice([0, 5, 900]) for x in low] for low in lows]
        index = checker._Index(lows, highs)
        for _ in range(50):
            low = [rng.randint(-2000, 12000) for _ in range(axes)]
            high, room = [x + rng.choice([0, 0, 40, 5000]) for x in low], rng.choice([0, 1, 300])
            found = index.near(low, high, room)
            meet = [
                number
                for number, (a, b) in enumerate(zip(lows, highs, strict=True))
                if all(p - room <= y and x <= q + room for x, y, p, q in zip(a, b, low, high, strict=True))
            ]
            assert set(meet) <= set(found)
            assert list(found) == sorted(set(found))


def yard(n):
    """n x n cubes, each on its own four of 2 n x 2 n squares of the ground."""
    steps = [i / 2 for i in range(2 * n + 1)]
    cubes = [box(f"{i},{j}", [i, j, 0], [i + 1, j + 1, 1]) for i in range(n) for j in range(n)]
    joints = [
        contact("ground", cube["id"], level(*cube["vertices"][0][:2], *[x + 1 for x in cube["vertices"][0][:2]]))
        for cube in cubes
    ]
    return state([meshed("ground", steps, steps), *cubes], joints, [[0, 0, W / 4]] * 4 * len(cubes))


def test_a_contact_on_a_mesh_looks_at_a_few_facets(monkeypatch):
    monkeypatch.setattr(checker, "MAX_LOOKS", (5000, 15))
    report = verify(yard(16))
    assert report.proved, report.reason
    monkeypatch.setattr(checker, "FEW", 10**9)
    assert verify(yard(16)).reason == "too many faces under its contacts to look at"


@pytest.mark.parametrize(("count", "reason"), [(100, "the loads do no work"), (1000, "too many faces under its")])
def test_work_on_large_outlines_is_bounded(count, reason):
    """A contact of many corners on the spine of a comb of 300 teeth, whose edges are too long to be sorted."""
    teeth = [[x, y] for k in range(300) for x, y in ((k, 0), (k, 9), (k + 0.5, 9), (k + 0.5, 0))]
    outline = [[0, -1], *teeth, [300, -1]][::-1]
    n = len(outline)
    ground = {**GROUND, "vertices": [[x, y, z] for z in (-1, 0) for x, y in outline]}
    ground["faces"] = [[*range(n)][::-1], [*range(n, 2 * n)]]
    ground["faces"] += [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
    polygon = [[1 + 200 * i / count, y, 0] for y, way in ((-0.75, 1), (-0.25, -1)) for i in [*range(count)][::way]]
    cube = box("cube", [0, -1, 0], [300, 9, 1])
    report = verify(mechanism([ground, cube], [contact("ground", "cube", polygon)], {"cube": [0, 0, 1, 0, 0, 0]}))
    assert reason in report.reason


# --- the seal of a file ----------------------------------------------------------------------------------------------


def names(text):
    return sealed({**cube_on_ground(), "blocks": [GROUND, CUBE, box(text, [5, 5, 5], [6, 6, 6], fixed=True)]})


@pytest.mark.parametrize("name", ["other", "Stein é", 'a"seal":"x', "two\nlines", "\\", "\u2028"])
def test_a_written_certificate_is_canonical(name, tmp_path):
    certificate, path = names(name), tmp_path / "c.json"
    write_json(path, certificate)
    data = path.read_bytes()
    assert json.loads(data) == certificate
    assert checker._sealed_text(certificate, data) == checker._canonical(certificate)
    assert verify_file(path) == verify(certificate)
    path.write_text(json.dumps(certificate, indent=1))
    assert not checker._sealed_text(certificate, path.read_bytes())
    assert verify_file(path) == verify(certificate)


def test_damage_to_a_written_certificate_is_found(tmp_path):
    text, path = json_text(names("other")), tmp_path / "c.json"
    for old, new in (("2400.0", "2401.0"), ('"other"', '"another"'), (seal(names("other")), "0" * 64)):
        assert old in text
        path.write_text(text.replace(old, new, 1))
        assert "seal does not match" in verify_file(path).reason
    path.write_text(text.replace(f'"{seal(names("other"))}"', "[[]]"))
    assert "seal" in verify_file(path).reason


def test_collection_of_garbage_goes_on_afterwards(tmp_path):
    import gc

    path = tmp_path / "c.json"
    write_json(path, cube_on_ground())
    for was in (True, False):
        (gc.enable if was else gc.disable)()
        try:
            verify_file(path)
            assert gc.isenabled() is was
        finally:
            gc.enable()
