"""`doctor`: what it finds here, and what it says where something is broken or missing."""

import json
import os
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

from cyclopean.cli import doctor

PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
TORN = "raise OSError('libtorn.so.1: cannot open shared object file')"


@pytest.fixture
def quick(monkeypatch):
    """Without the extras, some of which take seconds to import."""
    monkeypatch.setattr(doctor, "EXTRAS", {"plot": (("no-such-distribution", "none"),)})


def distributions(requirements: list[str]) -> list[str]:
    return sorted("".join(c if c not in "<>=[" else " " for c in r).split()[0] for r in requirements)


def test_it_looks_at_what_the_project_needs() -> None:
    assert sorted(name for name, _ in doctor.CORE) == distributions(PROJECT["dependencies"])
    wanted = {name: distributions(needs) for name, needs in PROJECT["optional-dependencies"].items()}
    assert {name: sorted(dist for dist, _ in pairs) for name, pairs in doctor.EXTRAS.items()} == wanted
    assert doctor.FOR_WHAT.keys() == wanted.keys()


def test_here_the_core_works(run, quick, monkeypatch, tmp_path) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    (cache / "stones-1.npz").write_bytes(b"x" * 1000)
    monkeypatch.setenv("CYCLOPEAN_CACHE", str(cache))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    status, printed, said = run("doctor", "--json", "-")
    data = json.loads(printed)
    assert (status, said, data["works"]) == (0, "", True)
    assert data["core"][0] == {"name": "numpy", "version": np.__version__, "error": None}
    assert data["self_test"]["error"] is None
    assert 0.0 < data["self_test"]["seconds"] < 30.0
    assert data["cache"] == {"folder": str(cache), "files": 1, "bytes": 1000}
    assert data["temporary"]["writable"] is True
    assert data["threads"]["set"]["OMP_NUM_THREADS"] == "1"
    assert data["threads"]["cores"] >= 1


def test_what_it_prints_is_for_a_person(run, quick) -> None:
    status, printed, _ = run("doctor", "--json", "doctor.json")
    assert status == 0
    assert printed.endswith("\nthe core works\n")
    assert f"numpy {np.__version__}" in printed
    assert "  plot       missing: pip install 'cyclopean[plot]' (plots)" in printed
    assert json.loads(Path("doctor.json").read_text())["extras"]["plot"]["there"] is False


@pytest.mark.parametrize("module", ["numpy", "osqp"])
def test_a_broken_package_is_named_and_nothing_crashes(module, tmp_path) -> None:
    """numpy is of the core: status 1; osqp is an extra: status 0."""
    (tmp_path / module).mkdir()
    (tmp_path / module / "__init__.py").write_text(TORN)
    few = "{'osqp': doctor.EXTRAS['osqp']}"
    program = f"import sys; from cyclopean.cli import doctor, main; doctor.EXTRAS = {few}; sys.exit(main(['doctor']))"
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        timeout=60,
    )
    assert done.stderr == ""
    assert "OSError: libtorn.so.1: cannot open shared object file" in done.stdout
    if module == "numpy":
        assert done.returncode == 1
        assert "pip install --force-reinstall numpy" in done.stdout
        assert "self-test  FAILED" in done.stdout
        assert done.stdout.endswith("something of the core is BROKEN\n")
    else:
        assert done.returncode == 0
        assert f"osqp {metadata.version('osqp')} is broken" in done.stdout
        assert "pip install 'cyclopean[osqp]'" in done.stdout


def test_a_wrong_verdict_is_a_broken_core(run, quick, monkeypatch) -> None:
    from cyclopean import analysis

    monkeypatch.setattr(analysis, "check", lambda model: falling)
    falling = analysis.Result(None, None, None, "cra", "undecided", "", {}, None, {})
    status, printed, _ = run("doctor")
    assert status == 1
    assert "FAILED: three cubes came out undecided" in printed


def test_a_folder_that_cannot_be_written_is_told(run, quick, monkeypatch) -> None:
    monkeypatch.setattr(doctor.tempfile, "tempdir", "/no/such/folder")
    status, printed, _ = run("doctor")
    assert status == 0
    assert "CANNOT be written" in printed


@pytest.mark.parametrize(
    ("words", "reason"),
    [(("--json", "missing/doctor.json"), "missing"), (("--jsn",), "No such option: --jsn"), (("all",), "unexpected")],
)
def test_bad_usage(run, words, reason) -> None:
    status, printed, said = run("doctor", *words)
    assert (status, printed, said.count("\n")) == (2, "", 1)
    assert reason in said
