"""Pushover: what a mechanism still bears as it goes on.

By hand. A block b wide and h high that has turned by theta about its edge bears a push of tan(alpha - theta) of its
weight, tan alpha = b / h: from b / h in a line that is nearly straight to nothing at theta = alpha. A stack that turns
as a whole does the same with its whole height; a block that slides bears mu wherever its bed is wide enough, and past
the edge of the bed, by s, the (b / 2 - s) / (h / 2) at which it tips.
"""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupled_cases import prism
from cyclopean.analysis import Live, LiveLoad, Reach, Settings, limit, pushover
from cyclopean.assembly import Assembly, Load
from cyclopean.design import arch, stack, wall
from cyclopean.errors import InputError
from cyclopean.proof import verify
from damages import resealed
from test_field_loads import turned

PUSH = Live(push=(1, 0, 0))


@pytest.mark.parametrize(("base", "height"), [(0.4, 1.0), (0.3, 0.5)])
def test_the_rocking_block(base, height):
    alpha = np.arctan(base / height)
    curve = pushover(
        stack(1, size=(base, 0.5, height)), PUSH, Reach(1.2 * np.rad2deg(alpha), "deg", 6), Settings(mu=2.0)
    )
    turn = np.deg2rad([step.rotation for step in curve.steps])
    assert turn[1:-1] == pytest.approx(np.arange(1, len(turn) - 1) * 0.2 * alpha, rel=1e-4)
    assert [s.multiplier for s in curve.steps] == pytest.approx(np.tan(alpha - turn), abs=1e-7)
    assert [s.touching for s in curve.steps] == [4] + [2] * (len(turn) - 1)
    assert curve.steps[-1].multiplier <= 0
    assert "without live loads" in curve.ended


def test_a_tilted_block_bears_the_same():
    by_push = pushover(stack(1, size=(0.4, 0.5, 1.0)), PUSH, Reach(10, "deg", 3), Settings(mu=2.0))
    by_tilt = pushover(stack(1, size=(0.4, 0.5, 1.0)), Live(tilt=0.0), Reach(10, "deg", 3), Settings(mu=2.0))
    assert [s.multiplier for s in by_tilt.steps] == pytest.approx([s.multiplier for s in by_push.steps], rel=1e-5)


def test_a_block_that_slides_bears_the_same_wherever_it_is():
    curve = pushover(stack(1), PUSH, Reach(0.3, steps=3), Settings(mu=0.3))
    assert [s.multiplier for s in curve.steps] == pytest.approx([0.3] * 4, rel=1e-6)
    assert [s.displacement for s in curve.steps] == pytest.approx([0.0, 0.1, 0.2, 0.3], abs=1e-6)
    assert max(s.rotation for s in curve.steps) < 1e-5


def on(*others):
    """A cube on the edge of a ledge, which ends where the cube does, and what else there is."""
    ledge = prism("ledge", [(-2, -1), (1, -1), (1, 0), (-2, 0)], 0.5, fixed=True)
    return Assembly((ledge, prism("cube", [(0, 0), (1, 0), (1, 1), (0, 1)], 0.5), *others))


def test_a_cube_that_is_pushed_over_an_edge_tips():
    """The bed is 3 m long, the cube 1: pushed out by s it bears min(mu, 1 - 2 s), pushed in always mu."""
    model, way = turned(on(), 40.0), Rotation.from_euler("z", 40.0, degrees=True).apply([1.0, 0.0, 0.0])
    out = pushover(model, Live(push=tuple(way)), Reach(0.45, steps=9), Settings(mu=0.3))
    gone = np.array([step.displacement for step in out.steps])
    assert [s.multiplier for s in out.steps] == pytest.approx(np.minimum(0.3, 1.0 - 2.0 * gone), abs=5e-3)
    assert [s.multiplier for s in out.steps[:8]] == pytest.approx(np.minimum(0.3, 1.0 - 2.0 * gone)[:8], abs=1e-6)
    back = pushover(model, Live(push=tuple(-way)), Reach(0.9, steps=3), Settings(mu=0.3))
    assert [s.multiplier for s in back.steps] == pytest.approx([0.3] * 4, rel=1e-6)


