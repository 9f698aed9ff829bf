"""The checker of certificates that pages hold, against Python's: the same answer, whole and damaged, in one browser.

It was written from `docs/certificates.md` alone. The whole comparison is `bench/second_checker.py`; here is a small
share, with every kind in it, and the pages themselves: the button in a report, and a file dropped on a page of its own.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cyclopean
from checker_cases import any_certificate, as_points, damaged
from chromium import Chromium
from coupled_cases import beams
from cyclopean import Settings
from cyclopean.io import write_text
from cyclopean.proof import NotACertificateError, seal, verify_file
from cyclopean.view.proof_here import proof_page
from test_proof_points import knife

CHECKER = Path(cyclopean.__file__).parent / "view" / "checker.js"
Answer = dict[str, Any]
RBE = Settings(method="rbe")


@pytest.fixture(scope="module")
def proofs() -> dict[str, dict[str, Any]]:
    """One certificate of every kind, and of what they may hold."""
    slope, leaning = cyclopean.stack(3, (1.0, 1.0, 0.5), slope=20.0, mu=0.5), cyclopean.stack(4, offset=0.4)
    arch = cyclopean.arch(6, span=3.0, thickness=0.5)
    tree = cyclopean.check(beams(0.5, 0.4, 0.3), mu=0.5).certificate
    return {
        "rbe-state": cyclopean.check(arch, RBE).certificate,
        "rbe-mechanism": cyclopean.check(leaning, RBE).certificate,
        "cra-state": cyclopean.check(slope).certificate,
        "cra-tree": tree,
        "component": beside(tree, cyclopean.check(slope, RBE).certificate),
        "limit-bounds": cyclopean.limit(arch, push=(1.0, 0.0, 0.0)).certificate,
        "recession": cyclopean.limit(cyclopean.stack(2, mu=0.5), loads=(("b01", (0.0, 0.0, -1.0), None),)).certificate,
        "rbe-settled": cyclopean.check(
            slope, Settings(method="rbe", settlement=(("ground", (0.01, 0.0, -0.01, 0.0, 0.0, 0.0)),))
        ).certificate,
        "rbe-state-within": cyclopean.check(arch, Settings(method="rbe", within=1e-3)).certificate,
        "rbe-mechanism-within": cyclopean.check(leaning, Settings(method="rbe", within=1e-3)).certificate,
        "tension": cyclopean.check(leaning, Settings(method="rbe", tension=1e6)).certificate,
        "pyramids": cyclopean.check(arch, Settings(method="rbe", cone="inscribed:8")).certificate,
        "misfit": misfitting(cyclopean.check(cyclopean.stack(2, (1.0, 1.0, 0.5)), RBE).certificate),
        "points": as_points(cyclopean.check(slope, RBE).certificate),
    }


def beside(tree: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """A tree that is about one component of a model: another one stands far beside it, and is listed first."""
    both, other = json.loads(json.dumps(tree)), json.loads(json.dumps(other))
    both["component"] = next(block["id"] for block in both["blocks"] if not block["fixed"])
    for block in other["blocks"]:
        block |= {"id": f"far-{block['id']}", "vertices": [[x + 20.0, y, z] for x, y, z in block["vertices"]]}
    for contact in other["contacts"]:
        contact |= {side: f"far-{contact[side]}" for side in "ab"}
        contact["polygon"] = [[x + 20.0, y, z] for x, y, z in contact["polygon"]]
    both |= {key: other[key] + both[key] for key in ("blocks", "contacts")}
    return both | {"seal": seal(both)}


def misfitting(proof: dict[str, Any]) -> dict[str, Any]:
    """The ground reaches a millimetre into the stone on it, and two supports 0.125 m into both, by hand."""
    changed = json.loads(json.dumps(proof)) | {"tolerance": 0.002}
    ground, first, _ = changed["blocks"]
    ground["vertices"] = [[x, y, z + 0.001] for x, y, z in ground["vertices"]]
    for side in (0.875, -0.875):
        vertices = [[x + side, y, z + 0.25] for x, y, z in first["vertices"]]
        changed["blocks"].append(first | {"id": f"a'{side}\u00e9", "vertices": vertices, "fixed": True})
    return changed | {"seal": seal(changed)}


def python_says(text: str, file: Path) -> bool:
    file.write_text(text)
    try:
        return verify_file(file).proved
    except NotACertificateError:
        return False


def page_says(browser: Chromium, text: str) -> Answer:
    if not browser.js("typeof verifyCertificate === 'function'"):
        browser.js(CHECKER.read_text())
    answer = browser.js(f"verifyCertificate({json.dumps(text)})")
    assert answer is not None, "the checker threw"
    return answer


def test_both_prove_every_kind_with_the_same_claim(browser: Chromium, proofs, tmp_path: Path) -> None:
    for name, proof in proofs.items():
        cyclopean.write_json(tmp_path / "proof.json", proof)
        first, second = verify_file(tmp_path / "proof.json"), page_says(browser, (tmp_path / "proof.json").read_text())
        assert first.proved, (name, first.reason)
        assert second["proved"], (name, second["reason"])
        assert first.claim == second["claim"], name
        assert list(first.assumed) == [f"{what:<10} {value}" for what, value in second["assumed"]], name


def test_how_contacts_fit_and_blocks_run_into_each_other_is_told(browser: Chromium, proofs) -> None:
    """By hand; a name as Python's `ascii` writes it."""
    claim = page_says(browser, json.dumps(proofs["misfit"]))["claim"]
    assert ", contacts up to 0.001 m off the faces (faces up to 0.001 m into each other), blocks 'b01'" in claim
    assert "run into each other by 0.125 m (and 3 more pairs)" in claim
    assert "a'0.875\\xe9" in claim
    for x, digits in ((0.125, 2), (0.375, 2), (2.5, 1), (99.5, 2), (1e16, 15), (1e-5, 6), (-9.9999999, 3), (0.0, 2)):
        assert browser.js(f"rounded({x!r}, {digits})") == f"{x:.{digits}g}"


