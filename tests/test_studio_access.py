"""Who may reach the live page, and what a client may do to it; over real sockets.

What must never happen: a page of another origin that reads or turns the model, a client that ends the page for the
others, two clients that are told the same name for what they saved.
"""

import functools
import http.client
import http.server
import json
import logging
import math
import os
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from urllib.parse import urlsplit

import msgspec
import numpy as np
import pytest
from websockets.exceptions import InvalidStatus

from cyclopean.analysis import Settings
from cyclopean.analysis.interactive import Knobs
from cyclopean.design import arch
from cyclopean.errors import InputError
from cyclopean.io import write_model
from cyclopean.view import access
from cyclopean.view.access import LARGEST, LINES, AccessControl, authorities, refusal
from cyclopean.view.layers import server, silent
from cyclopean.view.messages import FAR, LONGEST
from cyclopean.view.rate_limit import RateLimit
from cyclopean.view.studio import saving
from cyclopean.view.studio.panel import AT_ONCE, studio
from cyclopean.view.studio.saving import claimed
from studio_client import PATIENCE, StudioClient

ARCH = arch(10, span=3.0, thickness=0.4)
PAGE = "192.0.2.7:8080"
ALLOWED = authorities("0.0.0.0", "192.0.2.7", 8080)


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    folder = tmp_path_factory.mktemp("saved")
    with ExitStack() as stack:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(access, "LINES", 10**6)  # each test looks for its own
            page = stack.enter_context(studio(ARCH, Settings(method="rbe"), folder=folder, stem="arch"))
        yield page


@pytest.fixture
def client(served):
    with StudioClient(served.address) as one:
        yield one


def turned(client, tilt):
    """Turn the page to a tilt, and wait until it says so: it lives."""
    client.set("Tilt, degrees", tilt)
    client.until(f"tilt {tilt:g}° towards")


def asked(address, path=None, **headers):
    """Status, headers and body of a request; a header may have several values, and None is none."""
    parts = urlsplit(address)
    line = http.client.HTTPConnection(parts.netloc, timeout=PATIENCE)
    line.putrequest("GET", f"{parts.path}?{parts.query}" if path is None else path, skip_host=True)
    for name, values in {"Host": parts.netloc, **headers}.items():
        for value in [values] if isinstance(values, str) else values:
            line.putheader(name.replace("_", "-"), value)
    line.endheaders()
    with closing(line):
        answer = line.getresponse()
        return answer.status, answer.headers, answer.read().decode()


# ---------------------------------------------------------------------- who gets in


@pytest.mark.parametrize(
    ("hosts", "origins", "tokens", "why"),
    [
        ([PAGE], [], ["t"], ""),
        (["localhost:8080"], ["http://localhost:8080"], ["t"], ""),
        (["LocalHost:8080"], ["http://127.0.0.1:8080", f"http://{PAGE}"], ["t"], ""),
        (["[::1]:8080"], ["http://[::1]:8080"], ["t"], ""),
        ([], [], ["t"], "this name"),
        (["evil.example:8080"], [], ["t"], "this name"),
        (["192.0.2.7"], [], ["t"], "this name"),
        (["0.0.0.0:8080"], [], ["t"], "this name"),
        (["192.0.2.7:8081"], [], ["t"], "this name"),
        ([PAGE, "evil.example"], [], ["t"], "this name"),
        ([PAGE], ["http://evil.example"], ["t"], "another origin"),
        ([PAGE], ["http://192.0.2.7:8081"], ["t"], "another origin"),
        ([PAGE], [f"https://{PAGE}"], ["t"], "another origin"),
        ([PAGE], ["null"], ["t"], "another origin"),
        ([PAGE], [f"http://{PAGE}", "http://evil.example"], ["t"], "another origin"),
        ([PAGE], [f"http://{PAGE}, http://evil.example"], ["t"], "another origin"),
        ([PAGE], [], [], "the token"),
        ([PAGE], [], ["u"], "the token"),
        ([PAGE], [], ["tt"], "the token"),
        ([PAGE], [], ["é\udc80"], "the token"),
        ([PAGE], [], ["t", "t"], "the token"),
    ],
)
def test_a_refusal_says_why(hosts, origins, tokens, why):
    said = refusal(hosts, origins, tokens, ALLOWED, "t")
    assert why in said
    assert bool(said) is bool(why)