def test_a_cube_that_is_pushed_off_its_bed():
    """It slides by s while mu holds, then turns about the bed's edge: by theta it bears tan(atan(1 - 2 s) - theta)."""
    curve = pushover(on(), Live(push=(1, 0, 0)), Reach(0.6, steps=30), Settings(mu=0.3))
    over = next(k for k, step in enumerate(curve.steps) if step.rotation > 1e-3)
    alpha = np.arctan(1.0 - 2.0 * curve.steps[over - 1].displacement)
    for step in curve.steps[over:]:
        assert step.multiplier == pytest.approx(np.tan(alpha - np.deg2rad(step.rotation)), abs=1e-4)
    assert "without live loads" in curve.ended


def test_a_step_of_any_length_ends_where_it_falls():
    """One step of a kilometre: a block 0.4 wide and 1 high tips over at atan 0.4; nobody looks for it on the ground."""
    curve = pushover(stack(1, size=(0.4, 0.5, 1.0)), PUSH, Reach(1000.0, steps=1), Settings(mu=2.0))
    assert "without live loads" in curve.ended
    assert np.rad2deg(np.arctan(0.4)) < curve.steps[-1].rotation < np.rad2deg(np.arctan(0.4)) + 6.0


def test_a_block_that_slides_does_not_turn():
    with pytest.raises(InputError, match="does not turn: give a length"):
        pushover(stack(1), PUSH, Reach(90.0, "deg"), Settings(mu=0.3))


@pytest.mark.parametrize(("thick", "steps"), [(1.0, 10), (0.02, 1)])
def test_a_cube_that_meets_a_stop(thick, steps):
    """It slides 0.1 m towards a block of its own height, which holds however thin it is: no push brings it further."""
    stop = prism("stop", [(-0.1 - thick, 0), (-0.1, 0), (-0.1, 1), (-0.1 - thick, 1)], 0.5, fixed=True)
    curve = pushover(on(stop), Live(push=(-1, 0, 0)), Reach(0.6, steps=steps), Settings(mu=0.3))
    assert [s.displacement for s in curve.steps] == pytest.approx([0.0, 0.06][: min(steps, 2)], abs=1e-6)
    assert curve.placed[1] == pytest.approx([0.4, 0.25, 0.5], abs=1e-5)  # where it lies against the stop
    assert "'cube' and 'stop' meet at 0.1 m" in curve.ended
    assert "no mechanism exists" in curve.ended


def test_a_thin_stone_does_not_jump_through_another():
    """A slab 0.02 m thick, pushed in one step past another as thin as itself: it takes that along."""
    slabs = [
        prism(name, [(x, 0), (x + 0.02, 0), (x + 0.02, 0.1), (x, 0.1)], 0.5) for name, x in (("a", 0), ("b", 0.05))
    ]
    ground = prism("ground", [(-1, -1), (1, -1), (1, 0), (-1, 0)], 0.5, fixed=True)
    live = Live(loads=(LiveLoad("a", (100.0, 0.0, 0.0), (0.0, 0.25, 0.001)),))
    curve = pushover(Assembly((ground, *slabs)), live, Reach(0.2, steps=1), Settings(mu=0.1))
    assert [step.met for step in curve.steps if step.met] == [(("a", "b"),)]
    assert curve.placed[2][0] - curve.placed[1][0] == pytest.approx(0.02, abs=1e-5)