def test_both_answer_alike_of_what_was_damaged(browser: Chromium, proofs, tmp_path: Path) -> None:
    """Anything changed anywhere in any kind; some still prove something, most do not."""
    answers = []
    for name, proof in proofs.items():
        rng = np.random.default_rng([7, len(name)])
        for number in range(16):
            text = damaged(proof, rng)
            answers.append(python_says(text, tmp_path / "damaged.json"))
            assert page_says(browser, text)["proved"] is answers[-1], (name, number)
    assert 20 < sum(answers) < len(answers) - 80


def test_both_answer_alike_of_models_by_chance(browser: Chromium, tmp_path: Path) -> None:
    for number in range(12):
        rng = np.random.default_rng([11, number])
        if (proof := any_certificate(rng)) is None:
            continue
        for text in (json.dumps(proof), damaged(proof, rng)):
            assert page_says(browser, text)["proved"] is python_says(text, tmp_path / "proof.json"), number


def test_a_force_just_outside_its_cone_is_refused(browser: Chromium, proofs) -> None:
    """By hand: turned sideways by a part in 1e12 beyond friction; the joint is named, and the seal is right."""
    proof = json.loads(json.dumps(proofs["points"]))
    contact, mu = proof["contacts"][0], proof["contacts"][0]["mu"]
    n = np.array(contact["normal"]) / np.linalg.norm(contact["normal"])
    sideways = np.cross(n, [0.0, 1.0, 0.0])
    for factor, reason in ((1 + 1e-12, "outside its cone"), (1 - 1e-12, "out of balance")):
        proof["forces"][0] = [float(x) for x in 1000.0 * (n + factor * mu * sideways)]
        proof["seal"] = seal(proof)
        answer = page_says(browser, json.dumps(proof))
        assert not answer["proved"]
        assert reason in answer["reason"]
        assert answer["where"] == ({"contact": 0, "point": 0} if factor > 1 else answer["where"])


