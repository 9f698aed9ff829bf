"""How many examples a law is tried on: a quarter of them by default, all of them by `--thorough`."""

__all__ = ["chosen", "examples", "quick"]

_THOROUGH = [False]
FEWEST = 5  # below that hypothesis tries little more than zeros and ones


def chosen(thorough: bool) -> None:
    """Say once, before any test is imported, which of the two is wanted."""
    _THOROUGH[0] = thorough


def quick() -> bool:
    """Whether this is the run of every change, not the nightly one."""
    return not _THOROUGH[0]


def examples(thorough: int) -> int:
    """How many examples a law gets that is given so many at night."""
    return max(thorough // 4, min(thorough, FEWEST)) if quick() else thorough
