"""Settlements that are not small, against the geometry of arches on three hinges.

By hand (statics in the plane). An arch whose springers part by d stands on hinges A at the haunches' intrados and C at
the crown's extrados. With L the distance from A to C and a + d / 2 half that between the two A, the rise is
h = sqrt(L^2 - (a + d / 2)^2): each half has turned about A by phi. The thrust is H = M / h, M the moment of the weights
between A and C about A. The arch stands as long as the thrust line stays inside every joint and its angle to every
joint within that of friction, at a joint about whose edge blocks have turned to both faces. `parting` looks
for the d at which the first joint gives way: the fourth and fifth hinge, or sliding at a springer.
"""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest

from coupled_cases import beams, prism
from cyclopean.analysis import Settings, check
from cyclopean.analysis.large_displacement.subsidence import HALVINGS, _Path, subsidence
from cyclopean.analysis.preparation import prepare
from cyclopean.assembly import Assembly, Load, Settlement
from cyclopean.design import arch, stack, wall
from cyclopean.errors import InputError
from cyclopean.geometry import rotations
from cyclopean.io import write_model
from cyclopean.proof import verify
from laws import some

INNER = 5.0


def followed(model, moves, steps=10, **said):
    rows = tuple((name, (*motion, 0.0, 0.0, 0.0)[:6]) for name, motion in moves.items())
    return subsidence(model, Settings(method="rbe", settlement=rows, **said), steps=steps)


def spare(voussoirs, thickness, haunch, mu, d):
    """How much room the thrust line has: least of (share of a joint's width to its ends) and (angle to the friction's).

    `haunch` is the joint (from 0 at the springer) where the arch hinges. Left half, springer at rest, in the plane.
    """
    angle = np.pi - np.pi * np.arange(voussoirs + 1) / voussoirs
    ray = np.stack([np.cos(angle), np.sin(angle)], 1)
    inner, outer, crown = INNER * ray, (INNER + thickness) * ray, voussoirs // 2
    quads = [np.array([inner[k], outer[k], outer[k + 1], inner[k + 1]]) for k in range(crown)]
    areas, centres = zip(*(area_and_centre(q) for q in quads), strict=True)
    A, C = inner[haunch], outer[crown]
    far, a = np.hypot(*(C - A)), -A[0]
    phi = np.arccos((C - A)[0] / far) - np.arccos((a + d / 2) / far)  # clockwise
    turn = clockwise(phi)

    def at(point, above):
        return A + turn @ (point - A) if above else point

    weights = [(areas[k], at(centres[k], k >= haunch)) for k in range(crown)]
    top = at(C, True)
    thrust = sum(w * (c - A)[0] for w, c in weights[haunch:]) / (top - A)[1]
    room = []
    for k in range(crown):
        force = np.array([thrust, sum(w for w, _ in weights[k:])])  # on what is above the joint
        for turned in (0.0, phi) if k == haunch else (phi * (k > haunch),):  # an edge may slide along either face
            normal = clockwise(turned) @ np.array([ray[k, 1], -ray[k, 0]])
            room.append(np.arctan(mu) - np.arccos(force @ normal / np.hypot(*force)))
        low, along = at(inner[k], k > haunch), at(ray[k] + A, k > haunch) - at(A, k > haunch)
        moment = sum(w * (c - low)[0] for w, c in weights[k:]) - thrust * (top - low)[1]
        place = moment / (along[0] * force[1] - along[1] * force[0]) / thickness
        if k == haunch:
            assert abs(place) < 1e-9
        else:
            room += [place, 1.0 - place]
    return min(room)


def clockwise(angle):
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def parting(voussoirs, thickness, haunch, mu):
    """The d at which that room is used up."""
    low, high = 0.0, 0.01
    assert spare(voussoirs, thickness, haunch, mu, low) > -1e-9
    while spare(voussoirs, thickness, haunch, mu, high) > 0.0:
        high += 0.01
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if spare(voussoirs, thickness, haunch, mu, middle) > 0.0 else (low, middle)
    return low


