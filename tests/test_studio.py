"""The live page: its session, in a real browser, and as a command.

What must never happen: "proved" beside a word whose certificate has not passed the checker, a word of one state beside
another state, a file that replaces another.
"""

import json
import os
import queue
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from chromium import FOUND, StudioPage
from cyclopean.analysis import Settings
from cyclopean.analysis.interactive import Knobs
from cyclopean.assembly import Assembly
from cyclopean.assembly.rearranging import Pose, arrange
from cyclopean.design import arch, wall
from cyclopean.errors import InputError
from cyclopean.io import read_model, write_model
from cyclopean.proof import verify
from cyclopean.view import solids
from cyclopean.view.solids import HEAD, Layer, Layers, arrow_solids, once, wires
from cyclopean.view.studio import session as session_module
from cyclopean.view.studio.latest_value import LatestValue
from cyclopean.view.studio.live_scene import hit
from cyclopean.view.studio.painter import Painter
from cyclopean.view.studio.panel import studio
from cyclopean.view.studio.saving import claimed, save, written
from cyclopean.view.studio.session import Listener, Session, State

GRAVITY = np.array([0.0, 0.0, -9.80665])
ARCH = arch(10, span=3.0, thickness=0.4)
LONG = 25.0  # s: a machine that is busy


class Watched:
    """A session, and what it has shown."""

    def __init__(self, model, method="rbe"):
        held = np.array([block.fixed is True for block in model.blocks])
        home = arrange(model, model.contacts, held, 1e-6)
        self.shown, self.said = queue.Queue(), queue.Queue()
        assumed = {"mu": 0.84, "gravity": GRAVITY.tolist()}
        first = State(home, Knobs(), method)
        self.session = Session(first, Settings(), GRAVITY, assumed, Listener(self.shown.put, self.said.put))

    def until(self, *stages):
        """Snapshots up to the first of one of these stages."""
        found = [self.shown.get(timeout=LONG)]
        while found[-1].stage not in stages:
            found.append(self.shown.get(timeout=LONG))
        return found


@pytest.fixture(scope="module")
def watched():
    made = Watched(ARCH)
    made.until("proved")
    yield made
    made.session.close()


def settled(watched, **knobs):
    watched.session.set(Knobs(**knobs))
    last = watched.until("proved", "undecided")[-1]
    while last.state.knobs != Knobs(**knobs):
        last = watched.until("proved", "undecided")[-1]
    return last


def test_every_word_that_is_proved_has_a_certificate_of_its_own_state(watched):
    for tilt, word in ((4.0, "stable"), (50.0, "unstable"), (2.0, "stable"), (55.0, "unstable")):
        last = settled(watched, tilt=tilt)
        assert (last.word, last.result.verdict, last.proved) == (word, word, True)
        report = verify(last.result.certificate)
        assert report.proved
        gravity = np.array(last.result.certificate["gravity"])
        assert np.degrees(np.arctan2(gravity[0], -gravity[2])) == pytest.approx(tilt, abs=1e-9)


def test_what_is_assumed_goes_once_it_is_said(watched):
    assert set(settled(watched, mu=0.84).result.assumed) == {"mu", "gravity"}
    assert set(settled(watched, mu=0.7).result.assumed) == {"gravity"}
    assert set(settled(watched, mu=0.84, push=(0.01, 0.0)).result.assumed) == {"mu"}


def test_blocks_go_and_come_back_and_steps_can_be_undone(watched):
    settled(watched, tilt=0.0)
    before = watched.session.state.arrangement
    key = before.number("v05")
    watched.session.remove(key)
    gone = watched.until("proved")[-1]
    assert (gone.word, len(gone.result.assembly)) == ("unstable", len(ARCH) - 1)
    watched.session.move(key, Pose(np.eye(3), np.array([0.0, 0.3, 0.0])))
    watched.until("proved")
    watched.session.move(key, Pose(np.eye(3), np.array([0.0, 0.35, 0.0])), keep=False)
    watched.until("proved")
    assert watched.session.state.arrangement.poses.keys() == {key}
    watched.session.undo()
    assert watched.until("proved")[-1].state.arrangement.removed == {key}
    watched.session.undo()
    assert watched.until("proved")[-1].word == "stable"
    assert watched.session.state.arrangement is before
    watched.session.undo()
    assert watched.said.get(timeout=LONG) == "there is nothing to undo"


