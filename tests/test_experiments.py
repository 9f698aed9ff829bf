"""A few rows of the pages of experiments and predictions, computed anew; `bench/experiments.py` computes them all.

By hand: a wall of rigid blocks under a force in its middle cannot take more than half its length times what stands on
its foot, over the height of the horizontal force.
"""

import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
script = runpy.run_path(str(ROOT / "bench" / "experiments.py"))
page = (ROOT / "docs" / "experiments.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(("series", "walls"), [("GRANITE", 14), ("SANDSTONE", 7)])
def test_walls_in_shear(series, walls):
    campaign = script[series]
    rows = list(script["shear_rows"](campaign))
    assert len(rows) == walls + 1
    assert [row for row in rows if row not in page] == []
    for name, total, _ in campaign.measured:
        row = next(row for row in rows if row.startswith(f"| {name} |"))
        low = float(re.search(r"\| ([\d.]+) to ", row)[1])
        assert 0.9 < low / (total * campaign.bond.length / 2 / campaign.span) < 1.0


@pytest.mark.parametrize("number", [1, 3])
def test_walls_of_ferris_and_tin_loi(number):
    bond, _, computed = script["FERRIS"][number]
    found = script["pushed"](bond.model("wall"))
    assert found.value == pytest.approx(computed, abs=6e-6)  # five decimals are given
    assert script["bounds"](found.lower, found.upper, 5) in page


def test_the_wall_that_is_tilted_has_the_blocks_of_its_source():
    assert len(script["OPEN_WALL"].model("wall")) == 182 + 1


def test_predictions_are_what_the_program_gives():
    """Those that take no second; the option `--predictions` does all."""
    assert script["changed"](["P1", "P3", "P5", "P6"]) == []
