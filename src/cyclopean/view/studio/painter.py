"""The thread that draws: always the newest snapshot, after its words have gone out, and the mechanism as it moves."""

import threading
import time
from collections.abc import Callable

import numpy as np

from cyclopean.view.studio.latest_value import LatestValue
from cyclopean.view.studio.live_scene import LiveScene
from cyclopean.view.studio.session import Snapshot

TURN = 1.6  # s that the mechanism takes there and back
FRAMES = 12.0  # a second, of small models
BUSY = 4e5  # triangles a second that are sent while a mechanism moves
STILL = 0.4  # s after a snapshot in which the mechanism rests: while a slider moves, frames go to what it changes
GLANCE = 0.2  # s between looks at whether a mechanism is to move
AHEAD = 0.03  # s by which the words go before the drawing: two frames of the browser, in which it shows them


class Painter:
    """Draws snapshots on a scene one after the other, leaving out those that are outdated.

    `moving` tells whether the mechanism is to move.
    """

    def __init__(self, scene: LiveScene, moving: Callable[[], bool]) -> None:
        self._scene, self._moving = scene, moving
        self._box: LatestValue[Snapshot] = LatestValue()
        self._thread = threading.Thread(target=self._run, name="painter", daemon=True)
        self._thread.start()

    def show(self, snapshot: Snapshot) -> None:
        """Draw this soon, and none that came before."""
        self._box.put(snapshot)

    def close(self) -> None:
        """Draw no more."""
        self._box.end()
        self._thread.join()

    def _run(self) -> None:
        shown, moved = -np.inf, False
        while True:
            runs = self._moving() and self._scene.moves
            rate = min(FRAMES, BUSY / max(self._scene.size, 1))  # as many a second as the size of the model allows
            snapshot = self._box.take(1.0 / max(rate, 0.2) if runs else GLANCE)
            if self._box.ended:
                return
            if snapshot is not None:
                time.sleep(AHEAD)
                self._scene.show(snapshot)
                shown, moved = time.monotonic(), False
            elif runs and time.monotonic() - shown > STILL:
                self._scene.pose_mechanism(0.5 - 0.5 * float(np.cos(2.0 * np.pi * time.monotonic() / TURN)))
                moved = True
            elif moved and not runs:
                self._scene.pose_mechanism(1.0)
                moved = False