def test_what_cannot_be_done_is_said(watched):
    springers = np.flatnonzero(watched.session.state.arrangement.held).tolist()
    watched.session.remove(springers[0])
    watched.until("proved")
    watched.session.remove(springers[1])
    assert "the last support" in watched.said.get(timeout=LONG)
    watched.session.undo()
    assert watched.until("proved")[-1].word == "stable"


def test_provisional_is_what_a_slow_proof_makes_it(monkeypatch):
    monkeypatch.setattr(session_module, "PROMPT", -1.0)
    slow = Watched(ARCH, "cra")
    try:
        first = slow.until("proved")
        assert [s.stage for s in first] == ["provisional", "proved"]
        assert not first[0].proved
        assert first[0].result.certificate is None
        assert "decided at rest" in first[0].sentence
        assert first[-1].result.certificate["kind"] == "cra-state"
        slow.session.set(Knobs(tilt=50.0))
        falls = slow.until("proved")
        assert [(s.word, s.stage) for s in falls] == [("unstable", "provisional"), ("unstable", "proved")]
        for kind in ("report", "certificate"):
            with pytest.raises(InputError, match="provisional"):
                written(kind, falls[0])
    finally:
        slow.session.close()


def test_changes_that_come_at_once_are_answered_once():
    many = Watched(wall(8, 8))
    try:
        many.until("proved")
        for k in range(200):
            many.session.set(Knobs(tilt=0.02 * k))
        shown = many.until("proved")
        while shown[-1].state.knobs.tilt != pytest.approx(3.98):
            shown += many.until("proved")
        assert len(shown) < 60
    finally:
        many.session.close()


def test_saved_files_say_what_the_page_says_and_replace_nothing(watched, tmp_path):
    last = settled(watched, mu=0.6, tilt=3.0)
    path, content = save("certificate", last, tmp_path, "arch")
    assert path.name == "arch.studio.certificate.json"
    assert path.read_bytes() == content
    assert verify(json.loads(content)).proved
    model, _ = save("model", last, tmp_path, "arch")
    again, _ = save("model", last, tmp_path, "arch")
    assert (model.name, again.name) == ("arch.studio.json", "arch.studio-2.json")
    read, warnings = read_model(model)
    assert warnings == ()
    assert set(read.contacts.mu.tolist()) == {0.6}
    assert [b.fixed for b in read.blocks] == [bool(b.fixed) for b in ARCH.blocks]
    report, _ = save("report", last, tmp_path, "arch")
    assert "Stands" in report.read_text()
    (tmp_path / "x.studio.html").symlink_to("nowhere")
    assert claimed(tmp_path, "x", ".html").name == "x.studio-2.html"
    with pytest.raises(InputError, match="does not exist"):
        save("model", last, tmp_path / "nowhere", "arch")


def test_a_ray_meets_the_nearest_triangle():
    rng = np.random.default_rng(4)
    triangle = rng.normal(size=(200, 3, 3))
    origin, direction = np.array([0.0, 0.0, 9.0]), np.array([0.05, 0.02, -1.0])
    depth = []
    for a, b, c in triangle:
        u, v, t = np.linalg.solve(np.stack([b - a, c - a, -direction], 1), origin - a)
        depth.append(t if min(u, v, 1 - u - v) >= 0 and t > 0 else np.inf)
    assert hit(triangle, origin, direction) == int(np.argmin(depth))
    assert hit(triangle, origin, np.array([0.0, 0.0, 1.0])) is None


def test_an_arrow_has_the_volume_of_a_prism_and_a_pyramid():
    """By hand: an octagon of radius r has area 2 sqrt(2) r2; from the middle of the neck, where the shaft is open."""
    r, head = 0.02, solids.LONG * 0.02
    layer = arrow_solids(np.array([[[0.0, 0, 0], [0, 0, 1]]]), np.asarray, "a", "#000000", r)
    triangle = layer.vertex.astype(float)[layer.face] - [0.0, 0.0, 1.0 - head]
    volume = np.linalg.det(triangle).sum() / 6.0
    area = 2.0 * np.sqrt(2.0) * r**2
    assert volume == pytest.approx(area * (1.0 - head) + HEAD**2 * area * head / 3.0, rel=1e-5)


