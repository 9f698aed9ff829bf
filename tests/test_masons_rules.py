"""Rules of masons: bonds by hand, laws of symmetry and scale, refusals."""

import itertools
from dataclasses import astuple, dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.design.rubble.masons_rules import Faces, masons_rules
from cyclopean.errors import InputError
from cyclopean.view.masons_words import lines
from laws import examples

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = np.array([t for a, b, c, d in SIDES for t in ((a, b, c), (a, c, d))])


@dataclass(frozen=True)
class Block:
    vertices: np.ndarray
    volume: float
    triangles: np.ndarray = None


def block(low, high) -> Block:
    size = np.subtract(high, low)
    return Block(np.asarray(low) + CORNERS * size, float(np.prod(size)), TRIANGLES)


def bond(shift: float, courses: int = 4, length: float = 1.2) -> list[Block]:
    """Courses of units 0.2 x 0.15 m, every second one shifted; cut at the ends of the wall."""
    found = []
    for k in range(courses):
        cuts = np.arange(0.0, length + 1e-9, 0.2) + shift * (k % 2)
        cuts = np.unique(np.clip(np.r_[0.0, cuts, length], 0.0, length).round(9))
        found += [block((a, 0, 0.15 * k), (b, 0.4, 0.15 * (k + 1))) for a, b in itertools.pairwise(cuts)]
    return found


WALL = Faces(1.2, 0.4)


def test_stack_bond_runs_on_and_its_trace_is_straight() -> None:
    found = masons_rules(bond(0.0), WALL)
    assert abs(found.void) < 1e-6
    assert abs(found.void_tops) < 1e-6
    assert found.face == found.face_back == 1.0
    assert found.trace_least == found.trace_median == pytest.approx(1.0)
    assert found.running_joints == 5
    assert found.running_joint_longest == pytest.approx(0.6, abs=0.01)


def test_running_bond_covers_its_joints() -> None:
    found = masons_rules(bond(0.1), WALL)
    # 5 + 6 + 5 + 6 head joints, each half a unit from the next; up 4 courses and aside 3 times
    assert found.head_joints == 22
    assert found.running_joints == 0
    assert found.joint_overlap_median == pytest.approx(0.1, abs=0.006)
    assert found.trace_least == pytest.approx((0.6 + 3 * 0.1) / 0.6, rel=0.03)
    assert found.through_stones == found.binders == pytest.approx(26 / 0.72, rel=0.02)


def test_a_battered_face_is_measured_on_its_plane() -> None:
    stone = block((0, 0, 0), (1, 0.4, 0.4))
    upper = stone.vertices[:, 2] > 0.2
    stone.vertices[upper, 1] = np.where(stone.vertices[upper, 1] < 0.2, 0.1, 0.3)
    leaning = Block(stone.vertices, 0.12, TRIANGLES)
    found = masons_rules([leaning], Faces(1.0, 0.4, 0.25, 0.25))
    assert found.void == pytest.approx(0.0, abs=0.01)
    assert found.face == found.face_back == 1.0
    assert masons_rules([leaning], Faces(1.0, 0.4)).face < 0.5  # the plane matters


@settings(max_examples=examples(10), deadline=None)
@given(st.integers(2, 8), st.sampled_from([0.25, 2.0, 8.0]))
def test_scale_and_mirror_change_nothing(tenth: int, scale: float) -> None:
    stones = bond(0.02 * tenth, 3)
    one = masons_rules(stones, WALL)
    larger = [Block(s.vertices * scale, s.volume * scale**3, TRIANGLES) for s in stones]
    other = masons_rules(larger, Faces(1.2 * scale, 0.4 * scale))
    assert other.void == pytest.approx(one.void, abs=1e-6)
    assert other.trace_least == pytest.approx(one.trace_least, rel=0.02)
    assert other.joint_overlap_median == pytest.approx(one.joint_overlap_median * scale, rel=0.1)
    turned = [Block(s.vertices * [-1, 1, 1] + [1.2, 0, 0], s.volume, TRIANGLES[:, ::-1]) for s in stones]
    mirrored = masons_rules(turned, WALL)
    for a, b in zip(astuple(one), astuple(mirrored), strict=True):
        assert b is None if a is None else b == pytest.approx(a, rel=0.02, abs=0.006)


