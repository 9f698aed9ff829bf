"""Everything that is raised on purpose.

CyclopeanError
├── InputError    the user's file, option or model is at fault; the message is one line that says what to do
└── SolverError   a solver failed or answered something that does not hold
"""

__all__ = ["CyclopeanError", "InputError", "SolverError"]


class CyclopeanError(Exception):
    """Root of every error this package raises on purpose."""


class InputError(CyclopeanError):
    """Bad input: one clear line that names the file, block or option, and the remedy."""


class SolverError(CyclopeanError):
    """A solver failed, or its answer did not survive our own check of it."""
