"""Friction pyramids: by hand, against linear programmes, against round cones; what is refused, and damage.

Mutants killed by hand: edges of the inscribed pyramid on the faces of the circumscribed one and the other way round,
edges between the wrong faces, force rows in another order than edges, the sign of an edge at swapped blocks.
"""

import copy
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cyclopean import arch, stack, wall
from cyclopean.analysis import Settings, check, compare, prepare
from cyclopean.analysis.equilibrium.reference import parse_cone
from cyclopean.analysis.pyramids import edges_of
from cyclopean.errors import InputError
from cyclopean.proof import seal, verify
from cyclopean.statics import pyramid_rows
from laws import examples

G = 9.80665


def judged(model, cone, mu=None, tilt=(0.0, 0.0), **more):
    return check(model, Settings(method="rbe", mu=mu, tilt=tilt, cone=cone, **more))


@pytest.mark.parametrize(
    ("cone", "degrees", "azimuth", "word"),
    [
        # A cube slides down a slope along an edge at tan = the friction of the edge, along the middle of a face at that
        # of the face: 45 and 0 degrees with four faces, where the contact's frame is along x and y.
        ("circumscribed:4", 44.7, 45.0, "stable"),  # edge: sqrt 2 x 0.7 = 0.99 = tan 44.71
        ("circumscribed:4", 44.8, 45.0, "unstable"),
        ("circumscribed:4", 34.9, 0.0, "stable"),  # face: 0.7 = tan 34.99
        ("circumscribed:4", 35.1, 0.0, "unstable"),
        ("inscribed:4", 34.9, 45.0, "stable"),
        ("inscribed:4", 35.1, 45.0, "unstable"),
        ("inscribed:4", 26.3, 90.0, "stable"),  # face: 0.7 / sqrt 2 = tan 26.33
        ("inscribed:4", 26.4, 90.0, "unstable"),
    ],
)
def test_a_cube_on_a_slope(cone, degrees, azimuth, word):
    model = stack(1, size=(1.0, 1.0, 0.01))
    result = judged(model, cone, 0.7, (degrees, azimuth))
    assert result.verdict == word
    assert verify(result.certificate).proved
    exact = "stable" if degrees < 34.99 else "unstable"
    assert result.provenance["exact_cone"] == exact
    assert result.reason.startswith("Only with" if word != exact else "With friction pyramids, ")
    if word == "stable":
        force = np.einsum("pi,pij->pj", result.force, result.frame[result.contacts.patch])
        weight = 0.01 * 2400.0 * G
        assert np.linalg.norm(force.sum(axis=0)) == pytest.approx(weight, rel=1e-9)
    else:
        assert result.force is None


def feasible(system, cone):
    """Whether a linear programme finds forces in the pyramids, in the frames of the contacts."""
    kind, faces = cone.split(":")
    rows = pyramid_rows(system.mu, int(faces), kind == "inscribed")
    bounds = np.tile([[0.0, np.inf], [-np.inf, np.inf], [-np.inf, np.inf]], (system.points, 1))
    cost = np.zeros(3 * system.points)
    return linprog(cost, rows, np.zeros(rows.shape[0]), system.A, -system.p, bounds, method="highs").status == 0


@settings(max_examples=examples(12), deadline=None)
@given(
    st.sampled_from([arch(5, span=1.0, thickness=0.16), wall(2, 2), arch(4, span=4.0, thickness=0.5)]),
    st.sampled_from(["inscribed", "circumscribed"]),
    st.integers(3, 9),
    st.floats(0.05, 1.2),
    st.floats(0.0, 50.0),
    st.floats(0.0, 360.0),
    st.sampled_from([1e-3, 1.0, 300.0]),
)
def test_the_verdict_is_that_of_a_linear_programme(model, kind, faces, mu, degrees, azimuth, size):
    cone, tilt = f"{kind}:{faces}", (degrees, azimuth)
    blocks = tuple(replace(b, vertices=b.vertices * size) for b in model.blocks)
    model = replace(model, blocks=blocks, contacts=None)
    result = judged(model, cone, mu, tilt)
    near = [prepare(model, Settings(method="rbe", mu=x * mu, tilt=tilt)).system() for x in (0.999, 1.001)]
    words = {"stable" if feasible(system, cone) else "unstable" for system in near}
    assert result.verdict in words if len(words) == 1 else True  # no programme is to be asked at its very limit
    words = {result.provenance["exact_cone"], result.verdict}
    assert words != {"stable", "unstable"} or (result.verdict == "stable") == (kind == "circumscribed")