@pytest.mark.parametrize(("part", "turned"), [(1.0, False), (1.0, True), (0.6, False), (0.0, False)])
def test_a_joint_that_is_listed_twice_does_not_pull_twice(browser: Chromium, proofs, tmp_path, part, turned) -> None:
    """Each of both with its share of pull and force; `part` of the first is listed again, or goes round it twice."""
    proof = json.loads(json.dumps(proofs["tension"]))
    first, count = proof["contacts"][0], len(proof["contacts"][0]["polygon"])
    low = min(point[1] for point in first["polygon"])
    assert page_says(browser, json.dumps(proof))["proved"]
    if part:
        ring = [[x, low + part * (y - low), z] for x, y, z in first["polygon"]]
        again = (
            first | {"polygon": ring[::-1], "a": first["b"], "b": first["a"]} if turned else first | {"polygon": ring}
        )
        proof["contacts"].append(again)
        proof["forces"] += [[0.0, 0.0, 0.0]] * count
    else:
        first["polygon"] = first["polygon"] * 2
        proof["forces"][count:count] = [[0.0, 0.0, 0.0]] * count
    proof["seal"] = seal(proof)
    assert not python_says(json.dumps(proof), tmp_path / "proof.json")
    assert "would pull there twice" in verify_file(tmp_path / "proof.json").reason
    assert "would pull there twice" in page_says(browser, json.dumps(proof))["reason"]


@pytest.mark.parametrize(("half", "mu"), [(5.0, 0.2), (45.0, 1.0), (60.0, 0.5)])
def test_an_edge_on_an_edge_grips_no_more_than_about_one_normal(browser: Chromium, half, mu) -> None:
    grip = np.cos(np.radians(half)) / np.hypot(1.0, mu * np.sin(np.radians(half)))
    assert page_says(browser, json.dumps(knife(half, mu, grip * (1 - 1e-6), 0.2)[0]))["proved"]
    assert "outside its cone" in page_says(browser, json.dumps(knife(half, mu, grip * (1 + 1e-6), 0.2)[0]))["reason"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no JSON"),
        ('{"schema":"cyclopean.certificate/2","schema":"cyclopean.certificate/2"}', "twice"),
        ('{"schema":"cyclopean.certificate/1","kind":"rbe-state"}', "version"),
        ('{"schema":"cyclopean.certificate/2","kind":"__proto__"}', "kind"),
        ('{"schema":"something/2"}', "schema"),
        ("[" * 200_000, "nested too deeply"),
        ("[NaN]", "schema"),
    ],
)
def test_what_is_no_certificate_is_refused_in_one_line(browser: Chromium, text: str, reason: str) -> None:
    answer = page_says(browser, text)
    assert not answer["proved"]
    assert reason in answer["reason"]
    assert "\n" not in answer["reason"]


def test_a_report_checks_its_own_proof(browser: Chromium, tmp_path: Path) -> None:
    """From a file, off line, with the keyboard; no error is thrown, and the page grows by no more than 48 kB."""
    result = cyclopean.check(cyclopean.arch(6, span=3.0, thickness=0.5))
    text = cyclopean.report_html(result)
    write_text(tmp_path / "report.html", text)
    here = text[text.index("<style>#proof-here") : text.index('<script type="text/plain" id="certificate"')]
    assert len(here.encode()) < 48_000
    open_page(browser, tmp_path / "report.html")
    browser.js("document.querySelector('#proof-here .check').focus()")
    for kind in ("keyDown", "keyUp"):
        browser("Input.dispatchKeyEvent", type=kind, key="Enter", code="Enter", windowsVirtualKeyCode=13, text="\r")
    answered = told(browser)
    assert answered.startswith("Proved")
    assert "stable under coupled rigid-block analysis (eta = 10 eps" in answered
    assert "8, 6 of them free" in answered
    assert browser.js("window.errors") == []


