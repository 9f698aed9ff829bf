"""Certificates that somebody damaged, or wrote to deceive."""

import copy
import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cyclopean.proof import seal, verify
from damages import REMOVE, at, changed, differs, places, resealed, substitutes
from laws import examples
from test_proof_checker import (
    BASE,
    PROVED,
    W,
    box,
    contact,
    cube_on_ground,
    cube_on_slope,
    level,
    on_edges,
    overhang,
    pushed_cube,
    sealed,
    sliding,
    state,
    two_cubes,
)


@pytest.mark.parametrize("build", [pushed_cube, overhang])
def test_every_damage_breaks_the_seal(build):
    """Each value of a certificate replaced by each of its substitutes: rejected, in one line, without an exception."""
    certificate = build()
    for path in places(certificate):
        if path:
            old = at(certificate, path)
            for new in substitutes(old):
                if differs(new, old):
                    report = verify(changed(certificate, path, new))
                    assert not report.proved, (path, new)
                    assert report.reason.isascii()
                    assert "\n" not in report.reason
                    assert len(report.reason) < 250


def _always_wrong(old, new):
    """Whether the change must be refused whatever the seal says: fields and types that a certificate cannot have, and
    numbers that statics cannot bear.
    """
    if new is None or isinstance(new, dict) or (isinstance(new, bool) and not isinstance(old, bool)):
        return True
    if isinstance(old, int | float) and not isinstance(old, bool):
        return new is REMOVE or isinstance(new, str | list) or not (new == 0 or 1e-150 <= abs(new) <= 1e100)
    return isinstance(old, str) and new is REMOVE


@pytest.mark.parametrize("build", [pushed_cube, overhang])
def test_malformed_is_refused_with_a_good_seal_too(build):
    certificate = build()
    for path in places(certificate):
        if path and path != ("seal",):
            old = at(certificate, path)
            for new in substitutes(old):
                if differs(new, old) and _always_wrong(old, new):
                    report = verify(resealed(changed(certificate, path, new)))
                    assert not report.proved, (path, new)


def edged_cube():
    return on_edges(cube_on_ground())


def edged_cubes():
    """A state that leaves no room: all its forces are on the edges of their cones, so that nothing can be corrected."""
    return on_edges(two_cubes())


def test_every_changed_force_is_refused_with_a_good_seal():
    """No force component of a balanced state without slack may change by a millionth of it, or of the weight."""
    for build in (edged_cube, edged_cubes, cube_on_slope):
        certificate = build()
        for path in places(certificate["forces"]):
            if len(path) == 2:
                old = at(certificate["forces"], path)
                for new in (old * (1 + 1e-6), old - 1e-6 * W, old + 1e-6 * W):
                    if new != old:
                        assert not verify(sealed(changed(certificate, ("forces", *path), new))).proved


def test_every_changed_gravity_or_density_is_refused_in_a_state():
    certificate = edged_cube()
    certificate["loads"] = [{"block": "cube", "force": [s * W, 0, 0], "point": [0, 0, 0.5]} for s in (1, -1)]
    for path in (("gravity", 0), ("gravity", 1), ("gravity", 2), ("blocks", 1, "density"), ("loads", 0, "force", 0)):
        new = at(certificate, path) * (1 + 1e-6) + 1e-6
        assert "do not balance" in verify(sealed(changed(certificate, path, new))).reason


def test_every_moved_vertex_of_a_free_block_is_refused_in_a_state():
    """Moved by a thousandth of the cube: weight, centre or the place of the contact is wrong."""
    certificate = edged_cubes()
    for i in (1, 2):
        for path in places(certificate["blocks"][i]["vertices"]):
            if len(path) == 2:
                full = ("blocks", i, "vertices", *path)
                for by in (1e-3, -1e-3):
                    report = verify(sealed(changed(certificate, full, at(certificate, full) + by)))
                    assert not report.proved, (full, by)


def test_every_moved_contact_point_is_refused_in_a_state():
    certificate = edged_cubes()
    for i in (0, 1):
        for path in places(certificate["contacts"][i]["polygon"]):
            if len(path) == 2:
                full = ("contacts", i, "polygon", *path)
                for by in (1e-3, -1e-3):
                    assert not verify(sealed(changed(certificate, full, at(certificate, full) + by))).proved, full


def edit(build, change):
    certificate = copy.deepcopy(build())
    change(certificate)
    return sealed(certificate)


def _swap(c):
    c["contacts"][1]["a"], c["contacts"][1]["b"] = c["contacts"][1]["b"], c["contacts"][1]["a"]


def _duplicate_block(c):
    c["blocks"].append(copy.deepcopy(c["blocks"][1]))


def _open_mesh(c):
    c["blocks"][1]["faces"].pop()


def _invert_mesh(c):
    c["blocks"][1]["faces"] = [face[::-1] for face in c["blocks"][1]["faces"]]


def _twist_face(c):
    c["blocks"][1]["faces"][0].reverse()


