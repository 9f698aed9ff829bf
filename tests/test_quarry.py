"""Synthetic stones: solids with the statistics of real ones.

By hand: an icosahedron cut k times has 10 x 4^k + 2 vertices and 20 x 4^k triangles; stones that are laid out
with a pitch of 1.25 widths stand at least a quarter of the widest apart.
"""

import os
import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.design.stones.inventory import shape_of
from cyclopean.design.stones.quarry import _icosphere, laid_out, quarry
from cyclopean.design.stones.stone import in_body_frame, stone_of
from cyclopean.errors import InputError
from cyclopean.geometry.solids import solid_of, solid_volume
from laws import examples

FOUND = os.environ.get("CYCLOPEAN_STONES", "")
stand_in = runpy.run_path(str(Path(__file__).parents[1] / "bench" / "stand_ins.py"))["stand_in"]
# Of 16 scans (ETH1100): mean and deviation of b/a, c/a, volume/hull and sphericity.
REAL = {"b/a": (0.76, 0.12), "c/a": (0.52, 0.12), "hull": (0.86, 0.06), "sphericity": (0.81, 0.05)}


def measured(stones):
    return {
        "b/a": np.array([s.half[1] / s.half[0] for s in stones]),
        "c/a": np.array([s.half[2] / s.half[0] for s in stones]),
        "hull": np.array([s.volume / s.hull_volume for s in stones]),
        "sphericity": np.array([shape_of(s).sphericity for s in stones]),
    }


@pytest.fixture(scope="module")
def scans():
    folder = Path(FOUND)
    if not FOUND or not folder.is_dir():
        pytest.skip("CYCLOPEAN_STONES names no folder with scans of real stones")
    from cyclopean.io import read_model

    blocks = [read_model(path, "m")[0].blocks[0] for path in sorted(folder.glob("*.obj"))]
    return [stone_of(b.id, b.vertices, b.faces) for b in blocks]


@pytest.mark.parametrize("detail", [0, 1, 2, 3])
def test_a_subdivided_icosahedron_by_hand(detail):
    point, corner = _icosphere(detail)
    assert (len(point), len(corner)) == (10 * 4**detail + 2, 20 * 4**detail)
    assert np.linalg.norm(point, axis=1) == pytest.approx(np.ones(len(point)))
    assert 0.0 < solid_volume(solid_of(point, corner)) < 4 * np.pi / 3
    assert len(np.unique(np.sort(corner, axis=1), axis=0)) == len(corner)


def test_five_hundred_stones_have_the_shapes_of_real_ones():
    # 500 stones: the standard error of a mean is a twentieth of its deviation or less; the scans' own, of 16, a quarter
    found = measured(quarry(500, 1))
    for name, (mean, deviation) in REAL.items():
        assert found[name].mean() == pytest.approx(mean, abs=deviation / 6), name
        assert found[name].std() == pytest.approx(deviation, rel=0.25), name


def test_shapes_match_the_scans(scans):
    from scipy.stats import ks_2samp

    ours, theirs = measured(quarry(500, 2)), measured(scans)
    assert len(scans) >= 16
    for name, (mean, deviation) in REAL.items():
        assert theirs[name].mean() == pytest.approx(mean, abs=deviation / 10), name
        assert ks_2samp(ours[name], theirs[name]).pvalue > 0.05, name


@settings(max_examples=examples(20), deadline=None)
@given(seed=st.integers(0, 2**40), low=st.floats(1e-3, 10.0), wide=st.floats(1.0, 50.0))
def test_every_stone_is_a_solid_within_the_band_and_star_shaped(seed, low, wide):
    for one in quarry(2, seed, (low, low * wide), detail=2):
        assert low * (1 - 1e-9) <= one.volume <= low * wide * (1 + 1e-9)
        assert solid_volume(solid_of(one.vertices, one.triangles)) == pytest.approx(one.volume)
        # From some point the inside of every face is seen: none cuts another.
        assert _sees_all(one)
        assert one.half[1] <= 0.971 * one.half[0]
        assert one.half[2] <= 0.971 * one.half[1]
        # lies along the axes of its frame, its centroid at the origin
        assert np.abs(one.centroid).max() < 1e-9 * one.half[0]
        assert np.abs(np.abs(one.axes) - np.eye(3)).max() < 1e-6


