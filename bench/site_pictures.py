"""The picture of docs/site.md: the sheet of a stone's cuts, from a wall and stones that are made here.

python bench/site_pictures.py
"""

from pathlib import Path

from cyclopean import carve, match, polygonal_wall
from cyclopean.analysis import Settings
from cyclopean.api.site import SiteOptions, site_files
from cyclopean.api.site_stock import stock_of
from cyclopean.design.construction.sequence import build_sequence
from cyclopean.design.stones.quarry import quarry

IMAGES = Path(__file__).parents[1] / "docs" / "images"


def main() -> None:
    wall = polygonal_wall(width=1.6, height=1.0, columns=3, rows=2, depth=0.3)
    made = carve(match(quarry(12, volume=(0.06, 0.16)), wall))
    order = build_sequence(made.assembly, Settings(method="rbe"))
    files = site_files(order, SiteOptions(site=str(IMAGES), title="Garden wall"), stock_of(order, made))
    (IMAGES / "site-cuts.svg").write_text(files.contents["cuts-2.svg"], encoding="utf-8")


if __name__ == "__main__":
    main()