def area_and_centre(quad):
    x, y = quad.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = cross.sum() / 2
    return abs(area), np.array([((x + np.roll(x, -1)) * cross).sum(), ((y + np.roll(y, -1)) * cross).sum()]) / (
        6 * area
    )


# ---------------------------------------------------------------------------------------------------------------------
# By hand.


@pytest.mark.parametrize(
    ("voussoirs", "thickness", "haunch", "mu", "far"),
    some(
        [
            (12, 0.8, 2, 0.84, 1.0),  # joint 1 opens at its intrados
            (16, 0.8, 3, 0.84, 0.8),
            (4, 0.8, 1, 0.84, 0.7),  # slides at the springers
            (2, 0.8, 0, 0.6, 4.0),
            (2, 0.8, 0, 0.84, 6.0),  # slides at the springers, nearly flat
        ],
        2,
    ),
)
def test_springers_that_part_until_the_arch_falls(voussoirs, thickness, haunch, mu, far):
    by_hand = parting(voussoirs, thickness, haunch, mu)
    path = followed(arch(voussoirs, thickness=thickness), {"springer-right": (far, 0, 0)}, steps=8, mu=mu)
    assert not path.reached
    least = far / 8 / 2**HALVINGS
    assert path.share * far <= by_hand * 1.001
    assert path.steps[-1].settlement >= by_hand * 0.995 - 2 * least
    assert path.steps[-1].settlement - path.share * far <= 2.001 * least


def test_an_arch_that_flattens_to_a_beam():
    """Two voussoirs with much friction stand until both halves lie in one line: 2 L - 10 with L^2 = 25 + 5.8^2."""
    path = followed(arch(2), {"springer-right": (6.0, 0, 0)}, mu=1000.0)
    assert path.share * 6.0 == pytest.approx(2 * np.hypot(5.0, 5.8) - 10.0, abs=0.02)
    assert max(step.opening for step in path.steps) > 1.0
    assert not path.proved  # no normal suits both faces of a joint that gapes so wide


def test_the_crown_opens_as_far_as_it_turns():
    """By the angle at A of the triangle that the hinges make: the crown opens by 2 * 0.8 sin(phi)."""
    path = followed(arch(2), {"springer-right": (1.0, 0, 0)}, steps=4, mu=1.0)
    assert path.reached
    assert path.proved
    far = np.hypot(5.0, 5.8)
    for step in path.steps:
        phi = np.arccos(5.0 / far) - np.arccos((5.0 + step.settlement / 2) / far)
        assert step.opening == pytest.approx(2 * 0.8 * np.sin(phi), abs=1e-7)
    assert [step.proved for step in path.steps] == [True] * 5
    assert all(verify(json.loads(json.dumps(proof))).proved for proof in path.proofs)
    places = [proof["blocks"][1]["vertices"] for proof in path.proofs]
    assert all(one != other for one, other in itertools.pairwise(places))  # each of another place


# ---------------------------------------------------------------------------------------------------------------------
# Laws.


@pytest.mark.parametrize("model", [arch(8), wall(3, 3, ground="course"), stack(3)], ids=["arch", "wall", "stack"])
def test_all_supports_moved_as_one_body_change_nothing(model):
    shift, turn = np.array([0.3, -0.2, 0.1]), np.array([0.0, 0.0, 0.9])
    swung = rotations(turn[None])[0]
    moves = {}
    for i, block in enumerate(model.blocks):
        if block.fixed:
            centre = model.mass.centroid[i]
            moves[block.id] = (*(shift + swung @ centre - centre), *turn)
    if len(moves) > 1:  # their steps between are no rigid motion of all: straight lines, not arcs
        moves = {name: (*shift, 0.0, 0.0, 0.0) for name in moves}
    path = followed(model, moves, steps=2)
    assert path.reached
    assert path.proved
    assert [step.joint for step in path.steps] == [-1, -1, -1]
    assert len({step.touching for step in path.steps}) == 1


