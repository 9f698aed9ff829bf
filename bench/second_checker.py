"""Hold the two checkers of certificates against each other: Python's and the one in pages.

Run `python bench/second_checker.py [--models 300] [--damaged 10] [--seed 0] [--keep FOLDER]
[--files FILE ...]`.

Certificates of models by chance, and damaged copies of each, go to both. Prints every one of which the answers differ
(proved or not; and what is claimed), and counts by kind. `--keep` writes those that differ into a folder. `--files`
takes certificates, and models, which are checked first, in place of models by chance. The page's
checker runs in node where there is one, else in headless Chromium; `--chromium` says to use that in any case.
"""

import argparse
import atexit
import json
import shutil
import subprocess
import sys
from collections import Counter
from contextlib import suppress
from pathlib import Path
from tempfile import mkdtemp
from time import perf_counter
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))  # models and damages are shared with the tests

import cyclopean
from checker_cases import any_certificate, damaged
from chromium import Chromium
from cyclopean.proof import NotACertificateError, verify_file

CHECKER = Path(__file__).parents[1] / "src" / "cyclopean" / "view" / "checker.js"
LINES = (
    "const {verifyCertificate}=require(process.argv[1]);"
    "require('readline').createInterface({input:process.stdin}).on('line',l=>{let r;const t=performance.now();"
    "try{r=verifyCertificate(JSON.parse(l))}catch(e){r={proved:null,kind:null,claim:'',assumed:[],reason:e.stack}}"
    "r.seconds=(performance.now()-t)/1000;console.log(JSON.stringify(r))})"
)


class Node:
    """The page's checker in node."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            ["node", "-e", LINES, str(CHECKER)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __call__(self, text: str) -> dict[str, Any]:
        assert self.process.stdin
        assert self.process.stdout
        self.process.stdin.write(json.dumps(text) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())


class Page:
    """The same in headless Chromium."""

    def __init__(self) -> None:
        self.page = Chromium("about:blank")
        atexit.register(self.page.__exit__)
        self.page.js(CHECKER.read_text())

    def __call__(self, text: str) -> dict[str, Any]:
        run = (
            f"(()=>{{const t=performance.now(),r=verifyCertificate({json.dumps(text)});"
            "r.seconds=(performance.now()-t)/1000;return r})()"
        )
        return self.page.js(run) or {
            "proved": None,
            "kind": None,
            "claim": "",
            "assumed": [],
            "reason": "it threw",
            "seconds": 0.0,
        }


def python_says(text: str, file: Path) -> dict[str, Any]:
    """Answer of the first checker."""
    file.write_text(text)
    began = perf_counter()
    try:
        report = verify_file(file)
    except NotACertificateError as error:
        return {"proved": False, "claim": "", "assumed": [], "reason": str(error), "seconds": 0.0}
    except Exception as error:  # noqa: BLE001  # what a checker must never do is counted here
        return {"proved": None, "claim": "", "assumed": [], "reason": repr(error), "seconds": 0.0}
    seconds = perf_counter() - began
    return {
        "proved": report.proved,
        "claim": report.claim if report.proved else "",
        "assumed": [[line[:10].strip(), line[11:]] for line in report.assumed] if report.proved else [],
        "reason": report.reason,
        "seconds": seconds,
    }


def said(answer: dict[str, Any]) -> tuple[object, ...]:
    """What is compared: the verdict, the whole claim and all that is assumed."""
    return answer["proved"], answer["claim"], answer["assumed"]


def proof_of_file(file: Path) -> dict[str, Any] | None:
    """The certificate that a file is, or of the model that it holds; None where nothing is proved, with the reason."""
    with suppress(ValueError):  # no JSON
        document = json.loads(file.read_text())
        if isinstance(document, dict) and str(document.get("schema", "")).startswith("cyclopean.certificate/"):
            return document
    try:
        found = cyclopean.check(file, margins=False, seconds=20.0)
    except cyclopean.CyclopeanError as error:
        print(f"{file.name}: {error}", flush=True)
        return None
    print(f"{file.name}: {found.verdict}", flush=True)
    return found.certificate


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", type=int, default=300)
    parser.add_argument("--damaged", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--chromium", action="store_true")
    parser.add_argument("--files", nargs="+", type=Path, default=[])
    given = parser.parse_args()
    other = Page() if given.chromium or not shutil.which("node") else Node()
    keep = given.keep or Path(mkdtemp())
    keep.mkdir(exist_ok=True)
    counts: Counter[str] = Counter()
    spent = {"python": 0.0, "page": 0.0}
    for number in range(len(given.files) or given.models):
        rng = np.random.default_rng((given.seed, number))
        certificate = proof_of_file(given.files[number]) if given.files else any_certificate(rng)
        if certificate is None:
            counts["no certificate"] += 1
            continue
        texts = [json.dumps(certificate), *(damaged(certificate, rng) for _ in range(given.damaged))]
        for k, text in enumerate(texts):
            first, second = python_says(text, keep / "at_hand.json"), other(text)
            spent["python"] += first["seconds"]
            spent["page"] += second["seconds"]
            word = {True: "proved", False: "not proved", None: "FAILED"}[first["proved"]]
            counts[f"{certificate['kind']}, {'damaged' if k else 'whole'}: {word}"] += 1
            if said(first) == said(second):
                continue
            what = "CLAIM DIFFERS" if first["proved"] is second["proved"] else "DIFFERS"
            counts[f"{certificate['kind']}: {what}"] += 1
            print(f"{what}: seed {given.seed}, model {number}, {k}\n  {first}\n  {second}", flush=True)
            if given.keep:
                (keep / f"{given.seed}_{number}_{k}.json").write_text(text)
    for what, count in sorted(counts.items()):
        print(f"{count:7d}  {what}")
    print(f"{spent['python']:.1f} s in Python, {spent['page']:.1f} s in the page's checker")


if __name__ == "__main__":
    main()