@pytest.mark.parametrize("kind", ["inscribed", "circumscribed"])
def test_edges_lie_on_two_faces_each(kind):
    """In the contact's own frame an edge is on its face and on the next, and inside all others."""
    contacts = prepare(arch(6), Settings(mu=0.6)).contacts
    edges = edges_of(contacts, parse_cone(f"{kind}:7"))
    local = np.einsum("cki,cji->ckj", edges, contacts.frame)
    rows = pyramid_rows(np.array([0.6]), 7, kind == "inscribed").toarray()
    off = np.einsum("fj,ckj->ckf", rows, local)
    assert off.max() < 1e-12
    assert (np.sum(np.abs(off) < 1e-12, axis=2) == 2).all()
    slope = np.hypot(local[..., 1], local[..., 2]) / local[..., 0]
    assert slope == pytest.approx(0.6 if kind == "inscribed" else 0.6 / np.cos(np.pi / 7), rel=1e-12)


def test_coupled_analysis_takes_the_cones_inside_and_outside():
    """Inside an inscribed pyramid of four is 0.707 mu, round a circumscribed one 1.414 mu."""
    model = stack(1, size=(1.0, 1.0, 0.01))

    def word(cone, degrees):
        result = check(model, Settings(method="cra", mu=0.7, tilt=(degrees, 45.0), cone=cone))
        if result.certificate is not None:
            assert verify(result.certificate).proved
            same = compare(result.certificate, replace(model, contacts=result.contacts))
            assert same.differences == () or result.certificate["gravity"] != [0.0, 0.0, -G]
        return result.verdict

    assert [word("inscribed:4", d) for d in (26.0, 30.0, 35.5)] == ["stable", "undecided", "unstable"]
    assert [word("circumscribed:4", d) for d in (34.0, 40.0, 45.0)] == ["stable", "undecided", "unstable"]


def resealed(certificate, change):
    damaged = copy.deepcopy(certificate)
    change(damaged)
    damaged["seal"] = seal(damaged)
    return damaged


def test_damaged_pyramids_are_found():
    model = stack(1, size=(1.0, 1.0, 0.01))
    state = judged(model, "circumscribed:4", 0.7, (40.0, 45.0)).certificate
    fall = judged(model, "inscribed:4", 0.7, (40.0, 45.0)).certificate
    report = verify(state)
    assert report.proved
    assert "COUNTING ON PYRAMIDS OF 4 EDGES for friction cones, up to mu 0.989949" in report.claim

    def of(certificate, change):
        report = verify(resealed(certificate, change))
        assert not report.proved
        return report.reason

    def edges(certificate):
        return certificate["contacts"][0]["edges"]

    along = max(range(4), key=lambda k: sum(row[k] for row in state["forces"]))
    assert "do not balance" in of(state, lambda c: edges(c)[along].__setitem__(0, 0.9 * edges(c)[along][0]))
    assert "pulls" in of(state, lambda c: c["forces"][0].__setitem__(along, -c["forces"][0][along]))
    assert "instead of 4 or 8" in of(state, lambda c: c["forces"][0].pop())
    assert "has 2 edges" in of(state, lambda c: c["contacts"][0].update(edges=edges(c)[:2]))
    assert "has 361 edges" in of(state, lambda c: c["contacts"][0].update(edges=361 * edges(c)[:1]))
    assert "does not look along it" in of(state, lambda c: edges(c)[1].__setitem__(2, -1.0))
    assert "pulls or is rough" in of(state, lambda c: c["contacts"][0].update(tension=1.0))
    assert "pulls or is rough" in of(state, lambda c: c["contacts"][0].update(surface="rough"))
    assert "instead of 3 or 6" in of(state, lambda c: c["contacts"][0].pop("edges"))
    wide = judged(model, "circumscribed:4", 0.7, (40.0, 45.0)).certificate["contacts"][0]["edges"]
    assert "might hold this motion" in of(fall, lambda c: c["contacts"][0].update(edges=wide))
    coupled = check(model, Settings(method="cra", mu=0.7)).certificate
    assert "pyramids are no part" in of(coupled, lambda c: c["contacts"][0].update(edges=wide))