def test_mirrored_settlements_have_mirrored_paths():
    model = arch(8)
    right = followed(model, {"springer-right": (0.2, 0, -0.1)}, steps=3)
    left = followed(model, {"springer-left": (-0.2, 0, -0.1)}, steps=3)
    assert right.reached
    assert [step.opening for step in left.steps] == pytest.approx([step.opening for step in right.steps], abs=1e-7)
    joints = len(model.contacts) - 1
    assert [step.joint for step in left.steps[1:]] == [joints - step.joint for step in right.steps[1:]]


def test_more_steps_find_the_same():
    model, moves = arch(10), {"springer-right": (0.3, 0, 0)}
    few, many = followed(model, moves, steps=2), followed(model, moves, steps=9)
    assert few.steps[-1].opening == pytest.approx(many.steps[-1].opening, rel=1e-6)


def beside():
    """A beam that the left one of two columns can bear alone."""
    bearing = prism("left", [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], 0.5, fixed=True)
    leaving = prism("right", [(1.2, 0.0), (1.6, 0.0), (1.6, 1.0), (1.2, 1.0)], 0.5, fixed=True)
    beam = prism("beam", [(0.0, 1.0), (1.6, 1.0), (1.6, 1.3), (0.0, 1.3)], 0.5, fixed=False)
    return Assembly((bearing, leaving, beam))


def test_a_support_that_leaves():
    """The beam stays where it is, and what has parted is no contact any more."""
    model = beside()
    path = followed(model, {"right": (0.02, 0, -0.05)}, steps=4)
    assert path.reached
    assert path.proved
    assert path.last is not None
    assert len(path.last.contacts) == 1
    assert path.last.assembly.blocks[2].vertices == pytest.approx(model.blocks[2].vertices, abs=1e-7)
    assert [step.opening for step in path.steps] == pytest.approx([0.0, 0.0125, 0.025, 0.0375, 0.05], abs=1e-7)


def test_a_joint_that_has_parted_may_shift():
    """The same with the column gone far aside: no friction drags the beam after it across the gap."""
    said = Settings(method="rbe", settlement=(("right", (1.0, 0, -0.05, 0, 0, 0)),))
    model = prepare(beside(), said)
    path = _Path(model, model.settled)
    gone = path.settled(path.start(), 1.0)
    there, word = path.followed(gone, 1.0, path.pressure(gone))
    assert word == "rest"
    assert there.centre == pytest.approx(gone.centre, abs=1e-9)


def test_loads_go_with_their_blocks():
    """A ground that turns about a vertical axis takes a stack along."""
    model = stack(2, size=(1.0, 1.0, 0.5))
    loaded = replace(model, loads=(Load(2, np.array([0.0, 0.0, -3000.0]), model.mass.centroid[2] + [0.3, 0.2, 0.0]),))
    path = followed(loaded, {loaded.blocks[0].id: (0.5, 0, 0, 0, 0, 1.0)}, steps=3)
    assert path.reached
    assert path.last is not None
    moved, turned = path.last.assembly, rotations(np.array([[0.0, 0.0, 1.0]]))[0]
    centre = loaded.mass.centroid
    wanted = centre[0] + [0.5, 0, 0] + turned @ (loaded.loads[0].point - centre[0])
    assert moved.loads[0].point == pytest.approx(wanted, abs=1e-6)


def test_what_tips_over():
    """A block whose ground turns about y by t falls at t = atan(b / h), or slides at atan(mu)."""
    model = stack(1, size=(0.4, 0.5, 1.0))
    for mu, angle in ((0.84, np.arctan(0.4)), (0.3, np.arctan(0.3))):
        path = followed(model, {model.blocks[0].id: (0, 0, 0, 0, 0.8, 0)}, steps=4, mu=mu)
        assert not path.reached
        assert path.share * 0.8 == pytest.approx(angle, abs=2 * 0.2 / 2**HALVINGS)
        assert path.steps[-1].word == "falls"