def _double_face(c):
    c["blocks"][1]["faces"] += [[0, 1, 2], [2, 1, 0]]


def _tilt_contact(c):
    for point in c["contacts"][0]["polygon"]:
        point[2] += point[0] / 2


def _sink_contact(c):
    for point in c["contacts"][0]["polygon"]:
        point[2] -= 1e-5


def _permute_forces(c):
    c["forces"] = c["forces"][4:] + c["forces"][:4]


def _grow_force(c):
    c["forces"][0] = [10 * x for x in c["forces"][0]]


def _set(*path_and_value):
    *path, value = path_and_value

    def change(c):
        at(c, path[:-1])[path[-1]] = value

    return change


DECEITS = [
    (two_cubes, _swap, "not on a face"),
    (two_cubes, _duplicate_block, "same id"),
    (two_cubes, _open_mesh, "do not close"),
    (two_cubes, _invert_mesh, "volume is not positive"),
    (two_cubes, _twist_face, "do not close"),
    (two_cubes, _double_face, "do not close"),
    (two_cubes, _tilt_contact, "not on a face"),
    (two_cubes, _sink_contact, "not on a face"),
    (edged_cubes, _permute_forces, "do not balance"),
    (edged_cubes, _grow_force, "do not balance"),
    (two_cubes, _set("contacts", 1, "b", "cube"), "to itself"),
    (two_cubes, _set("contacts", 1, "b", "nobody"), "no block"),
    (two_cubes, _set("contacts", 1, "b", ["upper"]), "no block"),
    (two_cubes, _set("contacts", 0, "mu", -0.5), "mu is negative"),
    (two_cubes, _set("tolerance", -1e-6), "tolerance is negative"),
    (two_cubes, _set("contacts", 0, "surface", "smooth"), "neither rough nor curved"),
    (two_cubes, _set("contacts", 0, "surface", True), "neither rough nor curved"),
    (two_cubes, _set("blocks", 1, "density", 0), "density is not positive"),
    (two_cubes, _set("blocks", 0, "density", -1), "density is not positive"),
    (two_cubes, _set("blocks", 1, "fixed", True), "two fixed blocks"),
    (cube_on_ground, _set("blocks", 1, "fixed", True), "two fixed blocks"),
    (cube_on_ground, _set("blocks", 0, "fixed", False), "do not balance"),
    (cube_on_ground, _set("blocks", 0, "fixed", 1), "fixed is not true or false"),
    (two_cubes, _set("blocks", 1, "faces", []), "no faces|do not close"),
    (two_cubes, _set("blocks", 1, "faces", 0, [0, 0, 1]), "different vertex"),
    (two_cubes, _set("blocks", 1, "faces", 0, [0, 1]), "different vertex"),
    (two_cubes, _set("blocks", 1, "faces", 0, [0, 1, 8]), "different vertex"),
    (two_cubes, _set("blocks", 1, "faces", 0, [0, 1, -1]), "different vertex"),
    (two_cubes, _set("blocks", 1, "faces", 0, [0, 1, True]), "different vertex"),
    (two_cubes, _set("blocks", 1, "faces", 0, [0, 1, 2.0]), "different vertex"),
    (two_cubes, _set("contacts", 0, "polygon", level(0, 0, 1, 1)[:2]), "fewer than three"),
    (two_cubes, _set("contacts", 0, "polygon", [[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [0.3, 0, 0]]), "no area"),
    (two_cubes, _set("contacts", 0, "polygon", 2, 2, 0.1), "not flat"),
    (two_cubes, _set("contacts", []), "8 forces for 0"),
    (two_cubes, _set("forces", []), "0 forces for 8"),
    (two_cubes, _set("gravity", [0, -9.8125]), "2 numbers instead of 3"),
    (two_cubes, _set("kind", "cra"), "not one this checker knows"),
    (two_cubes, _set("kind", "cra-state"), "missing: beta_min, eps, eta, mechanism"),
    (two_cubes, _set("kind", "rbe-mechanism"), "missing: mechanism"),
    (two_cubes, _set("schema", "cyclopean.certificate/1"), "certificate of version 1"),
    (two_cubes, _set("schema", "cyclopean.certificate/3"), "schema is not cyclopean.certificate/2"),
    (overhang, _set("mechanism", {}), "missing: cube"),
    (overhang, _set("mechanism", "ground", [0] * 6), "unknown field: ground"),
    (overhang, _set("mechanism", "cube", [0] * 5), "5 numbers instead of 6"),
    (overhang, _set("mechanism", "cube", 2, 0.125), "might hold|no work"),
    (overhang, _set("mechanism", "cube", 4, -1), "might hold|no work"),
    (overhang, _set("mechanism", "cube", 4, 1.001), "might hold"),
    (overhang, _set("contacts", 0, "b", "ground"), "to itself"),
    (overhang, _set("gravity", [0, 0, 9.8125]), "no work"),
    (sliding, _set("contacts", 0, "mu", 0.50001), "might hold"),
    (sliding, _set("mechanism", "cube", 2, 0.4999), "might hold"),
]


@pytest.mark.parametrize(("build", "change", "reason"), DECEITS)
def test_deceit_with_a_good_seal(build, change, reason):
    report = verify(edit(build, change))
    assert not report.proved
    assert any(part in report.reason for part in reason.split("|")), report.reason


def test_lower_friction_is_refused_in_a_state():
    report = verify(edit(pushed_cube, _set("contacts", 0, "mu", 0.1)))
    assert "friction cone" in report.reason


def test_the_order_of_names_is_not_sealed():
    """Other programs write the fields of an object in another order: it is the same file."""

    def reversed_names(value):
        if isinstance(value, dict):
            return {name: reversed_names(value[name]) for name in reversed(value)}
        return [reversed_names(one) for one in value] if isinstance(value, list) else value

    assert verify(reversed_names(cube_on_ground())).proved


def test_a_support_may_weigh_nothing_and_nothing_else_may():
    for number, proved in ((0, True), (1, False)):
        certificate = copy.deepcopy(cube_on_ground())
        certificate["blocks"][number]["density"] = 0.0
        report = verify(resealed(certificate))
        assert report.proved is proved
        assert proved or "density is not positive" in report.reason


def test_a_wrong_seal_is_refused():
    for wrong in ("", "0" * 64, None, 0, seal(cube_on_ground()).upper()):
        assert "seal" in verify({**cube_on_ground(), "seal": wrong}).reason


def test_a_contact_with_a_bogus_neighbour_is_refused():
    """A huge support far away, with a contact at the cube: its tolerance would have to be that of the support."""
    far = box("far", [100, -1e4, 0], [1e4, 1e4, 1e4], fixed=True)
    joint = contact("far", "cube", level(-0.5, -0.5, 0.5, 0.5))
    cube = box("cube", [-0.5, -0.5, 0], [0.5, 0.5, 1])
    for tolerance in (1e-6, 50):
        assert not verify(state([far, cube], [joint], [[0, 0, W / 4]] * 4, tolerance=tolerance)).proved


def test_contact_of_two_fixed_blocks_is_refused():
    certificate = cube_on_ground()
    certificate["blocks"].append(box("rock", [-4, -4, -2], [4, 4, -1], fixed=True))
    certificate["contacts"].append(contact("rock", "ground", level(-1, -1, 1, 1, -1.0)))
    certificate["forces"] += [[0, 0, 0]] * 4
    assert "two fixed blocks" in verify(sealed(certificate)).reason


@pytest.mark.parametrize("value", [None, 1, "text", [], {}, [[]], {"schema": 1}, {1: 2}, math.nan])
def test_anything_that_is_no_certificate_is_refused(value):
    assert not verify(value).proved


def test_deep_nesting_is_refused():
    deep = []
    for _ in range(100_000):
        deep = [deep]
    for path in (("gravity",), ("gravity", 0), ("blocks", 0, "id"), ("contacts", 0, "a"), ("kind",), ("seal",)):
        certificate = cube_on_ground()
        at(certificate, path[:-1])[path[-1]] = deep
        assert not verify(certificate).proved


@pytest.mark.parametrize("build", [*PROVED, edged_cubes])
def test_numbers_at_the_edge_of_the_accepted_range_are_answered(build):
    """Exponents as far apart as allowed: big integers, no hang, no exception."""
    certificate = build()
    for path in places(certificate):
        if type(at(certificate, path)) in (int, float) and "faces" not in path:
            for new in (1e100, -1e100, 1.7e-150):
                report = verify(sealed(changed(certificate, path, new)))
                assert report.reason.isascii()
                assert all(math.isfinite(x) for x in report.figures.values()), (path, new)


values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**30), 10**30)
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from(["cube", "ground", "rbe-state", "rbe-mechanism"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@settings(max_examples=examples(300), deadline=None)
@given(st.sampled_from(PROVED), st.data())
def test_random_damage_never_raises(build, data):
    """Up to three random places replaced by random values: unsealed refused; re-sealed answered without exception."""
    certificate = build()
    before = json.dumps(certificate, sort_keys=True)
    for _ in range(data.draw(st.integers(1, 3))):
        path = data.draw(st.sampled_from([p for p in places(certificate) if p]))
        old = at(certificate, path)
        new = data.draw(values | st.sampled_from([x for x in substitutes(old) if x is not REMOVE]))
        certificate = changed(certificate, path, new)
    report = verify(certificate)
    assert report.reason.isascii()
    try:
        unchanged = json.dumps(certificate, sort_keys=True) == before
    except ValueError:  # an integer too long to write
        unchanged = False
    assert report.proved is unchanged
    again = verify(resealed(certificate))
    assert again.reason.isascii()
    assert all(math.isfinite(x) for x in again.figures.values())


def test_base_is_not_modified_by_the_builders():
    assert BASE["polygon"] == level(-0.5, -0.5, 0.5, 0.5)
