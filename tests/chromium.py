"""A real headless Chromium, driven through its DevTools protocol; shared by tests and benchmarks of pages."""

import base64
import json
import os
import re
import shutil
import subprocess
import tempfile
import time
import urllib.request

from websockets.sync.client import connect

FOUND = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)
FLAGS = (
    "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--hide-scrollbars", "--no-first-run", "--disable-extensions", "--remote-debugging-port=0",
)  # fmt: skip


class Chromium:
    """One page; use as a context manager."""

    def __init__(self, address: str, width: int = 1400, height: int = 1000) -> None:
        assert FOUND is not None
        self.folder = tempfile.mkdtemp(prefix="chromium-")
        self.log = os.path.join(self.folder, "log")
        with open(self.log, "w") as log:
            self.process = subprocess.Popen(
                [FOUND, *FLAGS, f"--window-size={width},{height}", f"--user-data-dir={self.folder}", "about:blank"],
                stdout=subprocess.DEVNULL, stderr=log,
            )  # fmt: skip
        self.number = 0
        port = self._port()
        tabs = json.load(urllib.request.urlopen(f"http://127.0.0.1:{port}/json"))
        self.line = connect(next(t for t in tabs if t["type"] == "page")["webSocketDebuggerUrl"], max_size=None)
        self("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self("Page.navigate", url=address)

    def _port(self) -> str:
        for _ in range(300):
            with open(self.log) as log:
                if found := re.search(r"DevTools listening on ws://127.0.0.1:(\d+)/", log.read()):
                    return found[1]
            time.sleep(0.1)
        raise TimeoutError("chromium did not start")

    def __enter__(self) -> "Chromium":
        return self

    def __exit__(self, *_: object) -> None:
        self.line.close()
        self.process.terminate()
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def __call__(self, method: str, **options):
        self.number += 1
        self.line.send(json.dumps({"id": self.number, "method": method, "params": options}))
        while True:
            answer = json.loads(self.line.recv(timeout=60))
            if answer.get("id") == self.number:
                assert "error" not in answer, answer
                return answer["result"]

    def js(self, expression: str):
        """Value of an expression in the page; None where it throws."""
        answer = self("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        return None if "exceptionDetails" in answer else answer["result"].get("value")

    def wait(self, expression: str, seconds: float = 30.0):
        """Wait until an expression is true, and return its value."""
        began = time.monotonic()
        while not (value := self.js(expression)):
            if time.monotonic() - began > seconds:
                raise TimeoutError(f"{expression}: not true within {seconds:g} s")
            time.sleep(0.01)
        return value

    def click(self, x: float, y: float) -> None:
        self.drag((x, y), (x, y))

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 1, pause: float = 0.0) -> None:
        """Press at one point, let go at another."""

        def mouse(kind: str, at: tuple[float, float], button: str) -> None:
            held = int(kind != "mouseReleased" and button == "left")
            self("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], button=button, buttons=held, clickCount=1)
            time.sleep(pause)

        mouse("mouseMoved", start, "none")
        mouse("mousePressed", start, "left")
        for k in range(1, steps + 1):
            if start != end:
                share = k / steps
                mouse("mouseMoved", tuple(a + share * (b - a) for a, b in zip(start, end, strict=True)), "left")
        mouse("mouseReleased", end, "left")

    def strike(self, element: str, event: str = "click", share: float = 0.5) -> None:
        """Click on an element, given by an expression, with the mouse; again where the page shifted just then."""
        for _ in range(8):
            x, y = self.js(
                f"(()=>{{const e={element};e.scrollIntoView({{block:'nearest'}});window.struck=false;"
                f"e.addEventListener('{event}',()=>{{window.struck=true}},{{once:true,capture:true}});"
                f"const b=e.getBoundingClientRect();return [b.x+b.width*{share},b.y+b.height/2]}})()"
            )
            self.click(x, y)  # comes back when the page has dealt with it
            time.sleep(0.05)
            if self.js("window.struck"):
                return
        raise TimeoutError(f"{element}: could not be hit")

    def picture(self, path: str) -> None:
        with open(path, "wb") as file:
            file.write(base64.b64decode(self("Page.captureScreenshot", format="png")["data"]))


class StudioPage(Chromium):
    """The live page: its sliders by number, its verdict as text."""

    MU, TILT, AZIMUTH, PUSH_X, PUSH_Y, SCALE = range(6)

    def ready(self, seconds: float = 60.0) -> None:
        self.wait("!!document.getElementById('for')", seconds)
        self.settled(seconds)

    @property
    def word(self) -> str:
        return self.js("document.getElementById('word').innerText")

    @property
    def worth(self) -> str:
        return self.js("document.getElementById('worth').innerText")

    @property
    def holds_for(self) -> str:
        return self.js("document.getElementById('for').innerText")

    @property
    def stage(self) -> str:
        return self.js("document.getElementById('verdict').dataset.stage")

    @property
    def text(self) -> str:
        return self.js("document.body.innerText")

    def settled(self, seconds: float = 60.0) -> None:
        """Wait for an answer that is not provisional."""
        self.wait(
            "['proved','undecided','failed'].includes(document.getElementById('verdict')?.dataset.stage)", seconds
        )

    def slide(self, number: int, share: float, seconds: float = 60.0) -> float:
        """Click on a slider's track; s until the verdict's text is another."""
        track = f"document.querySelectorAll('.mantine-Slider-root')[{number}].querySelector('.mantine-Slider-track')"
        before = json.dumps(self.holds_for)
        began = time.perf_counter()
        self.strike(track, "mousedown", share)
        self.wait(f"document.getElementById('for').innerText!=={before}", seconds)
        return time.perf_counter() - began

    def press(self, label: str) -> None:
        """Click a button."""
        self.strike(f"[...document.querySelectorAll('button')].find(e=>e.innerText.trim()==={json.dumps(label)})")

    def tick(self, label: str) -> None:
        """Click the checkbox with a label."""
        self.strike(self._labelled(label, "input[type=checkbox]"))

    def name(self, text: str) -> None:
        """Write the name of a block."""
        self.strike(self._labelled("Name", "input"))
        self.js("document.activeElement.select()")
        self("Input.insertText", text=text)

    def _labelled(self, label: str, kind: str) -> str:
        """Expression for what stands with a label."""
        return (
            f"(()=>{{let e=[...document.querySelectorAll('label')].find(e=>e.innerText.trim()==={json.dumps(label)});"
            f"while(e&&!e.querySelector('{kind}'))e=e.parentElement;return e.querySelector('{kind}')}})()"
        )
