"""How far from collapse: multipliers that stand in books or come from mechanisms worked out by hand, and laws.

By hand. A block b wide and h high slides at mu, tips at b/h. A stack tips as a whole, at b / (n h), or slides. A wall
of m courses (height H, depth T) that a push takes out of its plane tips as a whole, at T / (m H). An arch hinges at
four joints: see `four_hinges`.

Both bounds are proved by certificates; 1e-6 between them is what is asked for.
"""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from cyclopean.analysis import Live, LiveLoad, Settings, check, limit, moving_joints
from cyclopean.analysis.limit_analysis.interior import limit_interior
from cyclopean.analysis.limit_analysis.load_family import pencil, proving_multiplier
from cyclopean.analysis.limit_analysis.solving import solve_limit
from cyclopean.assembly import Assembly, Load
from cyclopean.design import arch, dome, stack, vault, wall
from cyclopean.errors import InputError
from cyclopean.proof import verify
from cyclopean.statics import Schur
from laws import some
from limit_cases import pushed, random_push, rotated, rotation, scaled, shuffled
from near_limit import G, posed

CLOSE = 1e-6


def closed(found, by_hand, rel=CLOSE):
    assert found.word == "limit", found.reason
    assert 0.0 <= found.gap <= CLOSE
    assert found.lower <= by_hand * (1 + rel)
    assert found.upper >= by_hand * (1 - rel)
    assert verify(found.certificate).proved
    return True


@pytest.mark.parametrize(
    ("base", "height", "mu", "by_hand"),
    [(0.4, 1.0, 0.7, 0.4), (0.4, 1.0, 0.3, 0.3), (1.0, 1.0, 0.9, 0.9), (0.2, 2.0, 0.5, 0.1), (0.5, 1.0, 0.5, 0.5)],
)
def test_a_block_slides_or_tips(base, height, mu, by_hand):
    assert closed(pushed(stack(1, size=(base, 0.5, height)), (1, 0, 0), mu), by_hand)


@pytest.mark.parametrize(("height", "by_hand"), [(1.0, 0.2), (0.5, 0.4), (0.25, 0.5)])
def test_a_force_at_a_point(height, by_hand):
    """On a block 0.4 wide of weight W: tips when t W times its height is W 0.2, or slides at mu = 0.5."""
    block = stack(1, size=(0.4, 0.5, 1.0))
    weight = 2400 * G * 0.2
    x, y, z = block.mass.centroid[1].tolist()
    load = LiveLoad(block.blocks[1].id, (weight, 0.0, 0.0), (x, y, z - 0.5 + height))
    assert closed(limit(block, Live(loads=(load,)), Settings(mu=0.5)), by_hand)


@pytest.mark.parametrize("count", [2, 3, 5])
def test_a_stack_tips_as_a_whole(count):
    found = pushed(stack(count, size=(0.6, 0.5, 0.4)), (1, 0, 0), 0.84)
    assert closed(found, min(0.84, 0.6 / (0.4 * count)))
    lowest = moving_joints(found)[0]
    assert lowest.kind == "hinge"
    assert (found.contacts.a[lowest.contact], found.contacts.b[lowest.contact]) == (0, 1)


@pytest.mark.parametrize(("columns", "courses", "by_hand"), [(7, 7, 0.2 / 1.4), (12, 12, 0.2 / 2.4)])
def test_a_wall_out_of_its_plane(columns, courses, by_hand):
    assert by_hand == pytest.approx({7: 0.142857, 12: 0.083333}[courses], abs=1e-6)
    assert closed(pushed(wall(columns, courses, ground="course"), (0, 1, 0), 0.7), by_hand)


@pytest.mark.parametrize(("columns", "courses", "quoted"), [(7, 7, 0.587), (12, 12, 0.528)])
def test_a_wall_in_its_plane(columns, courses, quoted):
    """Running bond of blocks of 0.4 x 0.2 x 0.2 m on a fixed course, mu 0.7; about 50 and 150 blocks (500: bench)."""
    found = pushed(wall(columns, courses, ground="course"), (1, 0, 0), 0.7)
    assert closed(found, found.value)
    assert found.value == pytest.approx(quoted, abs=6e-4)


