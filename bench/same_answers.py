"""The same answers before and after a change: verdicts, J, Lambda, multipliers, orders, and what is drawn.

    python bench/same_answers.py --save before.json      # with the program as it was
    python bench/same_answers.py --against before.json   # with the program as it is; status 1 where an answer differs

Runs commands of the README on drawn models, walls of the gallery, the fixtures and found stones, in this process, and
keeps what they print as JSON and write as models. Numbers agree to 1e-9 of the larger one; bounds that are proved from
both sides (stands and falls, lower and upper) agree where the intervals overlap and none is much wider. Not compared,
because more than one answer is right or because it tells how the answer was come by: forces, motions, residuals, which
joint governs, times, provenance and certificates.
"""

import argparse
import contextlib
import io
import json
import math
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cyclopean.cli import main as cyclopean

FIXTURES = Path(os.environ.get("CYCLOPEAN_FIXTURES", "../shared/fixtures"))
LEFT_OUT = {
    "certificate", "colours", "cyclopean", "displacement", "dot", "file", "forces", "governing", "joints", "mechanism",
    "notes", "proof", "provenance", "reason", "residuals", "score", "seconds", "seeds", "smallest", "with_props",
    "tension", "written", "frames", "utilisation", "displaced",
}  # fmt: skip
BOUNDS = ({"stands", "falls"}, {"lower", "upper"})
CLOSE = 1e-9  # of the larger number
RENAMED = {"--settlement": "--settle"}  # words that an earlier program spelt so
WIDER = 3.0  # times as wide an interval is still the same answer: both are proved

DRAWN = [
    "make arch 12 --span 3 --thickness 0.3 --out arch.json",
    "make arch 9 --radius 2 --thickness 0.35 --springers fixed --out ring.json",
    "make stack 6 --offset 0.1 --out stack.json",
    "make wall 5 4 --out wall.json",
    "make vault 8 3 --out vault.json",
    "make dome 4 12 --out dome.json",
    "make polygonal --seed 7 --columns 6 --rows 4 --out poly.json --display open.json",
    "make polygonal --seed 3 --columns 6 --rows 4 --coursing 1 --batter 0.1 --out level.json",
    "make polygonal --width 4 --height 2.2 --columns 11 --rows 7 --seed 11 --quoins auto --coping auto"
    " --opening 0.8,0,0.9,1.45,arch --opening 2.45,0.75,0.7,0.65 --out door.json",
    "make polygonal --width 4.5 --columns 12 --surface cylinder:3 --depth 0.4 --batter 0.14 --out curved.json",
    "make polygonal --corner 2 --coping auto --columns 6 --rows 4 --out corner.json",
    "make polygonal --columns 5 --rows 3 --improve J --out better.json",
    "make stones --count 16 --seed 3 --out stones.glb",
]
ASKED = [
    "check arch.json", "check arch.json --tilt 20", "check ring.json --method rbe --mu 0.5",
    "check stack.json", "check stack.json --method rbe --solver interior", "check wall.json --tilt 10",
    "check wall.json --method rbe --tension 2000 --tilt 25", "check wall.json --method rbe --cone inscribed:8",
    "check arch.json --penalty --tilt 20", "check arch.json --weights 1,2",
    "check arch.json --settlement springer-left:-0.02,0,-0.01",
    "check arch.json --settlement springer-right:0.1,0,0 --steps 4", "check vault.json --no-margins",
    "check dome.json --method rbe --no-margins", "check poly.json", "check level.json --tilt 15,90",
    "check door.json --method rbe", "check curved.json --method rbe --no-margins", "check corner.json --no-margins",
    "check arch.json --vary mu=0.4:0.8 --samples 20 --seed 2 --method rbe",
    "limit arch.json --push 1,0,0", "limit arch.json --tilt", "limit arch.json --load v06:0,0,-1",
    "limit arch.json --push 1,0,0 --method cra", "limit wall.json --push 0,1,0 --tension 1000",
    "limit wall.json --tilt --polar 4", "limit poly.json --tilt 90",
    "limit ring.json --push 1,0,0 --pushover 0.05m --steps 3",
    "sequence poly.json --out order.json", "sequence arch.json --out order.json",
    "match stones.glb poly.json --out matched --negotiate 0",
    "match stones.glb poly.json --out moved --negotiate 1 --rounds 3",
    "carve matched --out carved", "settle stones.glb --ways 1 --out rubble.json",
    "settle stones.glb --wythes 2 --pins --out rubble2.json",
    "ashlar --stone 0.4x0.2x0.2*60 --width 2 --height 1 --depth 0.2 --bond english --out ashlar.json",
    "ashlar --stone 0.4x0.2x0.2*60 --stone 0.7x0.15x0.2*40 --width 2 --height 1 --depth 0.2 --courses bins --bed 0.005"
    " --head 0.005 --opening 0.6,0.2,0.5,0.4 --out bins.json",
    "pack --stone 0.4x0.2x0.2*40 --stone 0.3x0.2x0.2*40 --width 2 --height 1 --depth 0.2 --compare --out packed.json",
    "pack --stone 0.4x0.2x0.2*40 --stone 0.3x0.2x0.2*40 --width 2 --height 1 --depth 0.2 --method global --slots bond"
    " --out global.json",
    "check rubble.json --method rbe --no-margins", "info poly.json", "info stones.glb --stones",
]  # fmt: skip


