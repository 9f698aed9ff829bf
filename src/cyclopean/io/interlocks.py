"""The interlock of a wall as plain data."""

from typing import Any

from cyclopean.design.walls.front import WallInterlock
from cyclopean.io.files import plain

__all__ = ["interlock_dict"]


def interlock_dict(found: WallInterlock) -> dict[str, Any]:
    """The score J and the rules of masons, for JSON; None where a wall has nothing to measure."""
    one = found.interlock
    rules = plain(one.rules)
    return {
        "seen": found.seen,
        "along": plain(found.along),
        "size": plain(found.size),
        "J": one.score,
        "courses": found.courses,
        "tolerance": one.tolerance,
        "head_joints": len(one.head),
        "head_length": one.head_length,
        "aligned_length": one.aligned_length,
        "crossings": len(one.crossings),
        "running": [{"length": joint.length, "courses": joint.courses} for joint in one.running],
        "minimum_trace": None if rules["trace"] is None else found.minimum_trace,
        "rules": rules,
        "masons": plain(found.masons),
    }
