"""`python -m cyclopean` is the same as `cyclopean`."""

from cyclopean.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
