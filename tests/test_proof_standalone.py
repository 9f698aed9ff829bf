"""The checker as a file of its own, as a module, and as a function of files."""

import ast
import json
import shutil
import subprocess
import sys

import pytest

from cyclopean import proof
from cyclopean.proof import NotACertificateError, checker, verify, verify_file
from test_proof_checker import cube_on_ground, overhang

SOURCE = checker.__file__


@pytest.fixture
def written(tmp_path):
    def write(content, name="cert.json"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else json.dumps(content).encode())
        return path

    return write


def test_it_imports_the_standard_library_only():
    with open(SOURCE, encoding="utf-8") as file:
        tree = ast.parse(file.read())
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            names.add(node.module.split(".")[0])
        elif isinstance(node, ast.Name):
            assert node.id not in {"__import__", "eval", "exec", "compile"}
    assert names
    assert names <= sys.stdlib_module_names


def test_it_runs_alone(tmp_path, written):
    """Copied away from the package, without site-packages and without the environment."""
    alone = shutil.copy(SOURCE, tmp_path / "checker.py")
    good, bad = written(overhang()), written({**cube_on_ground(), "tolerance": 0}, "bad.json")
    for path, status in ((good, 0), (bad, 1), (tmp_path / "none.json", 2)):
        run = subprocess.run([sys.executable, "-I", "-S", alone, path], capture_output=True, text=True, cwd=tmp_path)
        assert run.returncode == status, run.stderr
        assert "Traceback" not in run.stderr
        assert bool(run.stdout) is (status < 2)


def test_it_runs_as_a_module(written):
    run = subprocess.run(
        [sys.executable, "-m", "cyclopean.proof", written(cube_on_ground())], capture_output=True, text=True
    )
    assert run.returncode == 0
    assert run.stdout.startswith("PROVED: stable under rigid-block equilibrium; every block balances exactly\n")


def test_a_file_answers_as_the_object_does(written):
    for certificate in (cube_on_ground(), overhang(), {**overhang(), "seal": ""}):
        assert verify_file(written(certificate)) == verify(certificate)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"solid cube",
        b'{"schema": "cyclopean.certificate/1"',
        b"\xff\xfe\x00",
        b"[" * 200_000,
        b"1" * 5000,
        [],
        {},
        {"schema": "cyclopean.model/1"},
        {"schema": 1},
        b'{"schema": "cyclopean.certificate/1", "kind": "rbe-state", "kind": "rbe-mechanism"}',
    ],
)
def test_what_is_no_certificate_at_all_raises(written, content, capsys):
    path = written(content)
    with pytest.raises(NotACertificateError):
        verify_file(path)
    assert checker.main([str(path)]) == 2
    out, err = capsys.readouterr()
    assert not out
    assert err.count("\n") == 1
    assert "cert.json" in err


def test_a_file_that_cannot_be_read(tmp_path, capsys):
    for path in (tmp_path, tmp_path / "none.json"):
        with pytest.raises(OSError):
            verify_file(path)
        assert checker.main([str(path)]) == 2
        assert "cannot be read" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [[], ["a", "b"], ["--help"], [""], ["a\0b"]])
def test_usage(arguments, capsys):
    assert checker.main(arguments) == 2
    out, err = capsys.readouterr()
    assert not out
    assert err.count("\n") == 1


@pytest.mark.parametrize("text", ["NaN", "Infinity", "-Infinity", "1e400", "true", '"1"', "null"])
def test_a_number_that_is_none_is_answered_not_raised(written, text, capsys):
    content = json.dumps(cube_on_ground()).replace("-9.8125", text).encode()
    path = written(content)
    assert not verify_file(path).proved
    assert checker.main([str(path)]) == 1
    assert capsys.readouterr().out.startswith("NOT PROVED: stable")


def test_formatting_of_the_file_does_not_break_the_seal(written):
    content = json.dumps(cube_on_ground(), indent=4, sort_keys=True).encode("utf-16")
    assert verify_file(written(content)).proved


def test_public_names_of_the_room():
    assert proof.__all__ == sorted(proof.__all__)
    assert all(hasattr(proof, name) for name in proof.__all__)
