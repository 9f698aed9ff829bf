"""The command line: the only room that prints or exits. Heavy libraries are imported inside the commands."""

import sys

__all__ = ["main"]


def main(argv: list[str] | None = None) -> int:
    """Run one command and return its exit status.

    Parameters
    ----------
    argv : list of str, optional
        Arguments without the program's name; those of the process by default.
    """
    try:
        from cyclopean.cli.app import run  # here, so that an interrupt while it loads ends quietly too

        return run(sys.argv[1:] if argv is None else list(argv))
    except KeyboardInterrupt:
        sys.stderr.write("cyclopean: error: interrupted\n")
        return 130