def test_arrows_and_wires_go_from_end_to_end():
    rng = np.random.default_rng(5)
    arrow = rng.normal(size=(300, 2, 3))
    layer = arrow_solids(arrow, np.asarray, "a", "#000000", 1e-3)
    corner = layer.vertex.reshape(300, -1, 3)
    foot, tip = corner[:, :3].mean(axis=1), corner[:, -1]
    assert np.allclose(np.stack([foot, tip], 1), arrow, atol=1e-6)
    along = arrow[:, 1] - arrow[:, 0]
    away = np.linalg.norm(np.cross(corner - arrow[:, :1], along[:, None]), axis=2)
    assert np.all(away <= HEAD * 1.001e-3 * np.linalg.norm(along, axis=1)[:, None] + 1e-6)
    sun = np.array([[[0.0, 0, 0], [-3, -6, 8]]])
    for segment in (arrow, sun, arrow[:0]):
        wire = wires(segment, np.asarray, "w", "#000000")
        three = wire.vertex[wire.face]
        assert np.allclose(three[:, :2], segment, atol=1e-6)
        assert np.allclose(three[:, 2], segment[:, 0], atol=1e-4)
        assert np.all(np.linalg.norm(np.cross(three[:, 1] - three[:, 0], three[:, 2] - three[:, 0]), axis=1) > 0.0)


def test_edges_that_lie_on_each_other_are_drawn_once():
    rng = np.random.default_rng(6)
    edge = rng.integers(-5, 6, size=(400, 2, 3)) / 8.0
    edge = edge[np.any(edge[:, 0] != edge[:, 1], axis=1)]
    both = np.concatenate([edge, edge[::-1, ::-1]])
    kept = once(both, 1e-6)

    def named(some):
        return [frozenset(map(tuple, ends)) for ends in some.tolist()]

    assert set(named(kept)) == set(named(edge))
    assert len(kept) == len(set(named(edge)))


class Recorded:
    """Stands for a scene and its meshes: what is sent to them."""

    def __init__(self):
        object.__setattr__(self, "sent", [])

    def add_mesh_simple(self, name, *_, **__):
        self.sent.append(("mesh", name))
        return self

    def __setattr__(self, name, value):
        self.sent.append((name, value if name in ("visible", "opacity") else len(value)))

    def take(self):
        found = self.sent[:]
        self.sent.clear()
        return found


def test_only_what_has_changed_is_sent():
    scene = Recorded()
    layers = Layers(scene)
    vertex, face = np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.uint32)
    layers.put(Layer("a", vertex, face[:0], "#000000"))
    assert scene.take() == []
    layers.put(Layer("a", vertex, face, "#000000"))
    assert scene.take() == [("mesh", "a")]
    layers.put(Layer("a", vertex.copy(), face.copy(), "#000000"))
    assert {name for name, _ in scene.take()} <= {
        "opacity",
        "visible",
    }  # viser itself sends these only when they change
    layers.put(Layer("a", 2.0 * vertex, face, "#000000"))
    assert ("vertices", 3) in (sent := scene.take())
    assert "faces" not in dict(sent)
    layers.put(Layer("a", 2.0 * vertex, face := np.repeat(face, 2, 0), "#000000"))
    assert ("faces", 2) in (sent := scene.take())
    assert "vertices" not in dict(sent)
    layers.put(Layer("a", vertex[:0], face[:0], "#000000"))
    assert scene.take() == [("visible", False)]
    layers.put(Layer("a", 2.0 * vertex, face, "#000000", 0.5))
    assert scene.take() == [("opacity", 0.5), ("visible", True)]


def test_the_box_holds_the_newest_and_nothing_once_all_has_ended():
    box = LatestValue()
    assert box.take(0.0) is None
    box.put(1)
    box.put(2)
    assert box.waiting
    assert box.take() == 2
    assert box.take(0.0) is None
    box.put(3)
    box.end()
    assert box.take() is None


