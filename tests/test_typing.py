"""What a user's type checker makes of the package: strict, and with the types that are promised."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

SCRIPT = '''
"""A small script of a user, every line of it typed."""

from pathlib import Path

import cyclopean
from cyclopean import Assembly, PatternSettings, Result, Settings, StoneCarving, StoneMatch


def verdict(model: Assembly | str | Path, mu: float) -> str:
    result: Result = cyclopean.check(model, mu=mu, method="cra", tilt=5.0)
    return result.verdict


def lowest(wall: Assembly, steps: int = 4) -> float:
    return min(k / steps for k in range(1, steps + 1) if verdict(wall, k / steps) == "stable")


wall = cyclopean.polygonal_wall(PatternSettings(width=2.0), height=1.2, columns=5, rows=3)
print(verdict(wall.assembly, 0.7), lowest(wall.assembly))
print(cyclopean.check(wall, Settings(mu=0.7)).reason)
model, warnings = cyclopean.read_model("wall.json")
found: StoneMatch = cyclopean.match("scans", wall, gap=0.2, units="mm")
carved: StoneCarving = cyclopean.carve(found)
cyclopean.save(carved, Path("cutlist.csv"))
order = cyclopean.build_sequence(carved, mu=0.7).order
rubble = cyclopean.settle("scans", length=2.0, wythes=2)
cyclopean.save(cyclopean.check(rubble), "rubble.html")
html: str = cyclopean.card(rubble)
reveal_type(cyclopean.check(model).certificate)
reveal_type(order)
reveal_type(found.imposition)
'''

WRONG = """
import cyclopean

cyclopean.check(3)
cyclopean.check("wall.json", mu="0.7")
cyclopean.check("wall.json", method="fem")
cyclopean.check("wall.json", friction=0.7)
cyclopean.settle("scans", wythes=3)
cyclopean.save("wall.json", "wall.obj")
"""


@pytest.fixture(scope="module")
def report(tmp_path_factory) -> dict[str, list[str]]:
    """What strict mypy says of the two scripts, by file; one run, and what it knows of the packages is kept for all."""
    place = tmp_path_factory.mktemp("typed")
    (place / "right.py").write_text(SCRIPT)
    (place / "wrong.py").write_text(WRONG)
    scripts = [place / "right.py", place / "wrong.py"]
    command = [sys.executable, "-m", "mypy", "--no-color-output", "--no-error-summary", *scripts]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=240)
    lines, names = done.stdout.splitlines(), ("right.py", "wrong.py")
    return {name: [line[line.index(name) :] for line in lines if f"{name}:" in line] for name in names}


def test_a_typed_script_passes(report) -> None:
    notes = [line.partition("note: ")[2] for line in report["right.py"] if "note: " in line]
    assert [line for line in report["right.py"] if "error: " in line] == []
    assert notes == [
        'Revealed type is "dict[str, Any] | None"',
        'Revealed type is "tuple[int, ...]"',
        'Revealed type is "float"',
    ]


def test_wrong_calls_are_found(report) -> None:
    found = {int(line.split(":")[1]) for line in report["wrong.py"] if "error: " in line}
    assert found == {4, 5, 6, 7, 8, 9}, "\n".join(report["wrong.py"])
