# ruff: noqa: T201
"""Look into a wheel and a source archive: what must be in, and what must not. Standard library only."""

import email
import sys
import tarfile
import zipfile
from pathlib import Path

MOST = 2_000_000  # bytes of a wheel: it holds Python, and no pictures


def in_wheel(path: Path) -> list[str]:
    """Faults of a wheel, one line each."""
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        info = next(name.split("/")[0] for name in names if name.endswith(".dist-info/METADATA"))
        said = email.message_from_string(archive.read(f"{info}/METADATA").decode())
        entry = archive.read(f"{info}/entry_points.txt").decode()
    wanted = ["cyclopean/py.typed", "cyclopean/__main__.py", "cyclopean/proof/checker.py", f"{info}/licenses/LICENSE"]
    faults = [f"lacks {name}" for name in wanted if name not in names]
    faults += [f"holds {name}" for name in names if not name.startswith(("cyclopean/", f"{info}/"))]
    faults += [f"holds {name}" for name in names if Path(name).suffix not in ("", ".py", ".typed", ".txt")]
    if "cyclopean = cyclopean.cli:process" not in entry:
        faults.append("has no command cyclopean")
    if said["License-Expression"] != "MIT" or said["Requires-Python"] != ">=3.11":
        faults.append(f"says licence {said['License-Expression']}, Python {said['Requires-Python']}")
    if said["Description-Content-Type"] != "text/markdown" or "# cyclopean" not in said.get_payload():
        faults.append("does not carry the README")
    if path.stat().st_size > MOST:
        faults.append(f"weighs {path.stat().st_size} bytes, more than {MOST}")
    return faults


def in_source(path: Path) -> list[str]:
    """Faults of a source archive, one line each."""
    with tarfile.open(path) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    wanted = ("LICENSE", "README.md", "pyproject.toml", "uv.lock", "run", "tests/test_docs.py", "docs/theory.md")
    faults = [f"lacks {name}" for name in wanted if name not in names]
    return faults + [f"holds {name}" for name in sorted(names) if name.startswith((".venv", ".uv/", ".git/", "demo/"))]


if __name__ == "__main__":
    found = [
        f"{path.name} {fault}"
        for path in map(Path, sys.argv[1:])
        for fault in (in_wheel(path) if path.suffix == ".whl" else in_source(path) if path.suffix == ".gz" else [])
    ]
    print("\n".join(found) or f"contents are as they should be: {', '.join(Path(p).name for p in sys.argv[1:])}")
    raise SystemExit(1 if found else 0)
