"""Certificates about every drawing within a length, by hand, and forgeries against each of their rules.

A unit cube, L small. Its volume changes by 6 L (six faces of 1 m2), its first moment along an axis by (1 + 4 / sqrt 12)
L = 2.1547 L: two faces at 1/2 m, and four on which the mean square distance is 1/12 m2. So its weight W may differ by
6 L W, and the moment of it by sqrt 2 x 2.1547 L W. Corners at (1/2, 1/2) that press alike have C = 1/4, |C^-1 rho| = 4
sqrt(1/2): what is needed of a corner's room is (6 + 4 sqrt(1/2) sqrt 2 x 2.1547) L = 14.619 L.
"""

import copy
import math

import pytest

from cyclopean.proof import verify
from test_proof_checker import BASE, CUBE, GROUND, G, W, _certificate, box, contact, level, prism, sealed

L = 1e-3
A = 0.5 - L * (1 + 1e-9)
UPPER = box("upper", [-0.5, -0.5, 1], [0.5, 0.5, 2])
BED = contact("cube", "upper", level(-0.5, -0.5, 0.5, 0.5, 1.0))


def state(length=L, slope=None, *, a=None, forces=None, mu=0.5, loads=()):
    a = 0.5 - length * (1 + 1e-9) if a is None else a
    within = {"length": length} | ({} if slope is None else {"slope": slope})
    base = {**BASE, "mu": mu}
    proof = {"points": [level(-a, -a, a, a)], "forces": forces or [[0, 0, W / 4]] * 4, "ways": {"cube": 0}}
    return _certificate("rbe-state-within", [GROUND, CUBE], [base], (0, 0, -G), loads, 1e-6, within=within, **proof)


def two(length=L):
    proof = {
        "points": [level(-A, -A, A, A), level(-A, -A, A, A, 1.0)],
        "forces": [[0, 0, W / 2]] * 4 + [[0, 0, W / 4]] * 4,
        "ways": {"cube": 0, "upper": 1},
    }
    within = {"length": length}
    return _certificate(
        "rbe-state-within", [GROUND, CUBE, UPPER], [BASE, BED], (0, 0, -G), (), 1e-6, within=within, **proof
    )


def motion(length=L, lift=2.5 * L, *, reach=-0.125, mu=0.5, slope=None, upper=None):
    """The cube on a ledge up to x = reach < 0 turns about y at the edge and rises by `lift`: 1 = spin."""
    ledge = box("ground", [-4, -4, -1], [reach, 4, 0], fixed=True)
    base = contact("ground", "cube", level(-0.5, -0.5, reach, 0.5), mu)
    within = {"length": length} | ({} if slope is None else {"slope": slope})
    own = [0.0, 0.0, reach + lift, 0.0, 1.0, 0.0]
    blocks, contacts, motions = [ledge, CUBE], [base], {"cube": own}
    if upper is not None:
        blocks, contacts, motions = [*blocks, UPPER], [base, BED], {"cube": own, "upper": upper(own)}
    return _certificate("rbe-mechanism-within", blocks, contacts, (0, 0, -G), (), 1e-6, within=within, motions=motions)


def refused(certificate, reason):
    report = verify(certificate)
    assert not report.proved
    assert reason in report.reason, report.reason


def forged(certificate, change):
    made = copy.deepcopy(certificate)
    change(made)
    return sealed(made)


# --- by hand ---------------------------------------------------------------------------------------------------------


def test_what_a_cube_needs_by_hand():
    length = 1e-6
    report = verify(state(length, 0.0))
    assert report.proved
    assert report.figures["room_used"] == pytest.approx(14.619 * length, rel=1e-4)
    assert report.claim.startswith(
        "stable under rigid-block equilibrium in every drawing within 1e-06 m of this one, normals within 0 degrees"
    )


def test_two_cubes_need_twice_as_much_below_in_twice_the_room():
    """6 L of either weight and both moments, on 2 W: the same share, but for what is of second order."""
    one, both = (verify(made).figures["room_used"] for made in (state(), two()))
    assert both == pytest.approx(one, rel=0.01)


