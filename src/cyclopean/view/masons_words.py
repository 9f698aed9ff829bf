"""The rules of masons as they are told."""

from cyclopean.design.rubble.masons_rules import MasonsRules

__all__ = ["lines"]


def lines(m: MasonsRules) -> list[str]:
    """What was measured, in plain words."""
    said = [
        f"void: {m.void:.0%} between the faces, {m.void_tops:.0%} below the stones' own tops",
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
