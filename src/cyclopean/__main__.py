"""`python -m cyclopean` is the same as `cyclopean`."""

from cyclopean.cli import process

if __name__ == "__main__":
    process()
