"""Every command shows how it is used, and what it shows can be typed."""

import re
import shlex

import pytest

from cyclopean.cli.app import UsageError, program
from cyclopean.cli.examples import EXAMPLES
from test_docs import helped, known_commands

LINES = [(command, line) for command, lines in EXAMPLES.items() for line in lines]


def parsed(line: str) -> str:
    """Let the parser read an example without running it; which command it was.

    The parser refuses options that do not exist and misses those that have to be given.
    """
    words = shlex.split(line.partition(" >")[0])
    assert words[0] == "cyclopean"
    command, words, path = program(), words[1:], []
    while hasattr(command, "commands"):
        path.append(words.pop(0))
        command = command.commands[path[-1]]
    command.make_context(" ".join(path), words)
    return " ".join(path)


def test_every_command_has_two_examples_and_no_other_has() -> None:
    assert {" ".join(command) for command in known_commands()} == set(EXAMPLES)
    assert {len(lines) for lines in EXAMPLES.values()} == {2}


@pytest.mark.parametrize(("command", "line"), LINES, ids=lambda text: text)
def test_an_example_can_be_typed(command, line) -> None:
    assert parsed(line) == command


def test_a_wrong_example_is_found() -> None:
    with pytest.raises(UsageError):
        parsed("cyclopean check arch.json --no-such-option")
    with pytest.raises(UsageError):
        parsed("cyclopean make stack 3")


@pytest.mark.parametrize("command", sorted(EXAMPLES))
def test_the_help_shows_them_as_they_are_typed(command) -> None:
    shown = re.search(r"^Examples:\n((?:  .*\n)+)\Z", helped(*command.split()), re.MULTILINE)
    assert shown is not None
    assert tuple(line[2:] for line in shown[1].splitlines()) == EXAMPLES[command]
