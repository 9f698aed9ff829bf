"""How fast the live page answers, measured inside a real headless Chromium.

Run `python bench/studio.py [--sizes 200,2000] [--moves 15]`; needs chromium. For running-bond walls of about so many
blocks a slider is moved by clicks, and the page itself notes when the click came, when the text of the verdict was
another, when the browser had shown that, and when the scene that goes with it had been drawn to the last pixel (it asks
for one of them, which waits for all). Prints median, best and worst of these, of the solver within, of the time to a
verdict that is proved, and of a frame drawn again with nothing changed: that last is the browser alone, which on a
machine without graphics card draws on the processor that also solves.
"""

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))  # the browser is shared with the tests of the page

from chromium import FOUND, StudioPage  # noqa: E402
from cyclopean.analysis import Settings  # noqa: E402
from cyclopean.design import wall  # noqa: E402
from cyclopean.view.studio.panel import studio  # noqa: E402

SHARES = [0.02, 0.04, 0.03, 0.05, 0.08, 0.06, 0.1, 0.12, 0.09, 0.14, 0.11, 0.15, 0.13, 0.07, 0.01]  # of 60 degrees
PIXEL = """
const canvas = document.querySelector('canvas[data-engine]') || document.querySelector('canvas');
const gl = canvas.getContext('webgl2'), pixel = new Uint8Array(4);
const drawn = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
const frame = () => new Promise(done => requestAnimationFrame(done));
"""
WATCH = f"""(() => {{{PIXEL}
const seen = window.seen = {{}}, queue = window.__viserMutable.messageQueue;
const said = () => document.getElementById('for')?.innerText;
const push = queue.push, splice = queue.splice;
let before = said(), scene = 0;
queue.push = function(message) {{
  if (!message.type.startsWith('Gui')) scene = performance.now();
  return push.call(this, message);
}};
window.addEventListener('pointerdown', event => {{
  before = said(); scene = 0;
  for (const name in seen) delete seen[name];
  seen.click = event.timeStamp;
}}, true);
new MutationObserver(() => {{
  if (!seen.click || seen.text || said() === before) return;
  seen.text = performance.now();
  frame().then(frame).then(() => seen.painted = performance.now());
}}).observe(document.body, {{subtree: true, childList: true, characterData: true}});
queue.splice = function(...range) {{
  if (seen.text && !seen.applied && scene > seen.click) {{
    seen.applied = performance.now();
    frame().then(() => setTimeout(() => {{ drawn(); seen.picture = performance.now(); }}));  // the next frame has it
  }}
  return splice.apply(this, range);
}};
}})()"""
FRAMES = f"""(async () => {{{PIXEL}
window.__viserMutable.requestRender(); await frame(); drawn();
const took = [];
for (let k = 0; k < 10; k++) {{
  const began = performance.now();
  window.__viserMutable.requestRender(); await frame(); drawn();
  took.push((performance.now() - began) / 1e3);
}}
return took;
}})()"""


def measured(blocks: int, moves: int, method: str, picture: str | None) -> None:
    side = round(blocks**0.5)
    model = wall(side, side)
    with (
        tempfile.TemporaryDirectory() as folder,
        studio(model, Settings(method=method), folder=Path(folder)) as page,
        StudioPage(page.address) as browser,
    ):
        browser.ready(300.0)
        with suppress(TimeoutError):  # how far it is from falling is looked for meanwhile, by a process that gives way
            browser.wait("(document.getElementById('reach')?.innerText||'').includes('falls at')", 60.0)
        time.sleep(1.0)
        frames = browser.js(FRAMES)
        browser.js(WATCH)
        text, painted, drawn, proved, inside = [], [], [], [], []
        for share in (SHARES * (moves // len(SHARES) + 1))[:moves]:
            began = time.perf_counter()
            browser.slide(StudioPage.TILT, share, 120.0)
            inside.append(page.session.latest.answer.seconds)
            browser.settled(300.0)
            proved.append(time.perf_counter() - began)
            seen = json.loads(browser.wait("seen.picture && seen.painted && JSON.stringify(seen)", 60.0))
            painted.append((seen["painted"] - seen["click"]) / 1e3)
            text.append((seen["text"] - seen["click"]) / 1e3)
            drawn.append((seen["picture"] - seen["click"]) / 1e3)
            time.sleep(0.5)
        if picture:
            browser.picture(picture)

    def told(what: str, seconds: list[float]) -> str:
        return f"  {what:42} {statistics.median(seconds):7.3f} {min(seconds):7.3f} {max(seconds):7.3f}"

    busy = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    print(f"{len(model)} blocks, {method}, {moves} moves, {busy}: seconds (median, best, worst)")
    print(told("from the click to the new text", text))
    print(told("  of these, solver", inside))
    print(told("from the click to the text on the screen", painted))
    print(told("from the click to the new picture", drawn))
    print(told("from the click to a proved verdict", proved))
    print(told("one frame of the browser, nothing changed", frames), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default="200,2000")
    parser.add_argument("--moves", type=int, default=15)
    parser.add_argument("--methods", default="rbe,cra")
    parser.add_argument("--picture", help="where to put a picture of the last page")
    chosen = parser.parse_args()
    if FOUND is None:
        sys.exit("no chromium on this machine")
    for size in chosen.sizes.split(","):
        for method in chosen.methods.split(","):
            measured(int(size), chosen.moves, method, chosen.picture)


if __name__ == "__main__":
    main()