def commands() -> Iterator[list[str]]:
    """Every command line, in an order in which each finds the files that it needs."""
    for line in DRAWN:
        yield line.split()
    for line in ASKED:
        yield [*line.split(), "--json", "-"]
    for path in sorted(FIXTURES.resolve().glob("*/*.json")):
        yield ["check", str(path), "--method", "rbe", "--no-margins", "--json", "-"]
        if path.parent.name == "compas_cra":
            yield ["check", str(path), "--no-margins", "--json", "-"]
        if path.name.startswith("limit"):
            yield ["limit", str(path), "--push", "1,0,0", "--json", "-"]


def answered(words: list[str]) -> dict[str, Any]:
    """Run one command: its status, what it printed as JSON, and the models that it wrote."""
    if "--out" in words and words[0] in ("match", "carve"):
        Path(words[words.index("--out") + 1]).mkdir(exist_ok=True)
    out, err = io.StringIO(), io.StringIO()
    began = time.perf_counter()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = cyclopean(words)
        if status == 2 and "No such option" in err.getvalue():
            status = cyclopean([RENAMED.get(word, word) for word in words])
    found: dict[str, Any] = {"status": status, "took": time.perf_counter() - began}
    if "--json" in words and out.getvalue():
        found["json"] = told(json.loads(out.getvalue()))
    elif status not in (0, 1, 3):
        found["said"] = err.getvalue()
    for option in ("--out", "--display"):
        if option in words and (path := Path(words[words.index(option) + 1])).suffix == ".json" and path.is_file():
            found[option] = told(json.loads(path.read_text()))
    return found


def told(data: Any) -> Any:
    """What there is to compare of a document."""
    if isinstance(data, dict):
        return {key: told(value) for key, value in data.items() if key not in LEFT_OUT}
    return [told(one) for one in data] if isinstance(data, list) else data


def differences(old: Any, new: Any, where: str = "") -> Iterator[str]:
    """Where two documents differ, and how."""
    if isinstance(old, dict) and isinstance(new, dict):
        if any(pair <= old.keys() and pair <= new.keys() for pair in BOUNDS):
            yield from _bounds(old, new, where)
        skip = {"stands", "falls", "lower", "upper", "gap", "took", "geometric_safety", "settings"}
        for key in old.keys() | new.keys():
            if key not in skip:
                yield from differences(old.get(key), new.get(key), f"{where}.{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for k, (a, b) in enumerate(zip(old, new, strict=True)):
            yield from differences(a, b, f"{where}[{k}]")
    elif isinstance(old, int | float) and isinstance(new, int | float):
        if not math.isclose(old, new, rel_tol=CLOSE, abs_tol=CLOSE):
            yield f"{where}: {old!r} was, {new!r} is"
    elif old != new:
        yield f"{where}: {str(old)[:60]} was, {str(new)[:60]} is"


def _bounds(old: dict[str, Any], new: dict[str, Any], where: str) -> Iterator[str]:
    """Both pairs of bounds are proved: they have to overlap; the new one may not say much less."""
    low, high = sorted(next(pair for pair in BOUNDS if pair <= old.keys()))[:: -1 if "stands" in old else 1]
    ends = [one[key] for one in (old, new) for key in (low, high)]
    if any(not isinstance(x, int | float) for x in ends):
        if ends[:2] != ends[2:] and [type(x) for x in ends[:2]] != [type(x) for x in ends[2:]]:
            yield f"{where}: {ends[:2]} was, {ends[2:]} is"
        return
    (a, b), (c, d) = sorted(ends[:2]), sorted(ends[2:])
    slack = CLOSE * max(1.0, abs(b), abs(d))
    if c > b + slack or d < a - slack or d - c > WIDER * (b - a) + 1e-6 * max(1.0, abs(b)):
        yield f"{where}: [{a!r}, {b!r}] was, [{c!r}, {d!r}] is"


def main() -> int:
    """Save what is answered, or compare it with what was."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, help="write the answers here")
    parser.add_argument("--against", type=Path, help="compare with the answers that are here")
    parser.add_argument("--only", default="", help="commands that contain this, and those that draw")
    given = parser.parse_args()
    before = json.loads(given.against.read_text()) if given.against else {}
    lines = [words for words in commands() if words[0] == "make" or given.only in " ".join(words)]
    found, wrong, home = {}, 0, Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for words in lines:
            name = " ".join(words).replace(str(FIXTURES.resolve() if FIXTURES.is_absolute() else ""), "")
            name = " ".join(Path(w).name if w.startswith("/") else w for w in name.split())
            found[name] = answered(words)
            said = list(differences(before[name], found[name])) if name in before else []
            wrong += bool(said)
            then = f" ({before[name]['took']:.2f} s before)" if name in before else ""
            sys.stdout.write(f"{'DIFFERS' if said else 'ok':8}{found[name]['took']:6.2f} s{then}  {name}\n")
            sys.stdout.writelines(f"        {line}\n" for line in said[:6])
            sys.stdout.flush()
        os.chdir(home)
    if given.save:
        given.save.write_text(json.dumps(found))
    total, was = (sum(one[name]["took"] for name in found if name in one) for one in (found, before))
    sys.stdout.write(f"{len(found)} commands, {wrong} differ; {total:.0f} s, {was:.0f} s before\n")
    return int(wrong > 0)


if __name__ == "__main__":
    raise SystemExit(main())