@pytest.mark.parametrize(("mu", "by_hand"), [(0.3, 0.3), (0.5, 0.5), (0.9, 0.9), (1.4, 1.0)])
def test_a_cube_on_ground_that_tilts(mu, by_hand):
    for azimuth in (0.0, 90.0, 180.0):
        found = limit(stack(1), Live(tilt=azimuth), Settings(mu=mu))
        assert closed(found, by_hand)
        assert np.tan(np.deg2rad(found.angle[0])) == pytest.approx(found.lower, rel=1e-9)
    across = limit(stack(1), Live(tilt=45.0), Settings(mu=1.9))
    assert closed(across, np.sqrt(2.0))  # over a corner


def test_a_tilt_is_what_check_finds_on_both_sides():
    found = limit(arch(20, radius=1.0, thickness=0.15), Live(tilt=30.0), Settings(mu=0.6))
    for angle, word in ((found.angle[0] - 1e-4, "stable"), (found.angle[1] + 1e-4, "unstable")):
        told = check(arch(20, radius=1.0, thickness=0.15), Settings(method="rbe", mu=0.6, tilt=(angle, 30.0)))
        assert told.verdict == word


@pytest.mark.parametrize(("pull", "up"), [(0.1, 0.0), (-0.1, 0.0), (0.0, 0.5), (0.2, -0.5)])
def test_a_tilt_with_a_load_that_does_not_turn(pull, up):
    """A cube, load (pull, 0, up) W at its centre: slides when sin a + pull = mu (cos a - up)."""
    mu, weight, cube = 0.5, 2400 * G, stack(1)
    load = Load(1, np.array([pull * weight, 0.0, up * weight]), cube.mass.centroid[1])
    model = Assembly(cube.blocks, cube.contacts, (load,))
    found = limit(model, Live(tilt=0.0), Settings(mu=mu))
    angle = np.deg2rad(np.mean(found.angle))
    assert found.word == "limit"
    assert found.angle[1] - found.angle[0] < 2e-5
    assert np.sin(angle) + pull == pytest.approx(mu * (np.cos(angle) - up), abs=1e-6)
    assert verify(found.certificate).proved


def four_hinges(voussoirs, radius, thickness, loaded, weights, centres, angles):
    """Least multiplier of a downward load at the centroid of block `loaded`, over all mechanisms of four hinges.

    Joints at `angles` from the left springing, hinges in turn on the intrados and the extrados. Three links turn about
    A, about the point where AB and CD meet, and about D; with the turn of the first given, the turns of the others
    follow from the velocities of B and C. The side across from a hinge must open. By virtual work the
    multiplier is minus the work of the weights over that of the load.
    """
    r = {-1: radius - thickness / 2, 1: radius + thickness / 2}

    def at(joint, side):
        return r[side] * np.array([-np.cos(angles[joint]), np.sin(angles[joint])])

    best = np.inf
    for joints in combinations(range(voussoirs + 1), 4):
        for sides in ((1, -1, 1, -1), (-1, 1, -1, 1)):
            A, B, C, D = (at(j, s) for j, s in zip(joints, sides, strict=True))
            across = np.array([B - A, -(D - C)]).T
            if abs(np.linalg.det(across)) < 1e-9:
                continue
            centre = A + np.linalg.solve(across, C - A)[0] * (B - A)
            for turn in (1.0, -1.0):
                second = turn * np.dot(B - A, B - A) / np.dot(B - centre, B - A)
                third = second * np.dot(C - centre, C - D) / np.dot(C - D, C - D)
                turns = np.array([0.0, turn, second, third, 0.0])
                # where the next link turns more to the left, the intrados opens: the hinge is on the extrados (+1)
                if not all(more * side > 0 for more, side in zip(np.diff(turns), sides, strict=True)):
                    continue
                link = np.searchsorted(joints, np.arange(voussoirs), side="right")
                pivots = np.array([A, A, centre, D, D])
                fall = -turns[link] * (centres[:, 0] - pivots[link, 0])
                if fall[loaded] > 1e-12:
                    best = min(best, -float(weights @ fall) / float(fall[loaded]))
    return best


