"""The rules of masons as they are told."""

from dataclasses import replace

from cyclopean.design.rubble.masons_rules import MasonsRules
from cyclopean.design.walls.front import WallInterlock

SEEN = {
    "drawing": "by the drawing that the model carries",
    "joints": "by the joints that its stones share",
    "elevation": "by an elevation of its front: stones that do not share their joints",
}


def lines(m: MasonsRules) -> list[str]:
    """What was measured, in plain words."""
    said = [
        f"void: {max(m.void, 0.0):.0%} between the faces, {max(m.void_tops, 0.0):.0%} below the stones' own tops",
        f"faces: stone in {m.face:.0%} of the front and {m.face_back:.0%} of the back; the top varies by "
        f"{1e3 * m.top:.0f} mm",
        f"tied: {m.through_stones:.1f} through-stones and {m.binders:.1f} binders to the m2 of face",
    ]
    if m.joint_overlap_least is not None and m.joint_overlap_median is not None:
        said.append(
            f"bond: of {m.head_joints} head joints half are covered by at least {1e3 * m.joint_overlap_median:.0f} mm, "
            f"all by {1e3 * m.joint_overlap_least:.0f} mm"
        )
    if m.running_joints:
        said.append(f"running joints: {m.running_joints}, the longest {1e3 * m.running_joint_longest:.0f} mm")
    if m.length_into_wall is not None:
        said.append(f"length: stones of the face reach {m.length_into_wall:.2f} times as far into the wall as along it")
    if m.trace_least is not None and m.trace_median is not None:
        said.append(
            f"trace: the line of minimum trace has {1e3 * m.trace_least:.0f} mm to the metre of height, median "
            f"{1e3 * m.trace_median:.0f} mm"
        )
    return said


def interlock_lines(found: WallInterlock) -> list[str]:
    """How the stones of a wall interlock, in plain words; the score and lengths below."""
    one, masons = found.interlock, found.masons
    runs = "no two head joints stand above each other"
    if one.running:
        most = max(joint.courses for joint in one.running)
        places = "1 place" if len(one.running) == 1 else f"{len(one.running)} places"
        runs = f"head joints stand above each other in {places}, through up to {most} courses"
    corners = f"{len(one.crossings)} corner{'' if len(one.crossings) == 1 else 's'} of four stones"
    said = [f"interlock: {runs}; {corners}; {SEEN[found.seen]}"]
    if found.size is not None and found.along is not None:
        long, wide, high = found.size.tolist()
        way = ", ".join(f"{x + 0.0:.3g}" for x in found.along.tolist())
        said.append(f"  wall      {long:.4g} m along ({way}), {wide:.3g} m through, {high:.4g} m up")
    said.append(
        f"  J         {one.score:.3f}: {one.aligned_length:.3g} of {one.head_length:.3g} m of head joints aligned, "
        f"within {1e3 * one.tolerance:.3g} mm and by {found.courses} courses"
    )
    said.append(f"  trace     {_trace(found)}")
    if one.rules.overlap == one.rules.overlap:
        least = f"the least by {one.rules.least_overlap:.0%}; half is best"
        said.append(f"  overlap   stones lap head joints by {one.rules.overlap:.0%} of their length, {least}")
    rest = [] if masons is None else lines(replace(masons, trace_least=None))
    return said + ["  " + line for line in rest]


def _trace(found: WallInterlock) -> str:
    """The line of minimum trace in words."""
    if found.minimum_trace != found.minimum_trace:
        return "none: no joints lead from the foot to the top"
    least = f"{found.minimum_trace:.0f} mm to the m of height along joints (line of minimum trace; 1000 = straight up)"
    median = None if found.masons is None else found.masons.trace_median
    return least if median is None else f"{least}, median {1e3 * median:.0f}"