def test_a_cube_that_takes_another_along():
    """A force of t W on the first cube: mu W moves it, and 2 mu W both from where they meet."""
    other = prism("other", [(-1.1, 0), (-0.1, 0), (-0.1, 1), (-1.1, 1)], 0.5)
    live = Live(loads=(LiveLoad("cube", (-2400 * 9.80665 * 0.5, 0.0, 0.0)),))
    curve = pushover(on(other), live, Reach(0.3, steps=3), Settings(mu=0.3))
    assert [s.displacement for s in curve.steps] == pytest.approx(
        [0.0, 0.1, 0.1, 0.2, 0.3][-len(curve.steps) :], abs=1e-5
    )
    assert [s.multiplier for s in curve.steps if s.displacement < 0.0999] == pytest.approx([0.3], rel=1e-6)
    assert [s.multiplier for s in curve.steps if s.displacement > 0.1001] == pytest.approx([0.6] * 2, rel=1e-6)
    assert [s.met for s in curve.steps if s.met] == [(("cube", "other"),)]
    assert curve.placed[2] == pytest.approx(curve.placed[1] - [1.0, 0.0, 0.0], abs=1e-5)
    proved = [(s.lower, s.upper) for s in curve.steps]
    assert np.array(proved) == pytest.approx(np.array([[s.multiplier] * 2 for s in curve.steps]), rel=1e-6)
    assert all(verify(json.loads(json.dumps(one))).proved for one in curve.proofs)


def test_a_block_that_leans_on_the_next():
    """Two blocks 0.2 wide and 1 high, 0.1 apart; a force t W at the centre of the first, which tips by asin 0.1.

    From then on its upper edge presses the other's face, and rubs down it with mu: F in all. F turns the other about
    its foot, and holds back the first about its own. The edge stays on the face: that gives the other's angle.
    """
    one, two = ([(x, 0), (x + 0.2, 0), (x + 0.2, 1), (x, 1)] for x in (0.0, 0.3))
    ground = prism("ground", [(-1, -0.2), (2, -0.2), (2, 0), (-1, 0)], 0.5, fixed=True)
    model = Assembly((ground, prism("one", one, 0.5), prism("two", two, 0.5)))
    live, mu = Live(loads=(LiveLoad("one", (2400 * 9.80665 * 0.1, 0.0, 0.0)),)), 0.7
    curve = pushover(model, live, Reach(12, "deg", 6), Settings(mu=mu))
    (met,) = (k for k, s in enumerate(curve.steps) if s.met)
    assert curve.steps[met].met == (("one", "two"),)
    assert np.sin(np.deg2rad(curve.steps[met].rotation)) == pytest.approx(0.1, abs=1e-5)
    for k, step in enumerate(curve.steps):
        turn = np.deg2rad(step.rotation)
        centre, edge = clockwise(turn) @ [-0.1, 0.5], clockwise(turn) @ [0.0, 1.0]  # from its foot
        pressed = 0.0
        if k >= met:
            low, high = 0.0, turn
            for _ in range(60):
                middle = (low + high) / 2
                height = clockwise(middle).T @ (edge - [0.3, 0.0])  # in the other's own axes, from its foot
                low, high = (middle, high) if height[0] > -0.2 else (low, middle)
            at, way = edge - [0.3, 0.0], clockwise(low) @ [1.0, -mu]  # on the other
            other = clockwise(low) @ [-0.1, 0.5]
            pressed = -other[0] * 0.1 * turning(edge, way) / turning(at, way)
        assert step.multiplier * 0.1 == pytest.approx(
            (-centre[0] * 0.1 + pressed) / centre[1], rel=1e-4
        )  # they meet to within a tolerance
        assert (step.lower, step.upper) == pytest.approx((step.multiplier, step.multiplier), rel=1e-5)
    assert curve.steps[-1].rotation == pytest.approx(12.0, abs=1e-4)


def clockwise(angle):
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def turning(arm, force):
    """Moment of a force, clockwise."""
    return arm[1] * force[0] - arm[0] * force[1]


def test_a_stack_turns_as_a_whole():
    alpha = np.arctan(0.4 / 1.5)
    curve = pushover(stack(3, size=(0.4, 0.5, 0.5)), PUSH, Reach(8, "deg", 4), Settings(mu=2.0))
    turn = np.deg2rad([s.rotation for s in curve.steps])
    assert [s.multiplier for s in curve.steps] == pytest.approx(np.tan(alpha - turn), abs=1e-6)