def test_which_block_of_a_contact_is_named_first_changes_nothing():
    """Its polygon goes round the other way then, and what it bears acts on the other block."""
    plain = two()
    bed = contact("upper", "cube", level(-0.5, -0.5, 0.5, 0.5, 1.0)[::-1])
    proof = {"points": plain["points"], "forces": plain["forces"], "ways": plain["ways"]}
    proof["points"] = [proof["points"][0], proof["points"][1][::-1]]
    proof["forces"] = [*proof["forces"][:4], *([0, 0, -W / 4] for _ in range(4))]
    turned = _certificate(
        "rbe-state-within", [GROUND, CUBE, UPPER], [BASE, bed], (0, 0, -G), (), 1e-6, within=plain["within"], **proof
    )
    one, other = verify(plain), verify(turned)
    assert other.proved, other.reason
    assert other.figures["room_used"] == pytest.approx(one.figures["room_used"], rel=1e-12)


def test_friction_takes_what_the_normal_leans():
    """Where nothing else is said the normal leans by sin = L perimeter / area = 4 L."""
    t = math.tan(math.asin(4 * 0.01))
    assert verify(state(0.01)).figures["room_used"] == pytest.approx(
        verify(state(0.01, t)).figures["room_used"], rel=1e-9
    )
    assert verify(state(0.01)).proved
    refused(state(0.01, 0.5), "room inside its cone")
    pushed = [[sign * 0.48 * W / 4, 0, W / 4] for sign in (1, -1, -1, 1)]  # inside mu = 0.5, not if the normal leans
    refused(state(forces=pushed, slope=0.02), "leans as far as it may")
    assert verify(state(forces=pushed, slope=0.0)).proved


def test_less_is_left_of_friction_by_the_angle_that_normals_may_lean():
    """tan(atan mu - atan t) = (mu - t) / (1 + mu t): of mu = 1 and t = 1/3 exactly half; L is next to nothing."""
    for share, proved in ((0.4999, True), (0.5001, False)):
        pushed = [[sign * share * W / 4, 0, W / 4] for sign in (1, -1, -1, 1)]
        assert verify(state(1e-9, 1.0 / 3.0, forces=pushed, mu=1.0)).proved == proved


def test_a_cube_that_tips_by_hand():
    """At the edge dn = lift has to be sqrt(1 + mu^2) sqrt(2 + 1) L; lost are (6 |v| + 2.1547) L of |v| = 1/8 - lift."""
    length = 1e-6
    for mu in (0.5, 0.8):
        least = math.sqrt(1 + mu * mu) * math.sqrt(3) * length
        assert verify(motion(length, 1.001 * least, mu=mu, slope=0.0)).proved
        refused(motion(length, 0.999 * least, mu=mu, slope=0.0), "does not open enough")
    report = verify(motion(length, 3 * length, slope=0.0))
    assert report.figures["power_used"] == pytest.approx((6 / 8 + 2.1547) * 8 * length, rel=1e-3)
    assert "unstable under rigid-block equilibrium in every drawing within 1e-06 m" in report.claim


def test_blocks_that_move_as_one_do_not_count():
    assert verify(motion(upper=list)).proved
    refused(motion(upper=lambda own: [*own[:5], 1e-15]), "does not open enough")
    refused(motion(upper=lambda own: [*own[:2], math.nextafter(own[2], -1), *own[3:]]), "does not open enough")


def test_a_load_moves_by_the_length():
    """A load of W at the centre of the cube brings a moment of L W: 4 sqrt(1/2) L / 2 more of twice the room."""
    load = {"block": "cube", "force": [0, 0, -W], "point": [0, 0, 0.5]}
    length = 1e-6
    report = verify(state(length, 0.0, forces=[[0, 0, W / 2]] * 4, loads=[load]))
    sideways = 1 / 0.5 * math.sqrt(0.5)  # torsion, by mu: |rho| / S = sqrt(1/2) / (1/2)
    assert report.figures["room_used"] == pytest.approx(
        (14.619 + 4 * math.sqrt(0.5) + sideways / 0.5) * length / 2, rel=1e-4
    )


def test_what_is_left_is_passed_on_by_hand():
    """Forces too large by e W: wn = wt = e, and t = tn = e / 2 by the arm of half a metre. L is next to nothing."""
    e, tiny, mu = 1e-6, 1e-12, 0.5
    used = verify(state(tiny, 0.0, a=0.5 - 2 * tiny, forces=[[0, 0, (1 + e) * W / 4]] * 4)).figures["room_used"]
    lever, torsion = 4 * math.sqrt(0.5), math.sqrt(0.5) / 0.5
    assert used == pytest.approx(e * (1 + lever / 2 + (1 + torsion / 2) / mu), rel=1e-4)
    tilted = [[0, 0, (1 + s * e) * W / 4] for s in (-1, 1, 1, -1)]  # nothing but a moment is left, of e W / 2
    used = verify(state(tiny, 0.0, a=0.5 - 2 * tiny, forces=tilted)).figures["room_used"]
    assert used == pytest.approx(e / 2 * (lever + torsion / mu), rel=1e-4)


