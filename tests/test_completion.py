"""Completion by the shell, as bash really does it; and what every shell's script asks for."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cyclopean.cli.app import program
from cyclopean.cli.completion import ASKED, SCRIPTS, candidates

PROGRAM = program()
BASH = Path("/bin/bash")


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["che"], ["check"]),
        (["make", "sta"], ["stack"]),
        (["check", "arch.json", "--sup"], ["--supports"]),
        (["check", "arch.json", "--method", ""], ["cra", "rbe"]),
        (["check", "--method", "r"], ["rbe"]),
        (["check", "--method", "=", "r"], ["rbe"]),  # as bash breaks words
        (["check", "--method", "="], ["cra", "rbe"]),
        (["check", "--method=c"], ["--method=cra"]),  # as zsh does not
        (["check", "--nothing=c"], []),
        (["make", "arch", "12", "--springers", "w"], ["wedges"]),
        (["completion", ""], ["bash", "zsh", "fish"]),
        (["completion", "bash", ""], []),
        (["check", ""], []),  # a file
        (["check", "--json", "re"], []),  # a file
        (["nonsense", "--mu"], []),
        (["make", "arch", "--mu", "0.7", "--thi"], ["--thickness"]),
        (["verify", "stack", "--j"], ["--json"]),  # a file of the name of a command
    ],
)
def test_candidates(words, offered) -> None:
    assert candidates(PROGRAM, words) == offered


def test_every_command_is_offered() -> None:
    assert candidates(PROGRAM, [""]) == candidates(PROGRAM, []) == sorted(PROGRAM.commands)


def test_every_option_is_offered() -> None:
    options = candidates(PROGRAM, ["check", "--"])
    assert {"--mu", "--certificate", "--help"} <= set(options)
    assert "--ground" in candidates(PROGRAM, ["make", "stack", "--"])
    assert "--no-ground" in candidates(PROGRAM, ["make", "stack", "--"])


def answered(script: str, typed: str) -> list[str]:
    """What bash offers for a line, by the function that the script registers for the program."""
    words = typed.split(" ")
    program = f"""
{script}
cyclopean() {{ "{sys.executable}" -m cyclopean "$@"; }}
COMP_WORDS=({" ".join(f"'{word}'" for word in words)}); COMP_CWORD={len(words) - 1}
[[ $(complete -p cyclopean) =~ -F\\ ([a-z_]+) ]] && "${{BASH_REMATCH[1]}}" cyclopean
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    environment = {**os.environ, "PYTHONWARNINGS": "error"}
    done = subprocess.run(
        [BASH, "--norc", "-c", program], capture_output=True, text=True, check=True, env=environment, timeout=60
    )
    assert done.stderr == ""
    return done.stdout.split()


@pytest.mark.skipif(not BASH.exists(), reason="there is no bash")
def test_bash_completes(run) -> None:
    status, script, _ = run("completion", "bash")
    assert status == 0
    assert answered(script, "cyclopean che") == ["check"]
    assert answered(script, "cyclopean check wall.json --me") == ["--method"]
    assert answered(script, "cyclopean check ") == []


@pytest.mark.parametrize("shell", sorted(SCRIPTS))
def test_scripts_ask_as_the_program_answers(run, shell, monkeypatch) -> None:
    status, script, said = run("completion", shell)
    assert (status, said) == (0, "")
    assert f"{ASKED}=1" in script
    monkeypatch.setenv(ASKED, "1")
    assert run("verif") == (0, "verify\n", "")
    assert run("check", "no such file") == (0, "", "")


def test_another_shell_is_refused(run) -> None:
    assert run("completion", "tcsh") == (2, "", "cyclopean: error: SHELL: 'tcsh' is not one of bash, fish, zsh\n")
