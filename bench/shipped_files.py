"""Files that other programs ship: what each is, what was mended, what is said of it, and what that program says.

    python bench/shipped_files.py FILE [FILE ...]

One row of the page `docs/shipped-files.md` for each. The last column is compas_cra 0.8.0 (extra `peer`) on the same
blocks, supports and contacts; blank where it is not installed.
"""

import os
import sys
from multiprocessing import Pipe, Process
from multiprocessing.connection import Connection
from pathlib import Path
from time import perf_counter

from cyclopean.analysis import Result, Settings, check
from cyclopean.assembly import Assembly
from cyclopean.errors import InputError
from cyclopean.io import file_format, read_model

SECONDS = 60  # that the peer gets


def said(model: Assembly, tolerance: str | None = None) -> tuple[str, Result]:
    """Verdict by coupled analysis, with that of equilibrium where it is open."""
    result = check(model, Settings(tolerance=tolerance, seconds=30.0))
    if result.verdict == "undecided":
        return f"undecided (equilibrium: {result.provenance.get('rbe', 'undecided')})", result
    return result.verdict, result


def peer(result: Result) -> str:
    """What compas_cra's coupled analysis says of the same blocks, supports and contacts."""
    try:
        import compas_cra  # noqa: F401
    except ImportError:
        return ""
    there, here = Pipe()
    process = Process(target=_asked, args=(there, result))
    process.start()
    word = str(here.recv()) if here.poll(SECONDS) else f"no answer in {SECONDS} s"
    process.kill()
    return word


def _asked(there: Connection, result: Result) -> None:
    from compas_cra.equilibrium import cra_solve
    from peer import peer_model

    with open(os.devnull, "w") as nothing:
        os.dup2(nothing.fileno(), 1)
        try:
            cra_solve(peer_model(result.assembly, result.contacts, result.fixed), mu=0.84, density=1.0)
            there.send("solved")
        except Exception as error:  # noqa: BLE001  whatever it is, it is the peer's answer
            there.send(str(error).splitlines()[0][:60] if str(error) else type(error).__name__)


def row(path: Path) -> str:
    """One line of the table."""
    began = perf_counter()
    try:
        model, warnings = read_model(path)
        drawn, result = said(model)
    except InputError as error:
        message = str(error).removeprefix(f"{path}: ")
        return f"| {path.name} | {file_format(path)} | | | {message} | | | |"
    seconds = perf_counter() - began
    mended = next((line.partition("mended ")[2].partition(";")[0] for line in warnings if ": mended " in line), "")
    forgiven, auto = "", result
    if any("nearly touch" in line or "touches no other" in line for line in result.warnings):
        forgiven, auto = said(model, "auto")
        forgiven = f"{forgiven} at {auto.assumed['tolerance']}" if "tolerance" in auto.assumed else "nothing to forgive"
    cells = (path.name, file_format(path), str(len(model)), mended, drawn, forgiven, f"{seconds:.1f}", peer(auto))
    return f"| {' | '.join(cells)} |"


def main(paths: list[str]) -> None:
    print("| File | Format | Blocks | Mended | As drawn | `--tolerance auto` | s | compas_cra 0.8.0 |")
    print("|---|---|---|---|---|---|---|---|")
    for path in sorted(map(Path, paths), key=lambda p: p.name):
        print(row(path), flush=True)


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main(sys.argv[1:])