def test_points_off_the_plane_by_hand():
    """Points z above the plane: every drawing's are z from them, and friction q W / 4 there has a moment of z q W."""
    z, tiny, mu, q = 1e-6, 1e-12, 0.5, 0.2
    a = 0.5 - 2 * z
    forces = [[s * q * W / 4, 0, W / 4] for s in (1, -1, -1, 1)]
    made = state(tiny, 0.0, a=a, forces=forces)
    used = verify(forged(made, change("points", [level(-a, -a, a, a, z)]))).figures["room_used"]
    lever, torsion = 4 * math.sqrt(0.5), math.sqrt(0.5) / 0.5
    assert used == pytest.approx(z * q * (mu * lever + torsion) / (mu - q), rel=1e-4)


def test_a_cube_that_slides_by_hand():
    """(1, 0, rise) on a slope of 1: no force resists while rise >= tan(atan mu + theta); lost is 6 L of |g.v|."""
    mu, slope, gravity = 0.4, 0.1, (G, 0, -G)
    least = (mu + slope) / (1 - mu * slope)

    def at(rise, length=1e-6):
        base = contact("ground", "cube", level(-0.5, -0.5, 0.5, 0.5), mu)
        within, moved = {"length": length, "slope": slope}, {"cube": [1, 0, rise, 0, 0, 0]}
        return _certificate(
            "rbe-mechanism-within", [GROUND, CUBE], [base], gravity, (), 1e-6, within=within, motions=moved
        )

    assert verify(at(1.0001 * least)).figures["power_used"] == pytest.approx(6e-6, rel=1e-2)
    refused(at(0.9999 * least), "does not open enough")


def test_a_contact_that_is_not_flat_opens_by_more():
    """Corners z above and below the plane: e^2 = 2 L^2 + (L + z)^2, and at the edge z of sliding for 1 of spin."""
    z, length, mu = 1e-4, 1e-5, 0.5
    reach, sides = -0.125, ((-0.5, -0.5, 1), (-0.125, -0.5, -1), (-0.125, 0.5, 1), (-0.5, 0.5, -1))
    least = mu * z + math.sqrt(1 + mu * mu) * math.sqrt(2 * length**2 + (length + z) ** 2)

    def at(lift):
        made = motion(length, lift, mu=mu, slope=0.0)
        polygon = [[x, y, side * z] for x, y, side in sides]
        return sealed({**made, "tolerance": 1e-3, "contacts": [{**made["contacts"][0], "polygon": polygon}]})

    assert reach == sides[1][0]
    assert verify(at(1.001 * least)).proved
    refused(at(0.999 * least), "does not open enough")


def test_a_load_does_less_work_by_hand():
    """Of a load F at its point: L |F x w|, here W L of the power W / 4 of weight and load, both 1/8 from the edge."""
    length = 1e-6
    load = {"block": "cube", "force": [0, 0, -W], "point": [0, 0, 0.5]}
    made = motion(length, 3 * length, slope=0.0)
    alone, both = (verify(x).figures["power_used"] for x in (made, sealed({**made, "loads": [load]})))
    assert both == pytest.approx((alone * 1 / 8 + length) * 4, rel=1e-2)


# --- forgeries -------------------------------------------------------------------------------------------------------


def change(key, value):
    return lambda made: made.__setitem__(key, value)


