"""How the share of samples that stand changes with each quantity that varies."""

from html import escape

import numpy as np

from cyclopean.analysis import Sensitivity, share_between
from cyclopean.arrays import Bools, Floats
from cyclopean.view.colours import ACCENT, INK
from cyclopean.view.markup import figure, section
from cyclopean.view.svg import grid, rect, sheet, text

BINS = 10  # bars of a histogram
WIDE, HIGH, LEFT, TOP, FOOT = 640.0, 150.0, 52.0, 34.0, 30.0  # of one panel, and what its axes take
NAMES = {
    "mu": "friction coefficient",
    "mu-each": "friction coefficient, mean of all joints",
    "density": "density, kg/m³",
    "density-each": "density, mean of all blocks, kg/m³",
    "joints": "wear of the edges of joints, mean, m",
    "tilt": "tilt, degrees",
}


def sensitivity_section(found: Sensitivity) -> str:
    """What the samples came to, in words, figures and a drawing."""
    low, estimate, high = found.probability
    count = found.count
    what = "; ".join(f"{r.quantity} {r.low:g} to {r.high:g}" for r in found.ranges)
    lines = [f"<p>{escape(found.why)}</p>"]
    lead = f"{escape(what)}; every value within its range as likely. Each verdict has passed the independent checker."
    if found.words:
        share = f"{100 * estimate:.1f} %" if np.isfinite(estimate) else "not known"
        lines.append(
            f"<p>Of {len(found.words):,} samples {count['stable']:,} stand, {count['unstable']:,} fall and"
            f" {count['undecided']:,} are undecided: the probability that it stands is {share},"
            f" with 95 % confidence between {100 * low:.1f} % and {100 * high:.1f} %.</p>"
        )
        lines.append(figure(sensitivity_svg(found), _CAPTION))
    return section("If the data are not quite what was said", "".join(lines), lead)


_CAPTION = (
    "Share of the samples that stand, by the value drawn; lines are 95 % confidence. Pale: undecided. Where every joint"
    " or block had a value of its own, their mean is drawn, which says little."
)


def sensitivity_svg(found: Sensitivity) -> str:
    """Draw one panel a quantity: for each tenth of its values, the share of samples that stand."""
    stable = np.array([word == "stable" for word in found.words], bool)
    undecided = np.array([word == "undecided" for word in found.words], bool)
    tall = HIGH + TOP + FOOT
    panels = [
        f'<g transform="translate(0 {k * tall:g})">{_panel(NAMES[r.quantity], values, stable, undecided)}</g>'
        for k, (r, values) in enumerate(zip(found.ranges, found.values.T, strict=True))
    ]
    size = WIDE + LEFT + 20.0, len(panels) * tall
    return sheet(size, "Share of samples that stand", panels, letters=13.0, white=False)


def _panel(name: str, values: Floats, stable: Bools, undecided: Bools) -> str:
    low, high = float(values.min()), float(values.max())
    span = high - low or 1.0
    place = np.minimum(((values - low) / span * BINS).astype(int), BINS - 1)
    step = WIDE / BINS
    levels = [(TOP + HIGH * (1.0 - share), f"{100 * share:.0f} %") for share in (0.0, 0.5, 1.0)]
    ticks = [(LEFT + k * step, f"{low + span * k / BINS:.4g}") for k in range(0, BINS + 1, 2)]
    parts = [text(LEFT, TOP - 12.0, escape(name)), grid(LEFT, WIDE, levels, ticks, TOP + HIGH + 18.0)]
    for k in range(BINS):
        here = place == k
        n, stand, open_ = int(here.sum()), int((here & stable).sum()), int((here & undecided).sum())
        if n:
            parts.append(_bar(LEFT + k * step, step, n, stand, open_))
    return "".join(parts)


def _bar(x: float, step: float, n: int, stand: int, undecided: int) -> str:
    """One tenth: what stands, what is undecided on top of it, and how sure that is."""
    tall, pale = HIGH * stand / n, HIGH * undecided / n
    low, high = share_between(stand, n)[0], share_between(stand + undecided, n)[1]
    top, middle, wide = TOP + HIGH, x + step / 2.0, step - 4.0
    return (
        rect(x + 2.0, top - tall, wide, tall, f'fill="{ACCENT["stable"]}"')
        + rect(x + 2.0, top - tall - pale, wide, pale, f'fill="{ACCENT["undecided"]}" opacity=".35"')
        + f'<path d="M{middle:.1f} {top - HIGH * low:.1f}V{top - HIGH * high:.1f}" stroke="{INK}" stroke-width="1.5"/>'
        + f"<title>{stand} of {n} stand, {undecided} undecided</title>"
    )
