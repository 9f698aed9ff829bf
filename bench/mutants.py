"""Does a test fail when a line of the core is wrong? One change at a time, in a copy, until a test of its room fails.

Run `python bench/mutants.py [--rooms statics,proof] [--count 300] [--seed 0] [--jobs 2] [--lines 1200-1400] [--list]`,
or with `--again FILE` for the changes that an earlier run printed. The rooms are `statics`, `proof`, `equilibrium` and
`coupled`. Prints every change that no test notices, with its file and line, and a sum at the end. Changed are
comparisons, arithmetic, constants, `and` and `or`, `not`, signs, the direction of rounding, `min` and `max`, `any` and
`all` (of numpy too), branches; and refusals are dropped. What survives either wants a test or changes nothing that can
be told (a bound that is never reached, a figure to print, a shorter way).

It works in any checkout: package and tests are copied to a temporary folder, and only the copy is changed. The files
of tests come quickest first, and a run ends with the first failure, so that a change that is noticed soon costs little.
"""

import argparse
import ast
import copy
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from time import perf_counter

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = Path("src/cyclopean")
ROOMS = {  # the code of each, and its tests
    "statics": (
        "statics",
        ["statics", "textbook", "mass", "loads", "partial_supports", "tension", "settlements", "laws", "rbe",
         "plane", "effort"],
    ),
    "proof": (
        "proof",
        ["proof_checker", "proof_parts", "proof_surfaces", "proof_rules", "proof_laws", "proof_standalone",
         "proof_solids", "limit_certificates", "proof_cra_state", "proof_small_files", "proof_fast_paths",
         "proof_places", "proof_mutations", "settlements", "partial_supports", "tension", "mutated_certificates",
         "proof_within", "proof_cra_tree", "proof_points", "pyramids", "touching"],
    ),
    "equilibrium": (
        "analysis/equilibrium",
        ["effort", "textbook", "tipping", "near_limit", "nearest", "own_scale", "partial_supports", "tension",
         "settlements", "subsidence", "solvers", "laws", "rbe", "oracle", "random_planes", "undecided", "slips",
         "margins", "loads"],
    ),
    "coupled": (
        "analysis/coupled",
        [
            "effort", "cra_tree", "cra_penalty", "cra_laws", "cra_continuation", "cra_plane", "cra_search",
            "smallest_eta", "peer_cra", "cra_random", "oracle", "cra_probing", "undecided",
        ],
    ),
}  # fmt: skip
COMPARED: dict[type[ast.cmpop], list[type[ast.cmpop]]] = {
    ast.Lt: [ast.LtE, ast.Gt],
    ast.LtE: [ast.Lt, ast.GtE],
    ast.Gt: [ast.GtE, ast.Lt],
    ast.GtE: [ast.Gt, ast.LtE],
    ast.Eq: [ast.NotEq],
    ast.NotEq: [ast.Eq],
    ast.In: [ast.NotIn],
    ast.NotIn: [ast.In],
    ast.Is: [ast.IsNot],
    ast.IsNot: [ast.Is],
}
REPLACED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.FloorDiv,
    ast.FloorDiv: ast.Mult,
    ast.Div: ast.Mult,
    ast.LShift: ast.RShift,
    ast.BitOr: ast.BitAnd,
    ast.Pow: ast.Mult,
}
RENAMED = {
    "min": "max",
    "max": "min",
    "any": "all",
    "all": "any",
    "_root_above": "math.isqrt",
    "_plus": "_minus",
    "_minus": "_plus",
    "_quotient_above": "_quotient_below",
    "sum": "max",
    "np.minimum": "np.maximum",
    "np.maximum": "np.minimum",
    "np.min": "np.max",
    "np.max": "np.min",
    "np.any": "np.all",
    "np.all": "np.any",
}


@dataclass(frozen=True)
class Mutant:
    """The `number`-th node of a file (in the order of `ast.walk`), changed in the `way`-th manner that it has."""

    room: str
    file: Path
    number: int
    way: int
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.file.relative_to(PACKAGE)}:{self.line}: {self.text}"


def changes(node: ast.AST) -> Iterator[ast.AST]:
    """Nodes that this one might be by mistake."""
    if isinstance(node, ast.Compare):
        for i, op in enumerate(node.ops):
            for other in COMPARED[type(op)]:
                yield ast.Compare(node.left, [*node.ops[:i], other(), *node.ops[i + 1 :]], node.comparators)
    elif isinstance(node, ast.BinOp) and type(node.op) in REPLACED:
        yield ast.BinOp(node.left, REPLACED[type(node.op)](), node.right)
    elif isinstance(node, ast.AugAssign) and type(node.op) in REPLACED:
        yield ast.AugAssign(node.target, REPLACED[type(node.op)](), node.value)
    elif isinstance(node, ast.BoolOp):
        yield ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
        for i in range(len(node.values)):
            rest = node.values[:i] + node.values[i + 1 :]
            yield rest[0] if len(rest) == 1 else ast.BoolOp(node.op, rest)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        yield node.operand
    elif isinstance(node, ast.IfExp):
        yield node.body
        yield node.orelse
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        yield ast.Constant(node.value + 1)
        yield ast.Constant(node.value - 1 if node.value != 1 else 3)
    elif isinstance(node, ast.Constant) and type(node.value) is bool:
        yield ast.Constant(not node.value)
    elif isinstance(node, ast.Name | ast.Attribute) and ast.unparse(node) in RENAMED:
        yield ast.parse(RENAMED[ast.unparse(node)], mode="eval").body
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) and ast.unparse(node.value.func) == "_refuse":
        yield ast.Pass()
    elif isinstance(node, ast.Continue | ast.Raise):
        yield ast.Pass()