@pytest.mark.parametrize(("thickness", "loaded"), [(0.13, 4), (0.16, 6)])
def test_an_arch_under_a_point_load(thickness, loaded):
    """Thin, with friction so large that nothing slides; the hinge mechanism is found by trying all of them."""
    count = 16
    model = arch(count, radius=1.0, thickness=thickness)
    names = [block.id for block in model.blocks]
    free = [i for i, block in enumerate(model.blocks) if not block.fixed]
    order = sorted(free, key=lambda i: model.mass.centroid[i, 0])
    middle = (model.mass.centroid[order].max(0)[0] + model.mass.centroid[order].min(0)[0]) / 2
    base = min(model.blocks[i].vertices[:, 2].min() for i in order)
    centres = model.mass.centroid[order][:, [0, 2]] - [middle, base]
    weights = 2400 * G * model.mass.volume[order]
    assert len(order) == count
    by_hand = four_hinges(count, 1.0, thickness, loaded, weights, centres, np.linspace(0, np.pi, count + 1))
    found = limit(model, Live(loads=(LiveLoad(names[order[loaded]], (0.0, 0.0, -1.0)),)), Settings(mu=3.0))
    assert closed(found, by_hand, rel=3e-6)
    assert [joint.kind for joint in moving_joints(found)] == ["hinge"] * 4