def test_the_painter_leaves_out_what_is_outdated():
    class Slow:
        moves, size = False, 1

        def __init__(self):
            self.drawn, self.began, self.go = [], threading.Event(), threading.Event()

        def show(self, snapshot):
            self.drawn.append(snapshot)
            self.began.set()
            assert self.go.wait(LONG)

    stage = Slow()
    painter = Painter(stage, lambda: False)
    painter.show(1)
    assert stage.began.wait(LONG)
    stage.began.clear()
    for k in (2, 3, 4):
        painter.show(k)
    stage.go.set()
    assert stage.began.wait(LONG)
    painter.close()
    assert stage.drawn == [1, 4]


def test_models_that_cannot_be_analysed_are_refused(tmp_path):
    with (
        pytest.raises(InputError, match="the model has no blocks"),
        studio(Assembly(()), Settings(), folder=tmp_path),
    ):
        pass


needs_browser = pytest.mark.skipif(FOUND is None, reason="no chromium on this machine")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("studio")
    with (
        studio(ARCH, Settings(method="rbe"), folder=folder, stem="arch") as served,
        StudioPage(served.address, 1100, 900) as browser,
    ):
        browser.ready(LONG)
        browser.folder_of_files = folder
        browser.session = served.session
        yield browser


def waited(browser, word):
    """Until the page is settled on this word."""
    browser.wait(f"document.getElementById('word').innerText==='{word}'", LONG)
    browser.settled(LONG)


@needs_browser
def test_a_slider_turns_the_verdict(page):
    assert (page.word, page.worth) == ("Stable", "proved: its certificate has passed the checker")
    page.slide(StudioPage.TILT, 0.8)
    waited(page, word="Unstable")
    assert page.worth.startswith("proved")
    assert re.search(r"tilt 4[78]\.?\d?° towards 0°", page.holds_for)
    assert "collapse mechanism" in page.text
    page.press("Level, no push")
    waited(page, word="Stable")
    assert "tilt 0°" in page.holds_for


@needs_browser
def test_how_far_it_is_from_falling_is_told_at_rest(page):
    page.press("Level, no push")
    waited(page, word="Stable")
    page.wait("(document.getElementById('reach')?.innerText||'').includes('falls at')", LONG)
    said = page.js("document.getElementById('reach').innerText")
    tilt, push = (float(x) for x in re.search(r"tilt of ([\d.]+)° towards 0°, .* of ([\d.]+) of the", said).groups())
    assert np.tan(np.radians(tilt)) == pytest.approx(push, rel=5e-3)  # all loads are weights: tilt is a push
    assert push == pytest.approx(0.381, abs=5e-4)


@needs_browser
def test_a_block_is_clicked_removed_and_put_back(page):
    page.press("Level, no push")
    waited(page, word="Stable")
    page.click(397, 308)  # about the crown
    page.wait("!!document.getElementById('block')", LONG)
    about = page.js("document.getElementById('block').innerText")
    assert re.search(r"^v0\d", about)
    assert re.search(r"weight: [\d.]+ kN", about)
    assert re.search(r"contacts: 2 with v0\d, v0\d", about)
    assert re.search(r"friction used: \d+ %", about)
    page.press("Remove")
    waited(page, word="Unstable")
    page.wait("document.getElementById('for').innerText.includes('1 taken out')", LONG)
    page.wait("document.body.innerText.includes('is taken out')", LONG)
    page.press("Put back")
    waited(page, word="Stable")
    page.press("Undo")
    waited(page, word="Unstable")
    page.press("Undo")
    waited(page, word="Stable")


@needs_browser
def test_a_block_is_dragged_by_its_handle(page):
    page.name("v05")
    page.wait("(document.getElementById('block')?.innerText||'').startsWith('v05')", LONG)
    page.tick("drag it by a handle")
    time.sleep(1.0)  # the handle is drawn
    page.drag((345, 225), (345, 140), steps=8, pause=0.05)  # its upward arrow
    page.wait("document.getElementById('for').innerText.includes('1 moved')", LONG)
    assert page.session.state.arrangement.poses.keys() == {page.session.state.arrangement.number("v05")}
    (pose,) = page.session.state.arrangement.poses.values()
    assert pose.shift[2] > 0.1
    assert np.abs(pose.shift[:2]).max() < 1e-6
    page.settled(LONG)
    page.tick("drag it by a handle")
    page.press("Put back")
    waited(page, word="Stable")