# ---------------------------------------------------------------------------------------------------------------------
# No rest, no path; refusals.


def test_what_is_locked():
    path = followed(beams(0.6, 0.4, 0.3), {"right": (-0.01, 0, 0)}, steps=2)
    assert (path.reached, path.share, path.steps[-1].word) == (False, 0.0, "locked")
    assert path.last is None
    assert "locked" in path.ended


def test_what_is_let_go():
    """A beam that two columns squeeze falls when they part."""
    path = followed(beams(0.6, 0.4, 0.3), {"right": (0.01, 0, 0)}, steps=2)
    assert (path.reached, path.proved, path.share) == (False, False, 0.0)
    assert path.steps[-1].word == "falls"


# ---------------------------------------------------------------------------------------------------------------------
# Joints that slide, and stones that meet on the way.


def floor(*others):
    """A cube on a floor, 1 m wide, and what else there is."""
    bed = prism("floor", [(-3, -1), (3, -1), (3, 0), (-3, 0)], 0.5, fixed=True)
    return Assembly((bed, prism("cube", [(0, 0), (1, 0), (1, 1), (0, 1)], 0.5), *others))


@pytest.mark.parametrize("low", [0.1, 0.0])
def test_a_support_that_pushes_a_stone(low):
    """It meets the cube after 0.2 m, and pushes it along the floor from there on."""
    ram = prism("ram", [(1.2, low), (1.8, low), (1.8, 0.9), (1.2, 0.9)], 0.5, fixed=True)
    path = followed(floor(ram), {"ram": (-0.6, 0, 0)}, steps=3)
    assert path.reached
    assert path.proved
    (met,) = (step for step in path.steps if step.met)
    assert met.met == (("cube", "ram"),)
    assert met.settlement == pytest.approx(0.2, abs=2e-5)
    assert path.last is not None
    moved = path.last.assembly
    assert moved.mass.centroid[1] == pytest.approx([0.1, 0.25, 0.5], abs=2e-5)
    assert {frozenset((int(a), int(b))) for a, b in zip(path.last.contacts.a, path.last.contacts.b, strict=True)} == {
        frozenset((0, 1)),
        frozenset((1, 2)),
    }
    assert all(verify(json.loads(json.dumps(proof))).proved for proof in path.proofs)


def test_what_slides_from_the_beginning(run, tmp_path):
    """A support that touches the cube already: a little of its settlement is undecided, all of it stands."""
    ram = prism("ram", [(1.0, 0.1), (1.8, 0.1), (1.8, 0.9), (1.0, 0.9)], 0.5, fixed=True)
    write_model(tmp_path / "m.json", floor(ram))
    said = ("check", "m.json", "--method", "rbe", "--settlement", "ram:-0.3,0,0")
    assert run(*said)[0] == 3
    status, out, _ = run(*said, "--steps", "2", "--report", "r.html", "--certificate", "c.json")
    assert (status, "3 of 3 proved" in out) == (0, True)
    assert run("verify", "c.json")[0] == 0
    assert "Where they come to rest" in (tmp_path / "r.html").read_text()
    far = tmp_path / "far.json"
    away = prism("ram", [(1.2, 0.1), (1.8, 0.1), (1.8, 0.9), (1.2, 0.9)], 0.5, fixed=True)
    write_model(far, floor(away))
    status, out, _ = run("check", "far.json", "--method", "rbe", "--settlement", "ram:-0.3,0,0", "--steps", "2")
    assert status == 0
    assert "(cube and ram meet)" in out


