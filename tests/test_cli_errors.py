"""What every command owes its caller: one line on stderr, the right status, no traceback; light to start."""

import os
import subprocess
import sys

import pytest

from cyclopean import analysis
from cyclopean.errors import SolverError

ENTRY = [sys.executable, "-m", "cyclopean"]


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["bogus"], "bogus"),
        (["--bogus"], "--bogus"),
        (["check"], "MODEL"),
        (["check", "a", "b"], "b"),
        (["check", "a", "--bogus"], "--bogus"),
        (["check", "a", "--json"], "--json"),
        (["check", "a", "--json", "--mu"], "--json"),
        (["check", "a", "--mu", "x"], "--mu"),
        (["check", "a", "--mu", "inf"], "--mu"),
        (["check", "a", "--mu", "-1"], "--mu"),
        (["check", "a", "--density", "0"], "--density"),
        (["check", "a", "--density", "1_0"], "--density"),
        (["check", "a", "--tolerance", "nan"], "--tolerance"),
        (["check", "a", "--gravity", "1,2"], "--gravity"),
        (["check", "a", "--gravity", "-1,0,nan"], "--gravity: 'nan' is not a finite number"),
        (["check", "a", "--gravity", ""], "--gravity"),
        (["check", "a", "--tilt", "1,2,3"], "--tilt"),
        (["check", "a", "--tilt", "inf"], "--tilt"),
        (["check", "a", "--solver", "magic"], "expected one of auto, newton, interior, clarabel, osqp"),
        (["check", "a", "--solver", "magic"], "pip install 'cyclopean[osqp]'"),
        (["check", "a", "--method", "fem"], "--method"),
        (["check", "a", "--method", ""], "--method"),
        (["check", "a", "--method", "cra", "--weights", "1,2"], "use --method rbe"),
        (["check", "a", "--method", "cra", "--solver", "newton"], "use --method rbe"),
        (["check", "a", "--eps", "0"], "--eps"),
        (["check", "a", "--eps", "-1"], "--eps"),
        (["check", "a", "--eps", "wide"], "--eps: 'wide' is not a number"),
        (["check", "a", "--eta", "0"], "--eta"),
        (["check", "a", "--eta", "0.5"], "--eta 0.5: must not be smaller than eps (1), by which points overlap"),
        (["check", "a", "--eps", "20", "--eta", "10"], "--eta 10: must not be smaller than eps (20)"),
        (["check", "a", "--eta", "nan"], "--eta"),
        (["check", "a", "--eta", "1e9"], "--eta"),
        (["check", "a", "--beta-min", "0"], "--beta-min"),
        (["check", "a", "--beta-min", "x"], "--beta-min"),
        (["check", "a", "--beta-min", "11"], "--beta-min 11: must be smaller than eta (10)"),
        (["check", "a", "--eps", "1e-90", "--eta", "1e12"], "--beta-min"),
        (["check", "a", "--seconds", "0"], "--seconds"),
        (["check", "a", "--seconds", "inf"], "--seconds"),
        (["check", "a", "--nodes", "0"], "--nodes"),
        (["check", "a", "--nodes", "2.5"], "--nodes: '2.5' is not a whole number"),
        (["check", "a", "--nodes", "many"], "--nodes"),
        (["check", "missing.json"], "missing.json"),
        (["check", "."], "."),
        (["info"], "MODEL"),
        (["info", "missing.json"], "missing.json"),
        (["convert", "a"], "OUT"),
        (["verify"], "CERTIFICATE"),
        (["verify", "missing.json"], "missing.json"),
        (["verify", "."], "."),
        (["make"], "command"),
        (["make", "tower"], "tower"),
        (["make", "wall", "3"], "COURSES"),
        (["make", "wall", "3", "3"], "--out"),
        (["make", "wall", "3", "x", "--out", "w.json"], "COURSES"),
        (["make", "wall", "0", "3", "--out", "w.json"], "columns"),
        (["make", "stack", "3", "--size", "1,1", "--out", "w.json"], "--size"),
        (["make", "arch", "9", "--span", "2", "--rise", "1.5", "--out", "w.json"], "rise"),
        (["demo", "--out", "nowhere"], "nowhere"),
    ],
)
def test_bad_input_is_one_line_and_status_2(run, argv, said):
    status, out, err = run(*argv)
    assert (status, out) == (2, "")
    assert err.startswith("cyclopean: error: ")
    assert err.count("\n") == 1
    assert said in err
    assert os.listdir() == []