def _sees_all(one):
    """Whether some point lies behind the planes of all faces (a linear program)."""
    from scipy.optimize import linprog

    a, b, c = one.vertices[one.triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    rows = np.column_stack([normal, np.ones(len(normal))])  # normal . x + depth <= normal . a
    found = linprog([0, 0, 0, -1], rows, (normal * a).sum(axis=1), bounds=[(None, None)] * 4)
    return found.status == 0 and -found.fun > 0.0


def test_a_stone_is_the_same_whatever_the_count_and_another_for_another_seed():
    few, many = quarry(2, 7, detail=2), quarry(5, 7, detail=2)
    assert [s.id for s in many] == [f"stone-{k:04d}" for k in range(1, 6)]
    for a, b in zip(few, many, strict=False):
        assert a.vertices.tolist() == b.vertices.tolist()
    assert quarry(1, 8, detail=2)[0].vertices.tolist() != few[0].vertices.tolist()
    assert few[0].vertices.tolist() != few[1].vertices.tolist()


def test_detail_refines_the_same_stone():
    apart = []
    for a, b in zip(quarry(9, 3, detail=3), quarry(9, 3, detail=4), strict=True):
        assert a.volume == pytest.approx(b.volume)
        assert a.half / a.half[0] == pytest.approx(b.half / b.half[0])
        apart.append(np.abs(a.vertices - b.vertices[: len(a.vertices)]).max() / a.half[2])
    assert np.median(apart) < 0.04


def test_volumes_are_log_uniform():
    volume = np.array([s.volume for s in quarry(400, 11, (0.01, 1.0), detail=1)])
    share = np.log(volume / 0.01) / np.log(100.0)
    for q in (0.25, 0.5, 0.75):
        assert np.mean(share < q) == pytest.approx(q, abs=0.07)
    assert quarry(1, 0, (0.1, 0.1), detail=1)[0].volume == pytest.approx(0.1, rel=1e-12)


def test_stand_ins_are_stretched_copies_of_what_is_given():
    models = quarry(4, 1, detail=2)
    made = stand_in(models, 40, 3, (0.05, 0.1))
    assert [s.id for s in made[:2]] == ["stone-0001", "stone-0002"]
    for one in made:
        assert 0.05 * (1 - 1e-9) <= one.volume <= 0.1 * (1 + 1e-9)
        assert solid_volume(solid_of(one.vertices, one.triangles)) == pytest.approx(one.volume)
        # 0.8 to 1.2: the map from the model it was made of is linear, its singular values within 1.5 of each other
        assert min(_stretch(m, one) for m in models) < 1.5 * (1 + 1e-6)
    assert len({min(range(4), key=lambda k: _stretch(models[k], one)) for one in made}) == 4


def _stretch(model, made):
    """Ratio of the extreme singular values of the affine map from one stone to the other; inf where none is near."""
    source, target = in_body_frame(model), made.vertices - made.centroid
    linear, residual, *_ = np.linalg.lstsq(source, target, rcond=None)
    if not np.sqrt(residual.sum()) < 1e-9:
        return np.inf
    value = np.linalg.svd(linear, compute_uv=False)
    assert np.linalg.det(linear) > 0.0
    return value[0] / value[-1]


def test_stand_ins_depend_neither_on_order_nor_on_frame():
    models = quarry(3, 1, detail=2)
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turned = [stone_of(m.id, m.vertices @ turn.T + [1.0, 2.0, 3.0], m.triangles) for m in models[::-1]]
    for a, b in zip(stand_in(models, 6, 2), stand_in(turned, 6, 2), strict=True):
        assert a.vertices == pytest.approx(b.vertices, abs=1e-9)


def test_stones_are_laid_out_on_the_ground_and_apart():
    stones = quarry(7, 4, detail=1)
    laid = laid_out(stones)
    low, high = (np.array([getattr(s.vertices, end)(axis=0) for s in laid]) for end in ("min", "max"))
    assert low[:, 2] == pytest.approx(np.zeros(7), abs=1e-12)
    widest = (high - low)[:, :2].max()
    for i in range(7):
        for j in range(i):
            assert np.maximum(low[i] - high[j], low[j] - high[i])[:2].max() > 0.249 * widest
    for before, after in zip(stones, laid, strict=True):
        again = stone_of(before.id, after.vertices, after.triangles)
        assert after.centroid == pytest.approx(again.centroid)
        assert after.axes == pytest.approx(before.axes)
        assert after.volume == pytest.approx(again.volume)
    assert laid_out([]) == ()


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"count": 0}, "ask for at least 1"),
        ({"seed": -1}, "negative"),
        ({"volume": (0.2, 0.03)}, "no band"),
        ({"volume": (0.0, 0.03)}, "no band"),
        ({"volume": (0.1, float("nan"))}, "no band"),
        ({"volume": (0.1, float("inf"))}, "no band"),
        ({"detail": 0}, "give 1 to 6"),
        ({"detail": 7}, "give 1 to 6"),
    ],
)
def test_refusals(options, why):
    with pytest.raises(InputError, match=why):
        quarry(**{"count": 1, **options})