def test_a_support_does_not_jump_through_a_stone():
    """One step of 3 m, past a slab 0.1 m thick that stands 0.2 m away: it is pushed along, and over the floor's end."""
    bed = prism("floor", [(-3, -1), (3, -1), (3, 0), (-3, 0)], 0.5, fixed=True)
    slab = prism("slab", [(0.9, 0.0), (1.0, 0.0), (1.0, 0.3), (0.9, 0.3)], 0.5)
    ram = prism("ram", [(1.2, 0.02), (1.8, 0.02), (1.8, 0.1), (1.2, 0.1)], 0.5, fixed=True)
    path = followed(Assembly((bed, slab, ram)), {"ram": (-3.0, 0, 0)}, steps=1, mu=0.3)
    (met,) = (step for step in path.steps if step.met)
    assert met.settlement == pytest.approx(0.2, abs=1e-4)
    assert path.reached
    assert path.last is not None
    assert path.last.assembly.mass.centroid[1][0] == pytest.approx(0.95 - 2.8, abs=1e-4)


def test_supports_that_run_into_each_other():
    """Nothing is said of what they do to each other: the path ends where they meet, after 0.2 m."""
    ram = prism("ram", [(1.2, 2.0), (1.8, 2.0), (1.8, 2.9), (1.2, 2.9)], 0.5, fixed=True)
    post = prism("post", [(0.4, 2.0), (1.0, 2.0), (1.0, 2.9), (0.4, 2.9)], 0.5, fixed=True)
    path = followed(floor(ram, post), {"ram": (-0.6, 0, 0)}, steps=3)
    assert not path.reached
    assert path.share * 0.6 <= 0.2
    assert "'ram' and 'post' run into each other" in path.ended


def test_a_floor_that_moves_takes_a_stone_to_a_wall():
    """The cube goes along for 0.3 m; from then on the wall holds it and the floor slides away under it."""
    stop = prism("wall", [(1.3, 0.0), (1.8, 0.0), (1.8, 1.0), (1.3, 1.0)], 0.5, fixed=True)
    path = followed(floor(stop), {"floor": (0.5, 0, 0)}, steps=5, mu=0.3)
    assert path.reached
    assert path.proved
    assert path.last is not None
    assert path.last.assembly.mass.centroid[1] == pytest.approx([0.8, 0.25, 0.5], abs=2e-5)


@pytest.mark.parametrize(("mu", "slides"), [(0.84, False), (0.3, True)])
def test_a_beam_that_sinks_onto_a_stone(mu, slides):
    """Its right end goes down with a support; 1.4 m from the left one's edge a stone is 0.1 m lower.

    Where friction at that edge holds it, it turns about it: 0.1 / 1.4 is its slope when it lies on that stone, and its
    end, 1.8 m along it, has gone down by 1.8 sin of that angle. Its end slides, with mu 0.444 W from the right, and its
    own slope adds 4 degrees to that at the edge: atan(0.444 mu / 0.556) + 4 is below atan mu for 0.84, above for 0.3.
    """
    low = prism("low", [(0.5, -0.5), (1.6, -0.5), (1.6, 0.9), (0.5, 0.9)], 0.5, fixed=True)
    left = prism("left", [(-1, -0.5), (0.2, -0.5), (0.2, 1.0), (-1, 1.0)], 0.5, fixed=True)
    right = prism("right", [(1.8, -0.5), (2.5, -0.5), (2.5, 1.0), (1.8, 1.0)], 0.5, fixed=True)
    beam = prism("beam", [(0, 1), (2, 1), (2, 1.3), (0, 1.3)], 0.5)
    path = followed(Assembly((left, right, low, beam)), {"right": (0, 0, -0.5)}, mu=mu)
    (met,) = (step for step in path.steps if step.met)
    assert met.met == (("low", "beam"),)
    least, most = 1.8 * np.sin(np.arctan(0.1 / 1.4)), 1.8 / 14.0  # or it slides down: its end stays below where it was
    if slides:
        assert least + 1e-5 < met.settlement < most
    else:
        assert met.settlement == pytest.approx(least, abs=2e-5)
    assert path.reached
    assert path.proved
    assert path.last is not None
    lies = path.last.assembly.blocks[3].vertices  # on the left edge and the lower stone's
    slope = np.arctan2(*(lies[0] - lies[1])[[2, 0]] * [1, -1])
    assert slope == pytest.approx(np.arctan(0.1 / 1.4), abs=1e-5)


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_a_stone_loses_its_support(mu):
    """A floor withdrawn by s under a cube that a wall holds back: it tips about the floor's edge, 1 - s from the wall.

    It presses the wall with mu R, which rubs its face down with mu of that: R = W / (1 - mu^2), and moments about the
    edge give s = 1 - (1 - mu^2) / 2: at half its length without friction.
    """
    bed = prism("floor", [(-1, -1), (1, -1), (1, 0), (-1, 0)], 0.5, fixed=True)
    stop = prism("wall", [(-0.5, 0.0), (0.0, 0.0), (0.0, 1.0), (-0.5, 1.0)], 0.5, fixed=True)
    model = Assembly((bed, prism("cube", [(0, 0), (1, 0), (1, 1), (0, 1)], 0.5), stop))
    path = followed(model, {"floor": (-0.8, 0, 0)}, steps=8, mu=mu)
    assert not path.reached
    assert path.proved
    assert path.steps[-1].word == "falls"
    assert path.share * 0.8 == pytest.approx(1.0 - (1.0 - mu * mu) / 2.0, abs=2 * 0.1 / 2**HALVINGS)