@pytest.mark.parametrize(
    "argv", [["--help"], ["-h"], ["check", "--help"], ["make", "--help"], ["make", "dome", "--help"]]
)
def test_help(run, argv):
    status, out, err = run(*argv)
    assert (status, err) == (0, "")
    assert "Usage: cyclopean" in out


@pytest.mark.parametrize("argv", [["--version"], ["--version", "check"]])
def test_version(run, argv):
    assert run(*argv) == (0, "cyclopean 0.1.0\n", "")


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (KeyboardInterrupt(), 130, "interrupted"),
        (SolverError("no solver came through"), 3, "no solver came through"),
        (MemoryError(), 2, "memory"),
        (OSError(28, "No space left on device", "r.json"), 2, "r.json: no space left on device"),
        (ZeroDivisionError("by nought\nat all"), 70, "ZeroDivisionError"),
    ],
)
def test_what_goes_wrong_inside_never_looks_like_a_verdict(run, monkeypatch, error, status, said):
    def fail(*_, **__):
        raise error

    run("make", "stack", 2, "--out", "m.json")
    monkeypatch.setattr(analysis, "check", fail)
    found, out, err = run("check", "m.json", "--json", "r.json")
    assert (found, out) == (status, "")
    assert err.startswith("cyclopean: error: ")
    assert err.count("\n") == 1
    assert said in err
    assert os.listdir() == ["m.json"]


def test_file_names_with_strange_characters_stay_on_one_line(run):
    for argv in (["check", "a\nb\x1b[31m.json"], ["check", "a", "--json", "a\nb\x1b[31m/r.json"]):
        status, _, err = run(*argv)
        assert status == 2
        assert err.count("\n") == 1
        assert "\x1b" not in err


def test_start_up_imports_nothing_heavy():
    heavy = {"numpy", "scipy", "shapely", "rich", "pydantic"}
    for argv in (["--version"], ["--help"], ["verify", "missing.json"], ["make", "wall", "3", "x", "--out", "w.json"]):
        code = f"import sys, cyclopean.cli as c; c.main({argv}); print('heavy:', *({heavy} & set(sys.modules)))"
        answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert answer.stdout.endswith("heavy:\n")


def test_as_a_program(tmp_path):
    answer = subprocess.run(
        [*ENTRY, "check", "missing.json"], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert (answer.returncode, answer.stdout) == (2, "")
    assert answer.stderr.count("\n") == 1


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_a_full_disk_is_told():
    with open("/dev/full", "w") as full:
        answer = subprocess.run([*ENTRY, "--version"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert answer.returncode == 2
    assert answer.stderr == "cyclopean: error: standard output: no space left on device\n"


@pytest.mark.skipif(os.name == "nt", reason="pipes close differently there")
@pytest.mark.parametrize("argv", [["--help"], ["--version"], ["make", "wall", "3", "3", "--out", "w.json"]])
def test_a_reader_that_leaves_gets_no_complaint(tmp_path, argv):
    read, write = os.pipe()
    os.close(read)
    answer = subprocess.run([*ENTRY, *argv], stdout=write, stderr=subprocess.PIPE, text=True, cwd=tmp_path, check=False)
    os.close(write)
    assert (answer.returncode, answer.stderr) == (141, "")


def test_a_check_does_not_load_what_walls_are_designed_with():
    """Start-up: reading a model takes no pattern, no surface, no stone."""
    code = "import sys, cyclopean.io; print([m for m in sys.modules if m.startswith('cyclopean.design')])"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout == "[]\n"