def test_words_tell_what_was_measured() -> None:
    found = masons_rules(bond(0.1), WALL)
    assert any("of 22 head joints half are covered by at least" in line for line in lines(found))
    assert any("running joints: 5" in line for line in lines(masons_rules(bond(0.0), WALL)))


def test_refusals() -> None:
    with pytest.raises(InputError, match="at least one"):
        masons_rules([], WALL)
    with pytest.raises(InputError, match="positive"):
        Faces(1.0, 0.0)
    with pytest.raises(InputError, match="none stands"):
        masons_rules([block((3, 3, 0), (4, 4, 1))], WALL)


def spaced(gap: float, courses: int = 8) -> list[Block]:
    """Running bond of units 0.24 x 0.15 m with gaps between them."""
    step = 0.24 + gap
    places = [(step * (i + (k % 2) / 2.0), 0.15 * k) for k in range(courses) for i in range(6)]
    return [block((x, 0, z), (x + 0.24, 0.4, z + 0.15)) for x, z in places]


@pytest.mark.parametrize("gap", [0.02, 0.1])
def test_open_joints_are_covered_from_their_edges_and_crossed_by_traces(gap: float) -> None:
    """By hand: a unit runs past either side of the gap below its middle by half of what is not gap."""
    found = masons_rules(spaced(gap), Faces(6.5 * (0.24 + gap), 0.4))
    assert found.joint_overlap_least == pytest.approx(0.12 - gap / 2.0, abs=0.005)
    assert found.joint_overlap_median == pytest.approx(0.12 - gap / 2.0, abs=0.005)
    aside = (0.24 + gap) / 2.0 - gap
    assert (1.2 + 7 * aside) / 1.2 * 0.96 <= found.trace_least * 1.0001
    assert found.trace_least <= (1.2 + 7 * ((0.24 + gap) / 2.0)) / 1.2


def test_what_stands_apart_is_passed_between() -> None:
    stacks = [block((0.26 * k, 0, 0.15 * j), (0.26 * k + 0.2, 0.4, 0.15 * (j + 1))) for k in range(5) for j in range(4)]
    found = masons_rules(stacks, Faces(1.24, 0.4))
    assert found.trace_least == pytest.approx(1.0, abs=1e-6)


def test_a_few_stones_measured_by_hand() -> None:
    """A large flat stone that goes through; on it two small ones, one of them two thirds deep; on the left a third."""
    stones = [
        block((0.0, 0.0, 0.0), (1.0, 0.6, 0.2)),
        block((0.0, 0.0, 0.2), (0.3, 0.3, 0.4)),
        block((0.3, 0.0, 0.2), (1.0, 0.42, 0.4)),
        block((0.0, 0.0, 0.4), (0.3, 0.2, 0.5)),
    ]
    found = masons_rules(stones, Faces(1.0, 0.6))
    face = 1.0 * 0.4 + 0.3 * 0.1
    assert found.through_stones == pytest.approx(1 / face, rel=0.03)
    assert found.binders == pytest.approx(2 / face, rel=0.03)
    assert found.length_into_wall == pytest.approx(np.median([0.6, 1.0, 0.6, 0.2 / 0.3]))
    assert found.largest_low == pytest.approx(np.corrcoef([4, 2, 3, 1], [1, 2.5, 2.5, 4])[0, 1])
    assert found.top == pytest.approx(np.sqrt(0.3 * 0.7) * 0.1, rel=0.05), "0.5 m over 0.3 m of it, 0.4 m over the rest"
    assert found.head_joints == 1
    assert found.joint_overlap_least == pytest.approx(0.3, abs=0.01), "of the stone below, to the left end"
    assert found.running_joints == 0


def test_a_trace_is_as_exact_in_a_thick_wall_and_runs_along_a_bed_straight() -> None:
    for thick in (0.4, 1.2):
        stones = [Block(s.vertices * [1.0, thick / 0.4, 1.0], s.volume * thick / 0.4, TRIANGLES) for s in bond(0.1)]
        found = masons_rules(stones, Faces(1.2, thick))
        assert found.trace_least == pytest.approx(1.5, rel=0.02)
        assert found.trace_along == pytest.approx(1.0, abs=1e-6)


def test_what_is_no_number_is_named() -> None:
    stone = block((0, 0, 0), (1, 0.4, 0.4))
    stone.vertices[0, 0] = np.nan
    with pytest.raises(InputError, match="a vertex is no finite number"):
        masons_rules([stone], Faces(1.0, 0.4))