def test_a_port_that_browsers_leave_out_may_be_left_out():
    assert "localhost" in authorities("127.0.0.1", "127.0.0.1", 80)
    assert "localhost" not in authorities("127.0.0.1", "127.0.0.1", 8080)
    assert "wall.example:8080" in authorities("Wall.Example", "192.0.2.7", 8080)


def test_the_address_opens_the_page_and_no_other_does(served):
    status, headers, _ = asked(served.address)
    assert status == 302
    status, headers, body = asked(served.address, headers["Location"])
    assert (status, headers["Referrer-Policy"], headers["Cache-Control"]) == (200, "no-referrer", "no-store")
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert "<!doctype html>" in body[:100].lower()
    token = urlsplit(served.address).query
    wrong = [
        asked(served.address, "/"),
        asked(served.address, "/index.html"),
        asked(served.address, "/nowhere"),
        asked(served.address, "/?token=x"),
        asked(served.address, "/?token=%ff%00"),
        asked(served.address, f"/?{token}&{token}"),
        asked(served.address, Host="evil.example"),
        asked(served.address, Origin="http://evil.example"),
        asked(served.address, Origin=["http://" + urlsplit(served.address).netloc, "http://evil.example"]),
    ]
    assert {status for status, _, _ in wrong} == {403}
    assert all(body.count("\n") == 1 and len(body) < 100 for _, _, body in wrong)


def test_the_page_is_never_sent_to_another_websocket(served):
    token = urlsplit(served.address).query
    status, headers, _ = asked(served.address, f"/?{token}&websocket=ws://evil.example/")
    assert status == 302
    assert "evil" not in headers["Location"]