def test_the_upper_block_turns_alone():
    """Two blocks (0.4 wide, 1 high, weight W), a force t W on the upper one, 2 above its foot: it hinges on the lower.

    About the ground's edge both would need 2 W 0.2 / 3 = 0.133 W, about the lower block's the upper needs 0.2 W / 2.
    Turned by theta the centre is 0.2 cos - 0.5 sin from the hinge, and the force 2 cos + 0.2 sin above it.
    """
    model = stack(2, size=(0.4, 0.5, 1.0))
    weight = 2400 * 9.80665 * 0.2
    at = tuple((model.mass.centroid[2] + [0.0, 0.0, 1.5]).tolist())
    live = Live(loads=(LiveLoad(model.blocks[2].id, (weight, 0.0, 0.0), at),))
    curve = pushover(model, live, Reach(8, "deg", 4), Settings(mu=2.0))
    turn = np.deg2rad([s.rotation for s in curve.steps])
    by_hand = (0.2 * np.cos(turn) - 0.5 * np.sin(turn)) / (2.0 * np.cos(turn) + 0.2 * np.sin(turn))
    assert by_hand[0] == pytest.approx(0.1)
    assert [s.multiplier for s in curve.steps] == pytest.approx(by_hand, abs=1e-6)
    assert curve.control == model.blocks[2].id
    assert curve.placed[1] == pytest.approx(model.mass.centroid[1], abs=1e-9)  # the lower one stays


def test_it_begins_at_the_limit_and_falls():
    for model, live in ((arch(12, radius=1.0, thickness=0.2), PUSH), (wall(2, 3), Live(push=(0, 1, 0)))):
        curve = pushover(model, live, Reach(0.01, steps=3), Settings(mu=0.84))
        values = [s.multiplier for s in curve.steps]
        assert values[0] == pytest.approx(limit(model, live, Settings(mu=0.84)).value, rel=1e-6)
        assert values == sorted(values, reverse=True)


def test_every_point_is_proved_of_the_stones_where_they_are():
    """By hand: a block 0.4 x 1 turned by theta; half of that bound is refused, for it is another model's."""
    curve = pushover(stack(1, size=(0.4, 0.5, 1.0)), PUSH, Reach(12, "deg", 3), Settings(mu=2.0))
    bounds = np.array([(s.lower, s.upper) for s in curve.steps])
    turn = np.deg2rad([s.rotation for s in curve.steps])
    assert bounds == pytest.approx(np.tan(np.arctan(0.4) - turn)[:, None] * [1.0, 1.0], abs=1e-6)
    for step, found in zip(curve.steps, curve.proofs, strict=True):
        assert verify(json.loads(json.dumps(found))).proved
        assert step.lower <= step.multiplier + 1e-6
        assert step.multiplier <= step.upper + 1e-6
    assert not verify(resealed(json.loads(json.dumps(curve.proofs[0])) | {"upper": curve.steps[-1].upper})).proved


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"far": 0.0}, "expected a positive"),
        ({"far": np.nan}, "expected a positive"),
        ({"far": 1.0, "steps": 0}, "steps"),
        ({"far": 1.0, "unit": "km"}, "expected a positive"),
    ],
)
def test_what_is_no_reach(options, told):
    with pytest.raises(InputError, match=told):
        Reach(**options)


def test_what_is_not_followed():
    cube = stack(1)
    loaded = type(cube)(cube.blocks, cube.contacts, (Load(1, np.array([1.0, 0, 0]), cube.mass.centroid[1]),))
    with pytest.raises(InputError, match="tilt with loads"):
        pushover(loaded, Live(tilt=0.0), Reach(0.1))
    with pytest.raises(InputError, match="no mechanism"):
        pushover(cube, Live(push=(0, 0, -1)), Reach(0.1))


def test_a_hinge_that_moves_to_the_next_joint():
    """The first voussoir at first leaves the springer; then it sits down again, and the joint above it hinges."""
    curve = pushover(arch(20, span=2.0, thickness=0.3), PUSH, Reach(0.04, steps=4), Settings(mu=0.84))
    values = [step.multiplier for step in curve.steps]
    assert curve.ended == "the wanted displacement was reached"
    assert values == sorted(values, reverse=True)
    assert 0.3 < values[-1] < 0.38
    free = curve.turned[1]  # of the first voussoir
    assert np.abs(free - np.eye(3)).max() < 1e-6