def test_where_the_thinnest_arch_hinges():
    """At its least thickness a semicircle hinges inside at 54.5 degrees from the crown (Milankovitch)."""
    count = 80
    model = arch(count, radius=1.0, thickness=0.10746 * 1.0005, facets=8)
    free = [i for i, block in enumerate(model.blocks) if not block.fixed]
    order = sorted(free, key=lambda i: model.mass.centroid[i, 0])
    crown = [model.blocks[order[k]].id for k in (count // 2 - 1, count // 2)]
    found = limit(model, Live(loads=tuple(LiveLoad(name, (0.0, 0.0, -1e3)) for name in crown)), Settings(mu=0.84))
    assert found.word == "limit"
    points = np.array([joint.point for joint in moving_joints(found)])
    middle = model.mass.centroid[order][:, 0].mean()
    base = min(model.blocks[i].vertices[:, 2].min() for i in order)
    from_crown = np.rad2deg(np.arctan2(np.abs(points[:, 0] - middle), points[:, 2] - base))
    inside = (np.hypot(points[:, 0] - middle, points[:, 2] - base) < 1.0) & (from_crown > 20) & (from_crown < 80)
    assert inside.sum() == 2
    assert from_crown[inside] == pytest.approx(54.5, abs=180 / count)


def test_nothing_brings_down_what_is_only_pressed():
    found = pushed(stack(3), (0, 0, -1), 0.84)
    assert (found.word, found.upper) == ("unbounded", None)
    assert found.lower == 0.0
    assert "recession" in found.certificate
    report = verify(found.certificate)
    assert report.proved
    assert "and at every larger one" in report.claim


def test_a_push_that_lifts_ends_where_no_weight_is_left():
    assert closed(pushed(vault(5, 2, thickness=0.3), (0, 0, 1), 0.84), 1.0)


def test_a_window_between_two_multipliers():
    """Three cubes, each 0.6 further out: the upper two tip about the lowest; a push back between 0.4 and 0.733 helps.

    Above the lowest cube the two stand 0.9 out on the average, 0.4 beyond its edge, and 1 above it: 0.4. On its other
    side all three tip about the ground's edge at -0.5: their centre is at 0.6, 1.5 high: (0.6 + 0.5) / 1.5.
    """
    found = pushed(stack(3, offset=0.6), (-1, 0, 0), 0.9)
    assert found.word == "falls"
    assert found.window == pytest.approx((0.4, 1.1 / 1.5), rel=1e-6)
    worse = pushed(stack(3, offset=0.6), (1, 0, 0), 0.9)
    assert (worse.word, worse.window) == ("falls", None)


def test_what_falls_anyway():
    found = pushed(arch(20, radius=1.0, thickness=0.10), (1, 0, 0), 0.84)
    assert (found.word, found.lower, found.upper) == ("falls", None, 0.0)
    assert verify(found.certificate).proved


def test_a_block_that_touches_nothing():
    pair = stack(1)
    floating = replace(pair.blocks[1], id="loose", vertices=pair.blocks[1].vertices + np.array([5.0, 0, 5.0]))
    found = pushed(Assembly((*pair.blocks, floating)), (1, 0, 0), 0.84)
    assert found.word == "falls"
    assert "'loose'" in found.reason


def test_nothing_free():
    held = Assembly(tuple(replace(b, fixed=True) for b in stack(1).blocks))
    assert "support" in pushed(held, (1, 0, 0), 0.84).reason


@pytest.mark.parametrize("seed", some(range(25), 3))
def test_bounds_of_random_models_meet(seed):
    model, push, mu = random_push(seed)
    found = pushed(model, push, mu)
    if found.word == "limit":
        assert closed(found, found.value)
    else:
        assert found.word == "falls"  # thin arches
        assert check(model, Settings(method="rbe", mu=mu)).verdict == "unstable"


def loaded(seed):
    model, push, mu = random_push(seed)
    upright = posed(model, mu, np.array([0.0, 0.0, -G]))
    also = posed(model, mu, G * np.array([*push[:2], -1.0]))
    return pencil(upright, also.p * (also.force_unit / upright.force_unit) - upright.p)


@pytest.mark.parametrize("seed", some(range(10), 3))
def test_the_interior_point_agrees_with_clarabel(seed):
    loads = loaded(seed)
    ours, reference = solve_limit(loads, "interior"), solve_limit(loads, "clarabel")
    assert ours.word in ("limit", "undecided")
    assert ours.lower <= reference.upper
    assert reference.lower <= ours.upper
    assert ours.lower == pytest.approx(reference.lower, rel=2e-5)


@pytest.mark.parametrize("seed", [3, 7, 12])
def test_a_motion_proves_no_less_than_the_limit(seed):
    """Whatever motion: what it proves is an upper bound."""
    loads = loaded(seed)
    point = limit_interior(loads, Schur(loads.system))
    found = solve_limit(loads)
    rng = np.random.default_rng(seed)
    for size in (0.0, 1e-9, 1e-6, 1e-3, 1.0):
        noise = rng.normal(size=len(point.y)) * size * np.abs(point.y).max()
        assert proving_multiplier(loads, point.y + noise) >= found.lower * (1 - 1e-9)


@pytest.mark.parametrize("seed", [0, 1, 5, 8])
def test_units_order_and_direction_do_not_matter(seed):
    model, push, mu = random_push(seed)
    base = pushed(model, push, mu)
    if base.word != "limit":
        pytest.skip("falls without a push")
    turn = rotation(40.0)
    gravity = tuple((turn @ np.array([0.0, 0.0, -G])).tolist())
    others = [
        pushed(scaled(model, 1e-3), push, mu),
        pushed(model, push, mu, density=37.0),
        pushed(shuffled(model, seed), push, mu),
        pushed(rotated(model, 40.0), tuple((turn @ push).tolist()), mu, gravity=gravity),
    ]
    for other in others:
        assert other.value == pytest.approx(base.value, rel=CLOSE)


def test_twice_the_push_is_half_the_multiplier():
    model = arch(12, radius=1.0, thickness=0.2)
    once, twice = pushed(model, (1, 0, 0.2), 0.7), pushed(model, (2, 0, 0.4), 0.7)
    assert twice.value == pytest.approx(once.value / 2, rel=CLOSE)


def test_a_symmetric_model_has_symmetric_limits():
    for model in (arch(12, radius=1.0, thickness=0.2), wall(4, 4), dome(3, 8)):
        there, back = pushed(model, (1, 0, 0), 0.7), pushed(model, (-1, 0, 0), 0.7)
        assert there.value == pytest.approx(back.value, rel=CLOSE)


def test_more_friction_is_never_worse():
    values = [pushed(wall(3, 3), (1, 0, 0), mu).value for mu in (0.2, 0.4, 0.8, 1.6)]
    assert values == sorted(values)


@pytest.mark.parametrize(("share", "far"), [(0.5, 90.0), (0.3, 25.0), (0.8, 180.0)])
def test_loads_that_are_borne_alone_are_borne_in_shares(share, far):
    """Superposition: states of two loads, mixed, are a state of the mixed load, so what is borne is convex."""
    model = arch(9, radius=1.0, thickness=0.25, depth=0.4)
    one, other = (1.0, 0.0, 0.0), (np.cos(np.radians(far)), 0.0, np.sin(np.radians(far)) + 0.1)
    alone = [pushed(model, push, 0.7).value for push in (one, other)]
    mixed = tuple((share * alone[0] * np.array(one) + (1 - share) * alone[1] * np.array(other)).tolist())
    assert pushed(model, mixed, 0.7).upper >= 1.0 - CLOSE


def test_live_loads_add_up_to_what_is_there_already():
    """Superposition: part of the limit as a dead load leaves the rest of it as a live one."""
    model, force = stack(2, size=(0.5, 0.5, 0.5)), np.array([300.0, 100.0, -200.0])
    top = len(model.blocks) - 1
    live = Live(loads=(LiveLoad(model.blocks[top].id, tuple(force.tolist())),))
    settings = Settings(mu=0.7, density=2400.0)
    whole = limit(model, live, settings)
    centre = model.mass.centroid[top]
    partly = replace(model, loads=(Load(top, 0.4 * whole.value * force, centre),))
    assert limit(partly, live, settings).value == pytest.approx(0.6 * whole.value, rel=CLOSE)


@pytest.mark.parametrize(
    ("live", "told"),
    [
        ({}, "exactly one"),
        ({"push": (1, 0, 0), "tilt": 0.0}, "exactly one"),
        ({"push": (0, 0, 0)}, "zero"),
        ({"push": (np.nan, 0, 0)}, "finite"),
        ({"loads": (LiveLoad("b1", (0, 0, 0)),)}, "zero"),
    ],
)
def test_live_loads_that_are_none(live, told):
    with pytest.raises(InputError, match=told):
        Live(**live)


def test_loads_on_blocks_that_are_not_there_or_held():
    with pytest.raises(InputError, match="no block 'b9'"):
        limit(stack(1), Live(loads=(LiveLoad("b9", (1, 0, 0)),)))
    with pytest.raises(InputError, match="supports only"):
        limit(stack(1), Live(loads=(LiveLoad(stack(1).blocks[0].id, (1, 0, 0)),)))
    with pytest.raises(InputError, match="nothing turns"):
        limit(stack(1), Live(tilt=0.0), Settings(gravity=(0, -9.8, 0)))


def test_joints_that_pull_and_supports_that_hold_in_part():
    """A block 0.4 x 0.5 x 1 m: a joint of s Pa holds it with s 0.2 m2 at 0.2 m from the edge, beside W; see below.

    Kept from turning it slides at mu; kept from going along x, a push along x and y tips it along y, at 0.5 / 1.
    """
    block, weight = stack(1, size=(0.4, 0.5, 1.0)), 2400 * G * 0.2
    found = limit(block, Live(push=(1, 0, 0)), Settings(mu=2.0, tension=1e4))
    assert closed(found, 0.4 + 1e4 * 0.2 * 0.2 / (0.5 * weight), rel=2e-6)
    ground = replace(block.blocks[0], fixed=True)
    for held, push, by_hand in ((("rx", "ry", "rz"), (1, 0, 0), 0.7), (("x",), (1, 1, 0), 0.5)):
        partly = Assembly((ground, replace(block.blocks[1], held=held)), block.contacts)
        assert closed(pushed(partly, push, 0.7), by_hand)
    with pytest.raises(InputError, match="nothing grows"):
        pushed(partly, (1, 0, 0), 0.7)