STATES = {
    "point at the edge": (state(a=0.5 - 0.9 * L), "is not 0.001 m inside"),
    "point outside": (state(a=0.75), "is not 0.001 m inside"),
    "too large a length": (state(0.055), "times the room"),
    "upright": (state(0.26), "leans as far as it may"),
    "pulls": (state(forces=[[0, 0, W / 2], [0, 0, W / 2], [0, 0, W / 2], [0, 0, -W / 2]]), "pulls"),
    "out of balance": (state(forces=[[0, 0, W]] * 4), "times the room"),
    "one line": (state(forces=[[0, 0, W / 2], [0, 0, 0], [0, 0, W / 2], [0, 0, 0]]), "in one line"),
    "nothing borne": (state(forces=[[0, 0, 0]] * 4), "bears nothing"),
    "no room": (state(forces=[[s * W / 8, 0, W / 4] for s in (1, -1, -1, 1)], slope=0.0), "no room"),
    "no friction": (state(mu=0.0, forces=[[W / 4]] * 4), "leans as far as it may"),
    "steep": (state(mu=6.0), "friction above 5"),
    "huge": (state(forces=[[0, 0, 1e6 * W]] * 4), "larger than"),
    "round and round": (forged(two(), change("ways", {"cube": 1, "upper": 1})), "never come to a support"),
    "way elsewhere": (forged(two(), change("ways", {"cube": 0, "upper": 0})), "is not at block upper"),
    "no way": (forged(two(), change("ways", {"cube": 0})), "fields missing"),
    "no contact": (forged(two(), change("ways", {"cube": 0, "upper": 2})), "not the number of a contact"),
    "true": (forged(two(), change("ways", {"cube": 0, "upper": True})), "not the number of a contact"),
    "too few lists": (forged(two(), change("points", [])), "0 lists for 2 contacts"),
    "no length": (forged(two(), change("within", {"length": 0.0})), "length is not positive"),
    "slope below zero": (forged(two(), change("within", {"length": L, "slope": -0.1})), "slope is negative"),
    "unknown key": (forged(two(), change("within", {"length": L, "angle": 1})), "unknown field"),
    "rough": (forged(two(), lambda made: made["contacts"][0].__setitem__("surface", "rough")), "rough or curved"),
    "held": (forged(two(), lambda made: made["blocks"][1].__setitem__("held", ["x"])), "partly held"),
    "pulling": (forged(two(), lambda made: made["contacts"][0].__setitem__("tension", 9.0)), "joints that pull"),
}
MOTIONS = {
    "opens too little": (motion(lift=1.9 * L), "does not open enough"),
    "too large a length": (motion(0.04, 0.1), "may do no work"),
    "upwards": (motion(lift=0.2), "do no work"),
    "leans too far": (motion(mu=0.5, slope=2.0), "may resist anything"),
    "leans": (motion(lift=2.5 * L, slope=0.9), "does not open enough"),
    "upright": (motion(0.2, 0.1, mu=0.0), "may resist anything"),
    "drops through": (motion(lift=-0.01), "does not open enough"),
}


@pytest.mark.parametrize("name", STATES)
def test_a_forged_state_is_refused(name):
    refused(*STATES[name])


@pytest.mark.parametrize("name", MOTIONS)
def test_a_forged_motion_is_refused(name):
    refused(*MOTIONS[name])


def test_what_the_forgeries_were_made_of_is_proved():
    assert all(verify(made).proved for made in (state(), two(), motion()))


def test_a_sharp_corner_may_go_far():
    """The point of a wedge may get L / sin of half its angle away when both sides move out."""
    slim = 0.05
    outline = [[-0.5, -slim], [0.5, 0.0], [-0.5, slim]]
    wedge, half = prism("cube", outline, 0, 0.5), math.atan(slim / 1.0)
    base = contact("ground", "cube", [[*p, 0] for p in outline], 0.5)

    # turned about y it opens by 1/2 - x + lift at each corner, and so least at the point, x = 1/2
    def at(lift):
        own = {"cube": [0, 0, 0.5 + lift, 0, 1, 0]}
        upwards = (0, 0, G)
        within = {"length": 1e-5, "slope": 0.0}
        return _certificate(
            "rbe-mechanism-within", [GROUND, wedge], [base], upwards, (), 1e-6, within=within, motions=own
        )

    least = math.sqrt(1.25) * 1e-5 * math.sqrt(1 / math.sin(half) ** 2 + 1)
    assert verify(at(1.001 * least)).proved
    refused(at(0.999 * least), "at point 1 it does not open")


def test_a_concave_contact_counts_with_its_convex_outline():
    """An L of three squares: the corner inside it need not open, those of its outline have to."""
    outline = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.0], [0.0, 0.0], [0.0, 0.5], [-0.5, 0.5]]
    shape, base = prism("cube", outline, 0, 1), contact("ground", "cube", [[*p, 0] for p in outline], 0.5)
    within = {"length": L, "slope": 0.0}

    def at(rise):
        return _certificate(
            "rbe-mechanism-within",
            [GROUND, shape],
            [base],
            (0, 0, G),
            (),
            1e-6,
            within=within,
            motions={"cube": [0, 0, rise, 0, 0, 0]},
        )

    assert verify(at(1.0)).proved
    refused(at(-1.0), "do no work")
