"""A client of the live page without a browser: speaks viser's protocol over a real socket."""

import queue
import threading
import time
from urllib.parse import urlsplit

import msgspec
import viser
import zstandard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

PATIENCE = 60.0  # s: a machine that is busy
CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [0, 0, 5.5], "fov": 0.8, "near": 0.01, "far": 1e3,
    "image_height": 800, "image_width": 1200, "look_at": [0, 0, 0], "up_direction": [0, 0, 1],
}  # fmt: skip


class StudioClient:
    """One client; use as a context manager. It reads all the time, as a browser does."""

    def __init__(self, address):
        parts = urlsplit(address)
        version = f"viser-v{viser.__version__}"
        self.line = connect(f"ws://{parts.netloc}/?{parts.query}", subprotocols=[version], max_size=None)
        self.elements, self.notices, self.html, self.code = {}, queue.Queue(), {}, None
        self.nodes = set()  # names of what is in the scene
        self._there = threading.Event()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.send(CAMERA)
        assert self._there.wait(PATIENCE)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.line.close()
        self._reader.join(PATIENCE)

    def send(self, message):
        self.line.send(msgspec.msgpack.encode(message))

    def set(self, label, value):
        """Give the element of this label a value."""
        self.send({"type": "GuiUpdateMessage", "uuid": self.elements[label], "updates": {"value": value}})

    def ended(self):
        """The code with which the server has ended the line."""
        self._reader.join(PATIENCE)
        assert not self._reader.is_alive()
        return self.code

    def until(self, text):
        """Wait until the page says this."""
        self.wait(lambda: any(text in html for html in list(self.html.values())), text)

    def wait(self, done, what):
        """Wait until something has come."""
        end = time.monotonic() + PATIENCE
        while not done():
            assert time.monotonic() < end, f"{what!r}: has not come"
            time.sleep(0.01)

    def _read(self):
        try:
            for raw in self.line:
                size, packed = int.from_bytes(raw[:8], "little"), int.from_bytes(raw[8:16], "little")
                inner = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed], max_output_size=size)
                for message in msgspec.msgpack.decode(inner)["messages"]:
                    self._heard(message)
        except ConnectionClosed:
            pass
        self.code = self.line.close_code

    def _heard(self, message):
        kind, props = message["type"], message.get("props") or {}
        if kind == "ReplayDoneMessage":
            self._there.set()
        elif kind == "TransformControlsMessage":
            self.nodes.add(message["name"])
        elif kind == "NotificationShowMessage":
            self.notices.put((props["title"], props["body"]))
        elif kind == "GuiUpdateMessage" and "content" in message["updates"]:
            self.html[message["uuid"]] = message["updates"]["content"]
        elif "label" in props:
            self.elements[props["label"]] = message["uuid"]
        elif "content" in props:
            self.html[message["uuid"]] = props["content"]