def judged(tree: ast.Module) -> Iterator[tuple[int, ast.AST]]:
    """Nodes whose change might be a mistake of the proof: no annotations, no text for people."""
    aside: set[int] = set()
    for node in ast.walk(tree):
        parts = [getattr(node, key, None) for key in ("annotation", "returns")] + getattr(node, "decorator_list", [])
        if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "T"):
            parts.append(node)
        if node in tree.body and isinstance(node, ast.Assign) and isinstance(node.value, ast.Subscript):  # a type
            parts.append(node)
        aside.update(id(part) for part in parts if part is not None)
        if id(node) in aside:
            aside.update(id(child) for child in ast.iter_child_nodes(node))
    for number, node in enumerate(ast.walk(tree)):
        if id(node) not in aside:
            yield number, node


def mutants(room: str) -> list[Mutant]:
    """All changes of a room, file by file, from the first line to the last."""
    found = []
    for path in sorted((ROOT / PACKAGE / ROOMS[room][0]).rglob("*.py")):
        file = path.relative_to(ROOT)
        for number, node in judged(ast.parse(path.read_text(encoding="utf-8"))):
            for way, other in enumerate(changes(node)):
                text = f"{ast.unparse(node)}  ->  {ast.unparse(ast.fix_missing_locations(other))}"
                found.append(Mutant(room, file, number, way, getattr(node, "lineno", 0), text.replace("\n", " ")))
    return sorted(found, key=lambda mutant: (mutant.file, mutant.line, mutant.number, mutant.way))


class _Swap(ast.NodeTransformer):
    """Put one node in the place of another."""

    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else self.generic_visit(node)


def mutated(mutant: Mutant) -> str:
    """The file with one change."""
    tree = ast.parse((ROOT / mutant.file).read_text(encoding="utf-8"))
    node = next(node for number, node in enumerate(ast.walk(tree)) if number == mutant.number)
    new = list(changes(copy.deepcopy(node)))[mutant.way]
    text = ast.unparse(ast.fix_missing_locations(_Swap(node, new).visit(tree)))
    if "_quotient_below" in text:
        text = text.replace(
            "def _quotient_above", "def _quotient_below(n, d):\n    return abs(n) // d\n\ndef _quotient_above"
        )
    return text


def prepared(folder: Path) -> Path:
    """Copy what the tests need."""
    shutil.copytree(ROOT / "src", folder / "src", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "tests", folder / "tests", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def noticed(folder: Path, room: str, limit: float) -> str:
    """How a room's tests take it: "" if they pass, else what they say last; one that does not end counts as noticed."""
    environment = os.environ | {"PYTHONPATH": str(folder / "src"), "OMP_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # or every run compiles everything again
    files = [f"tests/test_{name}.py" for name in ROOMS[room][1]]
    files += [str(PACKAGE / ROOMS[room][0])]  # the examples in its docstrings
    command = [sys.executable, "-m", "pytest", "-x", "-q", "--tb=no", "-p", "no:cacheprovider", *files]
    try:
        run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return "takes too long"
    return "" if run.returncode == 0 else (run.stdout.strip().splitlines() or ["fails"])[-1]


def attempt(folders: "SimpleQueue[Path]", mutant: Mutant, limit: float) -> str:
    """How the tests take one change, in a folder that is free; the file is put back."""
    folder = folders.get()
    try:
        (folder / mutant.file).write_text(mutated(mutant), encoding="utf-8")
        return noticed(folder, mutant.room, limit)
    finally:
        shutil.copy(ROOT / mutant.file, folder / mutant.file)
        folders.put(folder)


def main() -> int:
    """Change, test, tell."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rooms", default=",".join(ROOMS), help=f"some of {', '.join(ROOMS)}")
    parser.add_argument("--count", type=int, default=300, help="how many changes, drawn by the seed")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--lines", help="first and last line of each file, as 1200-1400")
    parser.add_argument("--again", type=Path, help="file with what an earlier run printed")
    parser.add_argument("--list", action="store_true", help="print the changes, test nothing")
    given = parser.parse_args()
    rooms = given.rooms.split(",")
    first, last = map(int, given.lines.split("-")) if given.lines else (1, 10**9)
    chosen = [mutant for room in rooms for mutant in mutants(room) if first <= mutant.line <= last]
    whole = len(chosen)
    if given.again:
        wanted = set(given.again.read_text(encoding="utf-8").splitlines())
        chosen = [mutant for mutant in chosen if str(mutant) in wanted]
    else:
        chosen = random.Random(given.seed).sample(chosen, min(given.count, whole))
    if given.list:
        print("\n".join(map(str, sorted(chosen, key=lambda mutant: (mutant.file, mutant.line)))))
        return 0
    with tempfile.TemporaryDirectory() as place:
        folders: SimpleQueue[Path] = SimpleQueue()
        for job in range(given.jobs):
            folders.put(prepared(Path(place) / str(job)))
        begun, limits = perf_counter(), {}
        for room in rooms:
            alone = perf_counter()
            if fault := noticed(Path(place) / "0", room, 3600.0):
                print(f"tests of {room} fail before any change: {fault}")
                return 1
            limits[room] = 60.0 + 10.0 * (perf_counter() - alone)
        survivors = 0
        with ThreadPoolExecutor(given.jobs) as pool:
            answers = pool.map(lambda mutant: attempt(folders, mutant, limits[mutant.room]), chosen)
            for mutant, answer in zip(chosen, answers, strict=True):
                if not answer:
                    survivors += 1
                    print(mutant, flush=True)
    print(f"{len(chosen)} of {whole} changes, {survivors} not noticed; {perf_counter() - begun:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