def test_what_does_not_stand_before_it():
    path = followed(arch(8), {"springer-right": (0.1, 0, 0)}, mu=0.1)
    assert [step.word for step in path.steps] == ["falls"]
    assert (path.reached, path.proved, path.share) == (False, False, 0.0)
    assert "even before" in path.ended


def test_what_is_refused():
    model = arch(8)
    with pytest.raises(InputError, match="no support settles"):
        subsidence(model, Settings(method="rbe"))
    with pytest.raises(InputError, match="steps 0"):
        followed(model, {"springer-right": (0.1, 0, 0)}, steps=0)
    with pytest.raises(InputError, match="do not go together"):
        followed(model, {"springer-right": (0.1, 0, 0)}, tension=1.0)


def test_the_verdict_on_all_of_it():
    model = arch(8)
    for far, verdict in ((0.4, "stable"), (1.6, "undecided")):
        said = Settings(method="rbe", settlement=(("springer-right", (far, 0, 0, 0, 0, 0)),))
        small, path = check(model, said), subsidence(model, said, steps=2)
        whole = path.judged(small)
        assert (small.verdict, whole.verdict, whole.reason) == ("stable", verdict, path.ended)
        assert (whole.certificate is not None) == (verdict == "stable")
        if whole.certificate is not None:
            assert whole.certificate["kind"] == "rbe-state"
            assert verify(whole.certificate).proved


def test_the_command(run, tmp_path):
    model = replace(arch(8), settlements=(Settlement(9, np.array([0.4, 0, 0, 0, 0, 0])),))
    write_model(tmp_path / "m.json", model)
    files = ("--json", "r.json", "--certificate", "c.json", "--report", "r.html")
    status, out, _ = run("check", "m.json", "--steps", "2", *files)
    assert status == 0
    assert "v04 and v05" in out
    assert "3 of 3 proved, in c-step-00.json to c-step-02.json" in out
    for name in ("c", "c-step-01"):
        assert "proved" in run("verify", f"{name}.json")[1]
    path = json.loads((tmp_path / "r.json").read_text())["path"]
    assert (path["reached"], path["proved"], path["share"], len(path["steps"])) == (True, True, 1.0, 3)
    assert path["steps"][-1]["joint"] == ["v04", "v05"]
    assert "As the settlement goes on" in (tmp_path / "r.html").read_text()
    status, out, _ = run("check", "m.json", "--settlement", "springer-right:2,0,0", "--steps", "1")
    assert status == 3
    assert "falls" in out
    write_model(tmp_path / "n.json", arch(8))
    for said in (("--steps", "4"), ("--settlement", "springer-right:0.1,0,0", "--steps", "0"), ("--steps", "x")):
        status, _, err = run("check", "n.json", *said)
        assert status == 2
        assert err.splitlines()[-1].startswith("cyclopean: error: --steps")
