"""`python -m cyclopean.proof CERT.json`: check one certificate."""

import sys

from cyclopean.proof.checker import main

if __name__ == "__main__":
    sys.exit(main())
