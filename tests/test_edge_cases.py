"""Every option on models at the edges of what the program answers: none ends in a fault of ours.

They fall already, touch without bearing, touch nothing, have no free block, lean on a hinge or a roller, or stand by
friction alone. What an option does not go with is refused in one line.
"""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from coupled_cases import beams, prism
from cyclopean.assembly import Assembly, Load
from cyclopean.design import arch, dome, stack, wall
from cyclopean.io import write_model
from laws import some

FILES = "--report r.html --svg s.svg --json r.json --certificate p.json"
CHECKS = (
    "", "--method rbe", "--penalty", "--mu 0", "--gravity 0,0,0", "--gravity 1,0,-9", "--tilt 10", "--tension 1000",
    "--cohesion 100", "--method rbe --cone inscribed:8", "--cone circumscribed:4", "--method rbe --weights 2,1",
    "--within 0.001 --method rbe", "--margins", "--vary mu=0.3:0.9 --samples 5", "--solver clarabel", "--factor 1.5",
    "--eps 0.1", "--eta 2", "--all-combinations", "--rough auto", "--supports below=0.1", "--tolerance auto",
    "--density 100", "--nodes 1", "--effort 0.2", FILES, f"--method rbe {FILES}",
)  # fmt: skip
LIMITS = (
    "--push 1,0,0", "--push 0,0,1", "--tilt 0", "--tilt 90", "--load b:0,0,-1", "--live b", "--push 1,0,0 --polar 4",
    "--push 1,0,0 --method cra --nodes 5", "--tilt 0 --polar 4", "--push 1,0,0 --pushover 0.1m --steps 3",
    "--tilt 0 --pushover 5deg --steps 3", "--push 1,0,0 --mu 0", "--tilt 0 --gravity 0,0,0", "--live x=0",
    "--push 1,0,0 --tension 1000", "--along=-1:1 --steps 3", "--surcharge 1000", f"--push 1,0,0 {FILES}",
    f"--tilt 0 {FILES}",
)  # fmt: skip
SEQUENCES = ("--out o.json", "--out o.json --method rbe", "--out o.json --report o.html --dot o.dot")
COMMANDS = [
    *(f"check {words}" for words in CHECKS), *(f"limit {words}" for words in LIMITS),
    *(f"sequence {words}" for words in SEQUENCES), "info", "info --interlock", "view --out v.html",
]  # fmt: skip


def models() -> dict[str, Assembly]:
    cube = prism("b", [(0.1, 0), (1.1, 0), (1.1, 1), (0.1, 1)], 1.0)
    stop = replace(prism("stop", [(1.1, 0), (2.1, 0), (2.1, 1), (1.1, 1)], 1.0), fixed=True)
    pressed = replace(arch(7, span=3.0, thickness=0.4), loads=(Load(3, np.array([0, 0, -1e5]), np.zeros(3)),))
    return {
        "thin": arch(7, span=3.0, thickness=0.05),
        "leans": stack(3, offset=0.5),
        "slides": Assembly((cube, stop)),
        "hinged": Assembly((replace(cube, held=("x", "y", "z", "rx", "rz")), stop)),
        "rolls": Assembly((replace(cube, held=("z", "rx", "ry", "rz")),)),
        "touches nothing": Assembly((cube, replace(stop, vertices=stop.vertices + np.array([3.0, 0.0, 5.0])))),
        "all fixed": Assembly((replace(cube, fixed=True), stop)),
        "pressed": pressed,
        "wall": wall(3, 3),
        "frame": beams(1.0, 0.8, 0.5, 2),
        "dome": dome(2, 6, thickness=0.3),
    }


@pytest.mark.parametrize(
    ("command", "name"), some([*product(COMMANDS, models())], 12)
)  # not one in eleven: all of one model
def test_no_option_ends_in_a_fault_of_ours(run, command: str, name: str) -> None:
    write_model("model.json", models()[name])
    first, *words = command.split()
    status, _, err = run(first, "model.json", *words)
    assert status in (0, 1, 2, 3), err
    assert "internal error" not in err
    assert status != 2 or sum("error: " in line for line in err.splitlines()) == 1