@needs_browser
def test_the_words_do_not_wait_for_the_drawing(page, monkeypatch):
    page.press("Level, no push")
    waited(page, word="Stable")
    stage, go = page.session._show.__self__._scene, threading.Event()
    show = stage.show
    monkeypatch.setattr(stage, "show", lambda snapshot: (go.wait(LONG), show(snapshot)))
    try:
        page.slide(StudioPage.TILT, 0.8)
        waited(page, word="Unstable")
        assert not stage.moves
    finally:
        go.set()
    began = time.monotonic()
    while not stage.moves:
        assert time.monotonic() - began < LONG
        time.sleep(0.05)


@needs_browser
def test_a_click_beside_the_blocks_chooses_none(page):
    page.press("Level, no push")
    waited(page, word="Stable")
    page.name("v05")
    page.wait("(document.getElementById('block')?.innerText||'').startsWith('v05')", LONG)
    page.click(60, 850)
    time.sleep(0.5)
    assert page.js("document.getElementById('block').innerText").startswith("v05")


@needs_browser
def test_the_page_saves(page):
    page.press("Level, no push")
    waited(page, word="Stable")
    for kind, name in (("model", "arch.studio.json"), ("certificate", "arch.studio.certificate.json")):
        page.press(f"Save {kind}")
        page.wait(f"document.body.innerText.includes('Saved {name}')", LONG)
        assert (page.folder_of_files / name).is_file()
    assert verify(json.loads((page.folder_of_files / "arch.studio.certificate.json").read_text())).proved


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "arch.json"
    write_model(path, ARCH)
    return path


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--port", "0"], "--port 0: expected a whole number from 1 to 65535"),
        (["--port", "x"], "--port"),
        (["--out", "nowhere"], "--out nowhere: no such folder"),
        (["--host", "not a host"], "--host not a host: cannot listen there"),
        (["--host", "203.0.113.7"], "--host 203.0.113.7: cannot listen there"),
        (["--mu", "-1"], "--mu"),
        (["--supports", "ids=zz"], "zz"),
    ],
)
def test_bad_options_are_one_line_and_status_2(run, model, options, said):
    status, out, err = run("studio", model, "--no-browser", *options)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert said in err


def test_a_port_in_use_is_refused(run, model):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        status, _, err = run("studio", model, "--no-browser", "--port", port)
    assert status == 2
    assert f"--port {port}: cannot listen there" in err


def test_files_without_blocks_are_refused(run, tmp_path):
    (tmp_path / "empty.json").write_text('{"schema": "cyclopean.model/1", "units": "m", "blocks": []}')
    status, _, err = run("studio", "empty.json", "--no-browser")
    assert status == 2
    assert "has no blocks" in err


@pytest.mark.skipif(os.name != "posix", reason="interrupts are sent differently elsewhere")
def test_ctrl_c_ends_it_well_and_other_hosts_are_warned_of(model):
    command = [sys.executable, "-m", "cyclopean", "studio", str(model), "--no-browser", "--host", "0.0.0.0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    guard = threading.Timer(LONG, process.kill)
    guard.start()
    line = process.stdout.readline()
    port = int(re.search(r"http://127.0.0.1:(\d+)/\?token=[\w-]{32} ", line)[1])
    with socket.create_connection(("127.0.0.1", port), timeout=5):
        pass
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=LONG)
    guard.cancel()
    assert process.returncode == 0
    assert out.strip() == ""
    assert err.count("\n") == 1
    assert "whoever sees the address can use the page" in err


def test_snapshots_of_other_states_are_not_proofs_of_this_one(watched):
    """A proof that comes late is dropped."""
    last = settled(watched, tilt=1.0)
    late = replace(last.result, verdict="unstable")
    watched.session._todo.put(lambda: watched.session._answered(last.ticket - 1, late))
    watched.session.set(Knobs(tilt=1.5))
    shown = watched.until("proved")
    while shown[-1].state.knobs.tilt != 1.5:
        shown += watched.until("proved")
    assert {s.word for s in shown} == {"stable"}
