"""Courses of sawn stones: which slots there are, which piece of the stock fills each, and what stays open.

A course is laid from left to right between the ends of the wall, the jambs of openings and lintels. Slots come from
the bond, or follow the lengths of the stones found; a rule chooses the piece for each. Every step returns a new stock,
so a course that turns out to have gaps can be tried again in another height.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cyclopean.arrays import Bools, Floats
from cyclopean.design.ashlar.bonds import Span, best_joint, clipped, course_spans, relieved, tied
from cyclopean.design.ashlar.planning import BEARING, AshlarSettings, Gap, LaidStone, Plan, Slot, bearing_of, candidates
from cyclopean.design.ashlar.stock import SAME, Stock, saw
from cyclopean.design.walls.openings import Opening
from cyclopean.errors import InputError

__all__ = ["lay"]


@dataclass(frozen=True, slots=True)
class _Segment:
    """A part of a course between ends of the wall, jambs and lintels: joints, and where stone must end."""

    low: float
    high: float
    clip: tuple[float, float]


@dataclass(slots=True)
class _Work:
    """One course while it is laid."""

    plan: Plan
    stock: Stock
    number: int
    low: float
    band: tuple[float, float]
    below: tuple[Floats, Floats]  # joints of the course below, in front and at the back
    headed: frozenset[int]  # openings that have their lintels
    laid: list[LaidStone] = field(default_factory=list)
    gaps: list[Gap] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    refused: str = ""  # why an opening below has no lintel

    def candidates(self, wanted: Floats) -> tuple[Floats, Bools]:
        """Sizes (p, 2, 3) of all pieces and which can be sawn to a slot (m), but for those set aside for lintels."""
        sizes, fits = candidates(self.stock, wanted, self.band, self.plan.settings.yaw)
        aside = [i for k, of in self.plan.held.items() if k not in self.headed for i in of]
        return sizes, fits & ~np.isin(self.stock.slab, aside)[:, None]


def lay(plan: Plan, stock: Stock) -> tuple[list[LaidStone], Stock, list[Gap], list[str]]:
    """Lay course upon course, until the wall is high enough or a course has a gap."""
    settings = plan.settings
    nothing = np.zeros(0)
    work = _Work(plan, stock, -1, 0.0, (0.0, 0.0), (nothing, nothing), frozenset())
    laid: list[LaidStone] = []
    gaps: list[Gap] = []
    notes: list[str] = []
    top, bands = 0.0, list(plan.bands)
    while not gaps and (some := _fitting(plan.bands, top, settings.height)):
        tried: list[_Work] = []
        for band in _fitting(bands, top, settings.height):
            tried = [_course(work, top, band)]
            if not (tried[0].gaps or tried[0].refused):
                break
        else:  # no height has stones enough for a whole course: the fullest of all
            tried = [_course(work, top, band) for band in some]
        usable = [one for one in tried if not one.refused]
        if not usable:
            raise InputError(tried[0].refused)
        work = max(usable, key=lambda one: sum(float(np.prod(s.slot.size)) for s in one.laid))
        if not work.laid:
            break
        bands = [band for band in bands if band <= work.band]
        laid += work.laid
        gaps += work.gaps
        notes += work.notes
        top = round(top + work.band[0] + settings.bed, 9)
    return laid, work.stock, gaps, [*notes, *_what_is_missing(plan, work, gaps, laid)]


def _fitting(bands: Sequence[tuple[float, float]], top: float, height: float) -> list[tuple[float, float]]:
    return [band for band in bands if top + band[0] <= height + SAME]


def _what_is_missing(plan: Plan, work: _Work, gaps: Sequence[Gap], laid: Sequence[LaidStone]) -> list[str]:
    """Gaps, missing lintels and the height that is left, one line each."""
    settings = plan.settings
    where = {0: " in front" if settings.leaf_count == 2 else "", 1: " at the back", -1: ""}
    notes = [f"course {g.course + 1}: gap from x = {g.low:.3f} to {g.high:.3f} m{where[g.leaf]}" for g in gaps]
    top = max((s.slot.high[2] for s in laid), default=0.0)
    for k, one in enumerate(settings.openings):
        if one.sill >= top - SAME:
            continue
        if k not in work.headed:
            notes.append(f"opening {k + 1}: has no lintel, the wall ends below it")
        cut = [(a, b) for a, b in {(s.slot.low[2], s.slot.high[2]) for s in laid} if _cuts(one, a, b)]
        foot, head = min(a for a, _ in cut), max(b for _, b in cut)
        if abs(foot - one.sill) > SAME or (abs(head - one.top) > SAME and k in work.headed):
            notes.append(f"opening {k + 1}: reaches from {foot:g} to {head:g} m, as courses go")
    short = settings.height - top
    if short > SAME and not gaps:
        notes.append(f"the wall is {top:g} m high; {short:g} m is no course, or there is no stock for it")
    return notes


def _course(before: _Work, low: float, band: tuple[float, float]) -> _Work:
    """Lay one course of a height (m) on the one before."""
    plan, settings = before.plan, before.plan.settings
    joints = tuple(_joints(before, leaf) for leaf in (0, 1))
    work = _Work(plan, before.stock, before.number + 1, low, band, (joints[0], joints[1]), before.headed)
    holes = [one for one in settings.openings if _cuts(one, low, low + band[0])]
    over = [
        k
        for k, one in enumerate(settings.openings)
        if k not in before.headed and one not in holes and one.top <= low + SAME
    ]
    lintels = [span for k in over if (span := _lintel(work, k)) is not None]
    work.headed = before.headed | set(over)
    spans = course_spans(
        settings.bond, work.number, settings.length + settings.head, plan.unit, plan.header, settings.stagger
    )
    if settings.through:
        first = (settings.through + 1) // 2 % settings.through if work.number % 2 else 0
        spans = tied(spans, settings.through, first, None if plan.wide else plan.header)
    for segment in _segments(settings, holes, lintels):
        if plan.found:
            for leaf in range(settings.leaf_count):
                _fill_as_found(work, segment, leaf)
        else:
            _fill_bond(work, segment, spans)
    return work


def _cuts(opening: Opening, low: float, high: float) -> bool:
    """Whether an opening takes stone out of a course between two heights (m)."""
    return opening.sill < high - SAME and opening.top > low + SAME


def _joints(work: _Work, leaf: int) -> Floats:
    """Where stones of a leaf end that do not end at an end of the wall (m, middles of joints)."""
    settings = work.plan.settings
    ends = [x for s in work.laid if s.slot.leaf in (leaf, -1) for x in (s.cell_low[0], s.cell_high[0])]
    inner = [x for x in ends if SAME < x < settings.length - SAME]
    return np.unique(np.array(inner).round(9)) + settings.head / 2.0


def _segments(
    settings: AshlarSettings, holes: Sequence[Opening], lintels: Sequence[tuple[float, float]]
) -> list[_Segment]:
    """What of a course is left to fill between holes and lintels."""
    head = settings.head
    cuts = [(one.left + head, one.left + one.width, one.left, one.left + one.width) for one in holes]
    cuts += [(a, b, -np.inf, np.inf) for a, b in lintels]
    segments = []
    low, clip = 0.0, 0.0
    for right, left, end, start in [*sorted(cuts), (settings.length + head, np.inf, settings.length, 0.0)]:
        if right - head - low > SAME:
            segments.append(_Segment(low, right, (clip, end if np.isfinite(end) else np.inf)))
        low, clip = left, start if np.isfinite(start) else -np.inf
    return segments


# Slots


def _fill_bond(work: _Work, segment: _Segment, spans: Sequence[Span]) -> None:
    """Fill a part of a course as the bond has it."""
    plan, settings = work.plan, work.plan.settings
    below = np.union1d(*work.below)
    some = clipped(spans, segment.low, segment.high, plan.least)
    if plan.lap > 0.0:
        some = relieved(some, below, plan.lap, plan.least, plan.unit, plan.header)
    for span in some:
        if span.across and settings.leaf_count == 2:
            if _place(work, span, -1, segment):
                continue
            work.notes.append(f"course {work.number + 1}: no stone reaches through at x = {span.low:.3f} m")
        for leaf in range(settings.leaf_count):
            _fill(work, span, leaf, segment)


def _fill(work: _Work, span: Span, leaf: int, segment: _Segment) -> None:
    """Fill a span with one stone, with several where no piece is long enough, or note the gap."""
    plan, head = work.plan, work.plan.settings.head
    while not _place(work, span, leaf, segment):
        # no more than the longest piece that is high and deep enough
        sizes, fits = work.candidates(np.array([0.0, _depths(plan.settings, leaf)[1], work.band[0]]))
        longest = float(sizes[..., 0][fits].max(initial=0.0)) + head
        low, high = span.low + plan.least, min(span.low + longest, span.high - plan.least)
        joint = best_joint(low, high, work.below[leaf], span.low + longest)
        if joint is None or not _place(work, replace(span, high=joint, kind="closer"), leaf, segment):
            end = round(span.high - head, 9)
            last = work.gaps[-1] if work.gaps else None
            if last is not None and last.leaf == leaf and abs(last.high + head - span.low) <= SAME:
                work.gaps[-1] = replace(last, high=end)
            else:
                work.gaps.append(Gap(work.number, span.low, end, leaf))
            return
        span = replace(span, low=joint, kind="closer")


def _fill_as_found(work: _Work, segment: _Segment, leaf: int) -> None:
    """Fill a part of a course with stones as long as they are, cut only where nothing else breaks the joints."""
    plan, settings = work.plan, work.plan.settings
    low = segment.low
    while segment.high - settings.head - low > SAME:
        end = segment.high
        if end - low > plan.unit + SAME:  # not yet the last stone: where shall the next joint be?
            near = low + plan.unit
            room = best_joint(max(low + plan.least, near - plan.lap), min(near + plan.lap, end), work.below[leaf], near)
            end = near if room is None else room
            end = segment.high if segment.high - end < plan.least else end
        span = Span(low, end, "stretcher")
        joint = _found_length(work, span, segment, leaf)
        if joint is not None and _place(work, replace(span, high=joint), leaf, segment, exact=True):
            low = joint
            continue
        before = len(work.gaps)
        _fill(work, replace(span, kind="closer"), leaf, segment)
        if len(work.gaps) > before:
            work.gaps[-1] = replace(work.gaps[-1], high=round(segment.high - settings.head, 9))
            return
        low = end


def _found_length(work: _Work, span: Span, segment: _Segment, leaf: int) -> float | None:
    """End of the stone that the rule chooses for a slot among those that need not be cut to length; None = no one."""
    plan, settings = work.plan, work.plan.settings
    wanted = _slot(work, span, leaf).size
    sizes, fits = work.candidates(wanted * [0.0, 1.0, 1.0])
    ends = (span.low + sizes[..., 0] + settings.head).round(9)
    last = np.abs(ends - segment.high) <= SAME
    far = np.abs(ends[..., None] - work.below[leaf]).min(axis=-1, initial=np.inf)
    fits &= last | ((ends <= segment.high - plan.least + SAME) & (far >= plan.lap - SAME))
    fits &= sizes[..., 0] >= settings.least
    chosen = plan.rule(sizes, fits, wanted)
    if chosen is None:
        return None
    return float(ends[chosen[0], int(chosen[1])]) if not last[chosen[0], int(chosen[1])] else segment.high


def _place(work: _Work, span: Span, leaf: int, segment: _Segment, *, exact: bool = False) -> bool:
    """Saw a stone for a span and lay it; False where nothing in store is large enough."""
    settings, slot = work.plan.settings, _slot(work, span, leaf)
    wanted = slot.size
    sizes, fits = work.candidates(wanted)
    if exact:
        fits &= np.abs(sizes[..., 0] - wanted[0]) <= SAME
    chosen = work.plan.rule(sizes, fits, wanted)
    if chosen is None:
        return False
    piece, turned = chosen
    work.stock, sawn = saw(work.stock, piece, wanted[[1, 0, 2]] if turned else wanted)
    half = np.array([settings.head, settings.head, settings.bed]) / 2.0
    low, high = np.array(slot.low) - half, np.array(slot.high) + half
    low[0], high[0] = max(low[0], segment.clip[0]), min(high[0], segment.clip[1])
    low[1:] = np.maximum(low[1:], 0.0)
    high[1] = min(high[1], settings.depth)
    work.laid.append(LaidStone(slot, low.round(9), high.round(9), sawn, turned))
    return True


def _depths(settings: AshlarSettings, leaf: int) -> tuple[float, float]:
    """Where a leaf begins, and how deep it is (m)."""
    if leaf == -1:
        return 0.0, settings.depth
    return leaf * (settings.leaf + settings.head), settings.leaf


def _slot(work: _Work, span: Span, leaf: int) -> Slot:
    settings = work.plan.settings
    y, depth = _depths(settings, leaf)
    low = (span.low, round(y, 9), work.low)
    high = (round(span.high - settings.head, 9), round(y + depth, 9), round(work.low + work.band[0], 9))
    return Slot(work.number, low, high, span.kind, 0 if settings.leaf_count == 1 else leaf)


def _lintel(work: _Work, opening: int) -> tuple[float, float] | None:
    """Lay the lintel of an opening: one through the wall, or one in each leaf. Returns its joints (m)."""
    settings = work.plan.settings
    one = settings.openings[opening]
    # what was set aside for this opening can be used, the rest cannot
    away = replace(work, headed=work.headed | {opening}, laid=[])
    for low, high in _lintel_ends(work, one):
        if not _clear(settings, opening, work, low, high - settings.head):
            continue
        span, segment = Span(low, high, "lintel", across=True), _Segment(low, high, (0.0, settings.length))
        if _place(away, span, -1, segment):
            break
        if settings.leaf_count == 2:
            tried = replace(away, laid=[])
            if _place(tried, span, 0, segment) and _place(tried, span, 1, segment):
                away.stock = tried.stock
                away.laid += tried.laid
                break
    else:
        work.refused = (
            f"`openings`: number {opening + 1} has no lintel: none {work.band[0]:g} m high and at least"
            f" {one.width + 2.0 * BEARING * bearing_of(one):g} m long is in store, or it would leave the wall or lie"
            " over the next opening"
        )
        return None
    work.stock = away.stock
    work.laid += away.laid
    return low, high


def _lintel_ends(work: _Work, one: Opening) -> list[tuple[float, float]]:
    """Joints (m) of lintels to try: one that breaks the joints below, then those of less and less bearing."""
    plan, settings = work.plan, work.plan.settings
    plain = []
    for share in (1.0, (1.0 + BEARING) / 2.0, BEARING):
        bearing = share * bearing_of(one)
        plain.append((round(one.left - bearing, 9), round(one.left + one.width + bearing + settings.head, 9)))
    low, high = plain[0]
    below = np.union1d(*work.below)
    if plan.lap > 0.0 and len(below):
        left = best_joint(low - 2.0 * plan.lap, low, below, low)
        right = best_joint(high, high + 2.0 * plan.lap, below, high)
        far = (np.abs(below - x).min() >= plan.lap - SAME for x in (low, high))
        kept = [
            x if ok or better is None else better for x, ok, better in zip((low, high), far, (left, right), strict=True)
        ]
        plain.insert(0, (kept[0], kept[1]))
    return plain


def _clear(settings: AshlarSettings, opening: int, work: _Work, low: float, high: float) -> bool:
    """Whether a lintel stays inside the wall, and away from other openings that cut this course."""
    top = work.low + work.band[0]
    others = [one for k, one in enumerate(settings.openings) if k != opening]
    beside = [one for one in others if _cuts(one, work.low, top)]
    ends = [(s.cell_low[0], s.cell_high[0]) for s in work.laid]  # other lintels
    taken = [*((one.left, one.left + one.width) for one in beside), *ends]
    return low >= 0.0 and high <= settings.length and all(high <= a + SAME or low >= b - SAME for a, b in taken)
