"""Certificates and their independent checker.

`checker` is one file that imports the standard library only. It can be copied anywhere and run there
(`python checker.py CERT.json`), and runs here as `python -m cyclopean.proof CERT.json`.
"""

from cyclopean.proof.checker import Memory, NotACertificateError, Report, read_file, seal, verify, verify_file

__all__ = ["Memory", "NotACertificateError", "Report", "read_file", "seal", "verify", "verify_file"]