def test_a_page_checks_what_is_dropped_on_it(browser: Chromium, proofs, tmp_path: Path) -> None:
    """A good file, one cut off, one that is no text, and one with hostile names: one line each, and it stays alive."""
    write_text(tmp_path / "page.html", proof_page())
    open_page(browser, tmp_path / "page.html")
    hostile = json.loads(json.dumps(proofs["rbe-state"]))
    hostile["blocks"][0]["id"] = "<img src=x onerror=errors.push(1)>"
    whole = json.dumps(proofs["rbe-state"])
    files = {
        "whole.json": (whole.encode(), "Proved"),
        "cut.json": (whole[:-99].encode(), "Not proved"),
        "binary.json": (b"\xff\xfe\x00", "cannot be read as text"),
        "<b>hostile.json": (json.dumps(hostile).encode(), "Not proved"),
        "again.json": (whole.encode(), "Proved"),
    }
    for name, (content, expected) in files.items():
        assert expected in dropped(browser, "certificate", tmp_path / name, content), name
    assert browser.js("document.querySelector('#proof-here img')") is None
    assert browser.js("window.errors") == []


def test_a_page_says_whether_the_model_is_this_one_and_shows_the_joint_that_fails(browser, tmp_path: Path) -> None:
    """The same arch, a thicker one and no model at all; then a force that leaves its cone, which is drawn."""
    write_text(tmp_path / "page.html", proof_page())
    open_page(browser, tmp_path / "page.html")
    arch, thicker = (cyclopean.arch(6, span=3.0, thickness=thickness) for thickness in (0.5, 0.51))
    proof = cyclopean.check(arch, RBE).certificate
    dropped(browser, "certificate", tmp_path / "proof.json", json.dumps(proof).encode())
    for model, expected in ((arch, "has the same blocks, contacts and loads"), (thicker, "but not of this model")):
        cyclopean.write_model(tmp_path / f"{len(expected)}.json", model)
        assert expected in dropped(browser, "model", tmp_path / f"{len(expected)}.json"), expected
    assert "block 'v01' has vertices up to 0.01" in browser.js("document.querySelector('#proof-here').innerText")
    refused = dropped(browser, "model", tmp_path / "mesh.obj", b"v 0 0 0")
    assert refused.startswith("Proved")
    assert "no JSON" in refused
    broken = json.loads(json.dumps(proof))
    broken["forces"][9] = [0.0, 0.0, -1.0]
    broken["seal"] = seal(broken)
    joint = broken["contacts"][2]
    assert f"'{joint['a']}' and '{joint['b']}', point 1: the force is outside its cone" in dropped(
        browser, "certificate", tmp_path / "broken.json", json.dumps(broken).encode()
    )
    assert browser.js("[...document.querySelectorAll('#proof-here .fails')].map(x => x.tagName)") == [
        "polygon",
        "circle",
    ]
    assert browser.js("window.errors") == []


def dropped(browser: Chromium, what: str, file: Path, content: bytes | None = None) -> str:
    """What the page answers to a file."""
    if content is not None:
        file.write_bytes(content)
    found = browser("Runtime.evaluate", expression=f"document.querySelector('#proof-here input[name={what}]')")
    browser.js("document.querySelector('#proof-here [role=status]').replaceChildren()")
    browser("DOM.setFileInputFiles", files=[str(file)], objectId=found["result"]["objectId"])
    return told(browser)


def open_page(browser: Chromium, file: Path) -> None:
    browser("Page.navigate", url=file.as_uri())
    browser.wait("document.readyState === 'complete' && !!document.getElementById('proof-here')")
    browser.js(
        "window.errors=[];addEventListener('error',e=>errors.push(String(e.message)));"
        "addEventListener('unhandledrejection',e=>errors.push(String(e.reason)))"
    )


def told(browser: Chromium) -> str:
    answer = "document.querySelector('#proof-here [role=status]')"
    browser.wait(f"{answer}.className !== '' && {answer}.textContent !== ''")
    text = browser.js(f"{answer}.innerText")
    browser.js(f"{answer}.className = ''")
    return text