@pytest.mark.parametrize("others", [{"Origin": "http://evil.example"}, {"Host": "evil.example"}, {"query": "token=x"}])
def test_a_websocket_is_refused_before_it_is_one(served, others):
    upgrade = {
        "Connection": "Upgrade", "Upgrade": "websocket", "Sec_WebSocket_Version": "13",
        "Sec_WebSocket_Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    }  # fmt: skip
    path = f"/?{others.pop('query')}" if "query" in others else None
    own = urlsplit(served.address).netloc
    origins = {"Origin": [f"http://{own}", others["Origin"]]} if "Origin" in others else {}
    status, _, body = asked(served.address, path, **{**upgrade, **others, **origins})
    assert status == 403
    assert body.count("\n") == 1


@pytest.mark.skipif(sys.platform != "linux", reason="127.0.0.2 is an address of the machine on Linux only")
def test_on_all_addresses_the_one_that_was_used_is_a_name(tmp_path):
    with studio(ARCH, Settings(method="rbe"), folder=tmp_path, address=("0.0.0.0", 0)) as served:
        assert asked(served.address)[0] == 302
        assert asked(served.address.replace("127.0.0.1", "127.0.0.2"))[0] == 302
        assert asked(served.address, Host=urlsplit(served.address.replace("127.0.0.1", "127.0.0.2")).netloc)[0] == 403


def test_the_server_of_a_static_page_lets_nobody_in():
    """A static page has a server for a moment, which nobody needs to reach."""
    with silent(), server() as running:
        assert asked(f"http://127.0.0.1:{running.get_port()}/")[0] == 403


def test_a_viser_that_makes_its_server_otherwise_is_not_served():
    stopped = []

    class Other:
        def stop(self):
            stopped.append(self)

    with pytest.raises(RuntimeError, match="without access control"):
        AccessControl("127.0.0.1").guarded(Other)
    assert len(stopped) == 1


def test_more_pages_than_there_may_be_are_refused(served, monkeypatch):
    monkeypatch.setattr(access, "CLIENTS", 0)
    with pytest.raises(InvalidStatus, match="503"):
        StudioClient(served.address)


# ---------------------------------------------------------------------- what a client may send

DEEP = b"\x82\xa1a" + b"\x91" * (LARGEST - 20) + b"\xc0\xa4type\xa1x"
MOVED = {"type": "TransformControlsUpdateMessage", "name": "/handle", "wxyz": [1, 0, 0, 0], "position": [0, 0, 0]}
CLICK = {
    "type": "ScenePointerMessage", "event_type": "click", "ray_origin": [0, 0, 9], "ray_direction": [0, 0, -1],
    "screen_pos": [[0.5, 0.5]], "modifier": None,
}  # fmt: skip


def packed(message, **others):
    return msgspec.msgpack.encode({**message, **others})


@pytest.mark.parametrize(
    "raw",
    [
        "text", "", b"", b"\xc1", b"\xdd\xff\xff\xff\xff", DEEP, bytes(range(256)), b"x" * (LARGEST + 1),
        packed({"type": "ShareUrlRequest"}), packed({"type": "NoSuchMessage"}), packed({}),
        packed(MOVED, more=1), packed(MOVED, wxyz=[1, 0, 0]), packed(MOVED, position="far"),
        packed(MOVED, name="x" * 999),
        packed(CLICK, ray_origin=None), packed(CLICK, screen_pos=[]), packed(CLICK, event_type="rect-select"),
        packed({"type": "GuiUpdateMessage", "uuid": "x", "updates": {}}),
        packed({"type": "GuiUpdateMessage", "uuid": "x", "updates": {"removed": True}}),
        packed({"type": "GuiUpdateMessage", "uuid": "x", "updates": {"value": [[]]}}),
        packed({"type": "FileTransferStartUpload", "source_component_uuid": "x"}),
    ],
    ids=lambda raw: repr(raw[:40]),
)  # fmt: skip
def test_rubbish_ends_the_line_of_its_sender_only(served, client, caplog, capfd, raw):
    with StudioClient(served.address) as bad, caplog.at_level(logging.WARNING):
        bad.line.send(raw)
        assert bad.ended() == (1009 if len(raw) > LARGEST else 1008)
        turned(client, 1.0)
        turned(client, 2.0)
    assert [record.name for record in caplog.records] == ["cyclopean.view"]
    assert "Traceback" not in caplog.text + "".join(capfd.readouterr())


@pytest.mark.parametrize(
    ("label", "value"),
    [
        ("Method", "../../x"), ("Method", ""), ("Method", 1), ("Method", True),
        *[("Friction mu", x) for x in (float("nan"), float("inf"), -0.01, 1e9, "0.5", True)],
        *[("Tilt, degrees", x) for x in (float("nan"), -1e-9, 60.1, False)],
        ("forces", 1), ("forces", "yes"), ("Name", 7), ("Name", "x" * (LONGEST + 1)), ("Save model", "x"),
        ("Change", "Explode"),
    ],
)  # fmt: skip
def test_values_that_an_element_cannot_have_are_left_out(served, client, label, value):
    page = served.session._show.__self__
    element = page._gui._gui_input_handle_from_uuid[client.elements[label]]
    turned(client, 3.0)
    before, was, saved = served.session.state, element.value, os.listdir(page._folder)
    client.set(label, value)
    turned(client, 4.0)  # the page goes on, for the sender too
    assert (served.session.state.method, served.session.state.knobs.mu) == (before.method, before.knobs.mu)
    assert element.value == (4.0 if label == "Tilt, degrees" else was)
    assert os.listdir(page._folder) == saved


@pytest.mark.parametrize(
    "message",
    [
        {**MOVED, "wxyz": [0, 0, 0, 0]},
        {**MOVED, "wxyz": [float("nan"), 0, 0, 0]},
        {**MOVED, "position": [1e300, 0, 0]},
        {**MOVED, "position": [0, float("inf"), 0]},
        {**CLICK, "ray_direction": [float("nan")] * 3},
        {**CLICK, "ray_origin": [0, 0, 2 * FAR]},
        {"type": "GuiUpdateMessage", "uuid": "x", "updates": {"value": 1}},
    ],
)
def test_places_that_are_none_are_left_out(served, client, capfd, message):
    client.set("Name", "v05")
    client.nodes.discard("/handle")  # of the test before
    client.set("drag it by a handle", True)
    client.wait(lambda: "/handle" in client.nodes, "a handle")
    drag = {"type": "TransformControlsDragStartMessage", "name": "/handle"}
    client.send(drag)
    client.send({**MOVED, "position": [0.0, 0.0, 2.0]})
    client.wait(lambda: served.session.state.arrangement.poses, "the block where it was put")
    poses = served.session.state.arrangement.poses
    client.send(message)
    client.send({**drag, "type": "TransformControlsDragEndMessage"})
    turned(client, 5.0)
    turned(client, 6.0)
    left = served.session.state.arrangement.poses
    client.set("Name", "v05")
    client.set("Change", "Put back")
    client.set("drag it by a handle", False)
    client.wait(lambda: not served.session.state.arrangement.poses, "the block in its place")
    assert left == poses
    assert client.notices.empty()
    assert "Traceback" not in "".join(capfd.readouterr())


def test_the_log_stays_short(caplog):
    control = AccessControl("127.0.0.1")
    control._lines.seconds = math.inf
    for _ in range(10 * LINES):
        control._note("refused")
    assert len(caplog.records) == LINES


def test_the_session_outlives_what_it_cannot_do(served, client):
    """Were such a value to get there: the word is refused, and the page goes on."""
    method = served.session.state.method
    served.session.set(method="../../x")
    served.session._todo.put(lambda: np.linalg.inv(np.zeros((2, 2))))
    served.session._todo.put(lambda: 1 / 0)
    served.session.set(Knobs(tilt=7.0))
    client.until("tilt 7° towards")
    assert served.session.state.method == method


# ---------------------------------------------------------------------- what is saved


def test_names_are_claimed_by_one_each(tmp_path):
    with ThreadPoolExecutor(8) as pool:
        names = list(pool.map(lambda _: claimed(tmp_path, "arch", ".json").name, range(200)))
    assert len(set(names)) == 200
    assert set(names) == set(os.listdir(tmp_path))


def test_a_stem_does_not_lead_out_of_the_folder(tmp_path):
    for stem in ("../x", "a/b", "/x"):
        with (
            pytest.raises(InputError, match="without a folder"),
            studio(ARCH, Settings(), folder=tmp_path, stem=stem),
        ):
            pass


def test_saves_of_many_clients_are_files_of_their_own_and_limited(tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    with studio(ARCH, Settings(method="rbe"), folder=folder, stem="arch") as served:
        served.session._show.__self__._saves.seconds = math.inf  # however long this machine takes for them
        clients = [StudioClient(served.address) for _ in range(8)]
        clients[0].until("proved: its")
        for _ in range(5):
            for one in clients:
                one.set("Save model", True)
        told = [[one.notices.get(timeout=PATIENCE) for _ in range(5)] for one in clients]
        for one in clients:
            one.__exit__()
        text = "".join(map(str, (*told, *clients[0].html.values())))
    said = [title for own in told for title, _ in own]
    saved = [title.removeprefix("Saved ") for title in said if title != "Not done"]
    assert len(saved) == len(set(saved)) == AT_ONCE
    assert set(saved) == set(os.listdir(folder))
    assert said.count("Not done") == 40 - AT_ONCE
    assert "within a minute; wait a little" in text
    assert str(tmp_path) not in text  # clients are not told where the folder is
    assert "'results'" in text


def test_a_folder_that_went_is_told_without_its_path(tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    with (
        studio(ARCH, Settings(method="rbe"), folder=folder, stem="arch") as served,
        StudioClient(served.address) as client,
    ):
        client.until("proved: its")
        folder.rmdir()
        client.set("Save model", True)
        assert client.notices.get(timeout=PATIENCE) == ("Not done", "the folder does not exist any more; make it again")


def test_files_in_all_are_limited_and_one_that_cannot_be_written_leaves_nothing(tmp_path, monkeypatch):
    def full(path, text):
        raise InputError(f"{path}: cannot be written (no space left on device)")

    with (
        studio(ARCH, Settings(method="rbe"), folder=tmp_path, stem="arch") as served,
        StudioClient(served.address) as client,
    ):
        client.until("proved: its")
        served.session._show.__self__._in_all = RateLimit(1, math.inf)
        with monkeypatch.context() as patch:
            patch.setattr(saving, "write_text", full)
            client.set("Save model", True)
            told = client.notices.get(timeout=PATIENCE)
        assert told == ("Not done", "arch.studio.json: cannot be written (no space left on device)")
        assert os.listdir(tmp_path) == []
        client.set("Save model", True)
        assert "were saved already" in client.notices.get(timeout=PATIENCE)[1]


# ---------------------------------------------------------------------- a browser, and many clients

EVIL = """<!doctype html><script>
const open = address => new Promise(done => {
  const line = new WebSocket(address, ['viser-v%s']);
  line.onopen = () => done('open'); line.onerror = () => done('refused');
});
const read = address => fetch(address).then(answer => 'read ' + answer.status, () => 'refused');
window.attack = async (place, token) => [
  await open(`ws://${place}/`), await open(`ws://${place}/?${token}`), await read(`http://${place}/?${token}`)];
</script>"""


def test_a_page_of_another_origin_gets_nothing_in_a_browser(served, browser, tmp_path):
    """Not even where it knows the token, as from a picture of the screen."""
    import viser

    (tmp_path / "index.html").write_text(EVIL % viser.__version__)

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    other = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(tmp_path)))
    thread = threading.Thread(target=other.serve_forever, daemon=True)
    thread.start()
    parts = urlsplit(served.address)
    try:
        browser("Page.navigate", url=f"http://127.0.0.1:{other.server_port}/")
        browser.wait("!!window.attack", PATIENCE)
        tried = f"attack({json.dumps(parts.netloc)}, {json.dumps(parts.query)})"
        assert browser.js(tried) == ["refused"] * 3
        browser("Page.navigate", url=served.address)
        browser.wait("(document.getElementById('word')?.innerText||'').length>0", PATIENCE)
    finally:
        other.shutdown()
        other.server_close()
        thread.join()


def resident(pid):
    """MB that a process has in memory."""
    with open(f"/proc/{pid}/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="memory is told otherwise elsewhere")
def test_many_moves_of_many_clients_take_no_memory(tmp_path):
    """Eight clients; CYCLOPEAN_MOVES=1000 is the full size."""
    moves = int(os.environ.get("CYCLOPEAN_MOVES", "20"))
    write_model(tmp_path / "arch.json", ARCH)
    command = [sys.executable, "-m", "cyclopean", "studio", str(tmp_path / "arch.json"), "--no-browser"]
    with subprocess.Popen([*command, "--method", "rbe"], stdout=subprocess.PIPE, text=True) as process:
        guard = threading.Timer(10 * PATIENCE, process.kill)
        guard.start()
        try:
            address = process.stdout.readline().split()[0]
            clients = [StudioClient(address) for _ in range(8)]
            clients[0].until("proved: its")

            def after(end):
                for k in range(moves):
                    for one in clients:
                        one.set("Tilt, degrees", round(0.1 + 0.1 * (k % 50), 1))
                    time.sleep(0.005)  # s, as sliders do: nothing waits for this
                for one in clients:  # all of them: whose last message comes last is not known
                    one.set("Tilt, degrees", end)
                for one in clients:
                    one.until(f"tilt {end}° towards")
                return resident(process.pid)

            first, last = after(9.5), after(9.6)  # what is loaded once counts in the first
            print(f"{moves} moves of 8 clients: {first:.1f} MB, {last:.1f} MB")
            assert last - first < 10.0
            for one in clients:
                one.__exit__()
        finally:
            guard.cancel()
            process.terminate()