def test_cones_and_pyramids_side_by_side():
    """Where some contacts have pyramids and others cones, what balances exactly does so over the right contacts.

    The first contact gets its own four forces for edges, each point bears along one of them: the forces are the same.
    """
    certificate = check(wall(2, 3), Settings(method="rbe", mu=0.7, tilt=(3.0, 20.0))).certificate
    plain = verify(certificate)
    assert plain.figures["exact"] == 1.0

    def one_pyramid(certificate):
        rows = certificate["forces"][:4]
        assert len(certificate["contacts"][0]["polygon"]) == 4
        certificate["contacts"][0]["edges"] = [[sum(row[k::3]) for k in range(3)] for row in rows]
        certificate["forces"][:4] = np.eye(4).tolist()

    mixed = verify(resealed(certificate, one_pyramid))
    assert mixed.proved
    assert mixed.figures["equilibrium_force"] == pytest.approx(plain.figures["equilibrium_force"], abs=1e-12)
    last = copy.deepcopy(certificate)
    last["contacts"].append(last["contacts"].pop(0))  # the same with the pyramid last
    last["forces"] = last["forces"][4:] + last["forces"][:4]
    last["seal"] = seal(last)

    def last_pyramid(certificate):
        certificate["contacts"][-1]["edges"] = [
            [sum(row[k::3]) for k in range(3)] for row in certificate["forces"][-4:]
        ]
        certificate["forces"][-4:] = np.eye(4).tolist()

    assert verify(resealed(last, last_pyramid)).figures["exact"] == mixed.figures["exact"]


def test_a_certificate_is_held_against_the_model():
    model = replace(stack(1, size=(1.0, 1.0, 0.01)), contacts=None)
    certificate = judged(model, "circumscribed:6", 0.7).certificate
    same = compare(certificate, model)
    assert same.differences == ()
    assert "PYRAMIDS for friction cones, circumscribed:6" in same.assumed
    odd = resealed(certificate, lambda c: c["contacts"][0]["edges"][2].__setitem__(0, 0.5))
    assert "has a pyramid that is no regular one of its mu" in compare(odd, model).differences[0]


def test_less_friction_than_the_model_has_proves_more():
    """Forces that balance with less friction do with more; a mechanism with more is one with less. Not the others."""
    model = stack(1, mu=0.5)
    contacts = check(model, Settings(method="rbe")).contacts
    model = replace(model, contacts=contacts)

    def said(mu, degrees):
        other = replace(model, contacts=replace(contacts, mu=np.full(len(contacts), mu)))
        return compare(check(other, Settings(method="rbe", tilt=(degrees, 0.0))).certificate, model)

    assert said(0.4, 20.0).differences == ()
    assert "mu 0.4, less than in the model" in said(0.4, 20.0).assumed
    assert "has mu 0.6, in the model 0.5" in said(0.6, 20.0).differences[0]
    assert said(0.6, 32.0).differences == ()
    assert "has mu 0.4, in the model 0.5" in said(0.4, 32.0).differences[0]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"tension": 1e5}, "leave out tension"),
        ({"penalty": True}, "leave out penalty"),
        ({"within": 0.001}, "leave out within"),
    ],
)
def test_what_goes_with_no_pyramid(more, message):
    with pytest.raises(InputError, match=message):
        judged(stack(1), "inscribed:8", 0.7, **more)


def test_joints_that_have_more_than_friction():
    model = stack(1, mu=0.5)
    contacts = check(model, Settings(method="rbe")).contacts
    for change, word in ({"tension": np.array([1e4])}, "pulls"), ({"lean": np.array([0.1])}, "is rough"):
        with pytest.raises(InputError, match=f"the joint of 'ground' and 'b01' {word}"):
            judged(replace(model, contacts=replace(contacts, **change)), "inscribed:8")
