"""Is a proof about this model? One change at a time, each told in one line; and no line where nothing changed.

The law: what `check` proves of a model is about that model, whatever its kind of proof, contacts, supports and loads.
By hand: a block moved by d is told with d, a force changed by anything is told as one load missing and one too many.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import cyclopean
from coupled_cases import beams
from cyclopean.analysis import Live, Settings, check, compare, limit
from cyclopean.assembly import (
    Assembly,
    BodyLoad,
    Contacts,
    FrictionPair,
    Load,
    Settlement,
    SurfaceLoad,
    detect,
)
from cyclopean.design import arch, stack, wall
from cyclopean.errors import InputError
from cyclopean.io import write_model

RBE = Settings(method="rbe")


def listing(model: Assembly, mu: float = 0.7) -> Assembly:
    """The same model with its contacts listed."""
    return replace(model, contacts=detect(model).contacts.with_mu(mu))


def loaded(model: Assembly) -> Assembly:
    """With one load of each kind on its last block and all of them."""
    last = len(model) - 1
    loads = (Load(last, np.array([1.0, 2.0, -30.0]), model.mass.centroid[last]),)
    press = SurfaceLoad(last, face=0, pressure=10.0)
    quake = BodyLoad(acceleration=np.array([0.01, 0.0, 0.0]))
    return replace(model, loads=loads, actions=(press, quake))


MODELS = {
    "arch": arch(7),
    "contacts detected": replace(wall(2, 2), contacts=None),
    "contacts listed": listing(stack(3)),
    "loads of all kinds": loaded(wall(2, 2)),
    "materials": replace(
        stack(2),
        blocks=tuple(replace(b, material="granite") for b in stack(2).blocks),
        friction=(FrictionPair("granite", "granite", 0.55),),
    ),
    "partly held": replace(
        arch(5), blocks=(*arch(5).blocks[:-1], replace(arch(5).blocks[-1], fixed=None, held=("x", "z", "rx", "ry")))
    ),
    "supports that touch": replace(
        stack(2), blocks=tuple(replace(b, fixed=b.id != stack(2).blocks[-1].id) for b in stack(2).blocks)
    ),
    "far away": replace(
        stack(2),
        blocks=tuple(replace(b, vertices=b.vertices + np.array([3e5, -7e4, 11.0])) for b in stack(2).blocks),
        contacts=None,
    ),
}


def proof_of(model: Assembly, settings: Settings = RBE) -> dict:
    found = check(model, settings).certificate
    assert found is not None
    return found


def differences(model: Assembly, other: Assembly, settings: Settings = RBE) -> tuple[str, ...]:
    return compare(proof_of(model, settings), other).differences


# --- the law ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("tilt", [0.0, 60.0])
def test_a_proof_is_about_its_own_model(name, tilt):
    found = compare(proof_of(MODELS[name], replace(RBE, tilt=(tilt, 20.0))), MODELS[name])
    assert found.differences == ()
    assert found.apart == 0.0
    assert any(line.startswith("gravity") for line in found.assumed)


def test_every_kind_of_proof():
    frame, turned = beams(0.3, 0.3, 0.4), arch(7)
    assert proof_of(frame, Settings(mu=0.3))["kind"] == "cra-tree"
    assert differences(frame, frame, Settings(mu=0.3)) == ()
    assert proof_of(turned, Settings())["kind"] == "cra-state"
    assert differences(turned, turned, Settings()) == ()
    bounds = limit(loaded(turned), Live(push=(1.0, 0.0, 0.0))).certificate
    assert bounds is not None
    assert compare(bounds, loaded(turned)).differences == ()
    assert "what grows with the multiplier" in compare(bounds, loaded(turned)).assumed


def test_order_does_not_matter():
    model = replace(listing(wall(2, 2)), loads=tuple(Load(i, np.array([0, 0, -float(i)]), np.zeros(3)) for i in (3, 4)))
    proof = proof_of(model)
    for key in ("blocks", "contacts", "loads"):
        proof[key] = proof[key][::-1]
    for k, row in enumerate(proof["contacts"]):
        row["polygon"] = row["polygon"][k % 3 :] + row["polygon"][: k % 3]
        if k % 2:
            row["a"], row["b"], row["polygon"] = row["b"], row["a"], row["polygon"][::-1]
    for block in proof["blocks"]:
        block["faces"] = [face[1:] + face[:1] for face in block["faces"][::-1]]
    assert compare(proof, model).differences == ()


def test_rounding_is_no_difference_and_anything_more_is():
    model = listing(wall(2, 2))

    def grown(share):
        contacts = replace(model.contacts, point=model.contacts.point * (1 + share))
        blocks = tuple(replace(b, vertices=b.vertices * (1 + share)) for b in model.blocks)
        return compare(proof_of(model), replace(model, blocks=blocks, contacts=contacts))

    near, far = grown(4e-16), grown(1e-9)
    assert near.differences == ()
    assert 0.0 < near.apart < 1e-14
    assert len(far.differences) > 10
    assert far.apart < 1e-11


# --- one change at a time --------------------------------------------------------------------------------------------

TOWER = listing(stack(3))
LAST = TOWER.blocks[-1]
LOADED = replace(TOWER, loads=(Load(2, np.array([0.0, 0.0, -100.0]), TOWER.mass.centroid[2]),))


def with_last(model=TOWER, **changes):
    return replace(model, blocks=(*model.blocks[:-1], replace(model.blocks[-1], **changes)))


def with_contacts(**changes):
    return replace(TOWER, contacts=replace(TOWER.contacts, **changes))


PAIR = sorted(block.id for block in TOWER.blocks[:2])
FOOT = f"contact '{PAIR[0]}' - '{PAIR[1]}'"


def first_contact_less():
    c = TOWER.contacts
    cut = c.start[1]
    return replace(TOWER, contacts=Contacts(c.a[1:], c.b[1:], c.start[1:] - cut, c.point[cut:], c.mu[1:]))


def pushed(force=(0.0, 0.0, -100.0), aside=0.0, block=2):
    at = TOWER.mass.centroid[2] + [aside, 0.0, 0.0]
    return replace(TOWER, loads=(Load(block, np.array(force), at),))


ids = [block.id for block in TOWER.blocks]
moved_point = TOWER.contacts.point.copy()
UP = np.array([0.0, 0.0, 1e-7])
moved_point[0, 0] += 1e-4 * (1 if moved_point[0, 0] < 0 else -1)
MANY = len(TOWER.contacts)
BENT = (
    *LAST.faces[:-1],
    LAST.faces[-1][:3],
    (*LAST.faces[-1][2:], LAST.faces[-1][0]),
)  # a quadrilateral as two triangles
GONE, ALONE = "is missing in the certificate", "is only in the certificate"
CASES = {
    "vertices": (TOWER, with_last(vertices=LAST.vertices + UP), [f"block '{ids[-1]}' has vertices up to 1e-07"]),
    "faces": (TOWER, with_last(faces=BENT), ["has other faces"]),
    "density": (with_last(density=2400.0), with_last(density=2400.1), ["has 2400 kg/m3, in the model 2400.1"]),
    "support": (TOWER, with_last(fixed=True), ["is free, in the model it is a support"]),
    "no support": (with_last(fixed=True), with_last(fixed=False), ["is a support, in the model it is free"]),
    "held": (with_last(held=("x",)), with_last(held=("x", "ry")), ["is held in x, in the model in x, ry"]),
    "friction": (TOWER, with_contacts(mu=np.full(MANY, 0.7 - 1e-9)), ["has mu 0.7, in the model 0.699999999"] * MANY),
    "tension": (TOWER, with_contacts(tension=np.full(MANY, 5.0)), ["pulls with 0 Pa, in the model 5"] * MANY),
    "contact moved": (TOWER, with_contacts(point=moved_point), ["has its corners up to 0.0001 m"]),
    "contact missing": (first_contact_less(), TOWER, [f"{FOOT} {GONE}"]),
    "contact too many": (TOWER, first_contact_less(), [f"{FOOT} {ALONE}"]),
    "force": (LOADED, pushed((0.0, 0.0, -100.0001)), ["the load (0, 0, -100) N", ALONE]),
    "place": (LOADED, pushed(aside=1e-6), [GONE, ALONE]),
    "block of a load": (LOADED, pushed(block=1), [f"on block '{ids[1]}'", f"on block '{ids[2]}'"]),
    "load missing": (TOWER, LOADED, ["the load (0, 0, -100) N on block"]),
    "load too many": (LOADED, TOWER, [ALONE]),
}


@pytest.mark.parametrize("name", CASES)
def test_each_change_is_told(name):
    proved, model, said = CASES[name]
    assert differences(proved, proved) == ()
    found = differences(proved, model)
    assert len(found) == len(said)
    for part in said:
        assert any(part in line for line in found), found


def test_blocks_that_come_and_go():
    low, high = stack(2), stack(3)
    assert any("is missing in the certificate" in line for line in differences(low, high))
    found = differences(high, low)
    assert any(line == f"block '{high.blocks[-1].id}' is only in the certificate" for line in found)


def test_a_contact_left_out_is_told_where_the_model_lists_none():
    """Without the contact at its foot the proof is about another tower."""
    model = replace(stack(3), contacts=None)
    found = detect(model).contacts
    assert (found.a[0], found.b[0]) == (0, 1)
    rest = [(int(a), int(b)) for a, b in zip(found.a[1:], found.b[1:], strict=True)]
    less = replace(model, contacts=Contacts.of(rest, [found.polygon(k + 1) for k in range(len(rest))]))
    proof = proof_of(less)
    foot, first = sorted(block.id for block in model.blocks[:2])
    assert compare(proof, model).differences == (f"contact '{foot}' - '{first}' is missing in the certificate",)
    assert compare(proof_of(model), less).differences == (f"contact '{foot}' - '{first}' is only in the certificate",)


def test_what_a_model_leaves_open_is_assumed_and_no_difference():
    model = stack(3)
    found = compare(proof_of(model, replace(RBE, mu=0.33, density=1900.0, gravity=(0.0, 0.0, -3.7))), model)
    assert found.differences == ()
    assert {"mu 0.33", "density 1900", "gravity (0, 0, -3.7)"} <= set(found.assumed)
    other = compare(proof_of(model, replace(RBE, supports=f"ids={model.blocks[1].id}")), model)
    assert any("is a support, in the model it is free" in line for line in other.differences)


def test_friction_of_materials_is_the_models():
    rougher = replace(MODELS["materials"], friction=(FrictionPair("granite", "granite", 0.6),))
    found = differences(rougher, MODELS["materials"])
    assert found
    assert all(line.endswith("has mu 0.6, in the model 0.55") for line in found)


def test_settlements():
    model = replace(arch(7), settlements=(Settlement(0, np.array([-0.01, 0, 0, 0, 0, 0.0])),))
    proof = proof_of(model)
    assert proof["kind"] == "rbe-settled"
    assert compare(proof, model).differences == ()
    further = replace(model, settlements=(Settlement(0, np.array([-0.02, 0, 0, 0, 0, 0.0])),))
    assert compare(proof, further).differences == (
        f"block '{model.blocks[0].id}' settles in another way than in the model",
    )
    assert "how supports settle" in compare(proof, arch(7)).assumed


def test_ten_lines_and_how_many_more():
    model = replace(wall(4, 4), contacts=None)
    off = replace(model, blocks=tuple(replace(b, vertices=b.vertices * 1.5) for b in model.blocks))
    lines = differences(model, off)
    assert len(lines) == 11
    assert lines[-1].startswith("... and ")
    assert lines[-1].endswith(" more differences")


def test_a_model_that_cannot_be_checked_is_refused():
    open_mesh = with_last(faces=LAST.faces[:-1])
    with pytest.raises(InputError, match="mend its mesh"):
        compare(proof_of(TOWER), open_mesh)


# --- the command and the function ------------------------------------------------------------------------------------


@pytest.fixture
def files(run, tmp_path):
    write_model(tmp_path / "arch.json", arch(7))
    write_model(tmp_path / "other.json", arch(7, span=3.01))
    assert run("check", "arch.json", "--certificate", "proof.json")[0] == 0
    return "proof.json"


def test_the_command(run, files):
    status, out, err = run("verify", files, "--model", "arch.json")
    assert (status, err) == (0, "")
    assert out.startswith("proved: stable under coupled")
    assert "arch.json: the same blocks, contacts and loads, to the last digit" in out
    assert "assumed    mu 0.84, density 2400" in out
    status, out, err = run("verify", files, "--model", "other.json")
    assert (status, err) == (1, "")
    assert out.startswith("PROVED, BUT NOT OF THIS MODEL: stable")
    assert len(out.splitlines()) == 13
    status, out, _ = run("verify", files, "--model", "other.json", "--json", "-")
    assert status == 1
    data = json.loads(out)
    assert data["proved"] is True
    assert data["model"]["same"] is False
    assert len(data["model"]["differences"]) == 11


def test_without_a_model_the_command_says_what_is_assumed(run, files):
    _, out, _ = run("verify", files)
    said = dict(line.split(None, 1) for line in out.splitlines()[2:])
    assert said["blocks"] == "9, 7 of them free"
    assert said["supports"] == "springer-left, springer-right"
    assert said["friction"] == "mu 0.84"
    assert said["gravity"].startswith("(0, 0, -9.80665)")
    assert json.loads(run("verify", files, "--json", "-")[1])["assumed"] == out.replace("\n  ", "\n").splitlines()[2:]


def test_what_the_command_refuses(run, files):
    assert run("verify", files, "--model", "none.json")[0] == 2
    assert run("verify", "none.json", "--model", "arch.json")[0] == 2
    assert run("verify", files, "--model", files)[0] == 2
    assert run("verify", files, "--units", "mm")[0] == 2
    assert run("verify", files, "--model", "arch.json", "--json", "arch.json")[0] == 2
    with open(files) as file:
        spoilt = json.load(file) | {"seal": ""}
    with open("spoilt.json", "w") as file:
        json.dump(spoilt, file)
    status, out, _ = run("verify", "spoilt.json", "--model", "arch.json")
    assert status == 1
    assert out.startswith("NOT proved: ")


def test_a_model_in_another_format_and_unit(run, files):
    assert run("convert", "arch.json", "arch.obj")[0] == 0
    status, out, _ = run("verify", files, "--model", "arch.obj", "--units", "m")
    assert status == 0, out
    assert "contacts where faces touch to" in out
    assert run("verify", files, "--model", "arch.obj", "--units", "mm")[0] == 1


def test_the_function(run, files):
    assert cyclopean.verify_file(files, model="arch.json").proved
    report = cyclopean.verify_file(files, model="other.json")
    assert not report.proved
    assert report.reason.startswith("proved, but not of this model: block ")
    assert "\n" not in report.reason
    proof = proof_of(arch(7))
    assert cyclopean.verify(proof).proved
    assert cyclopean.verify(proof, model=arch(7)).proved
    assert not cyclopean.verify(proof, model=stack(2)).proved
    assert "seal" in cyclopean.verify(proof | {"seal": ""}, model=stack(2)).reason
    assert math.isclose(compare(proof, arch(7)).apart, 0.0)
