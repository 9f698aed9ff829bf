"""Completion by the shell: the script that `completion` prints, and what it asks of this program.

The script runs the program itself with `_CYCLOPEAN_COMPLETE` set and the words typed so far as arguments, the last of
them the one to be completed (empty where it has not begun). The answer is one candidate a line; none means that a file
is wanted, and the shell offers these by itself. It is ours, not typer's, since ours also knows the words that an option
accepts, and fish's version there offers no files.
"""

import re
from typing import Annotated, Any

from cyclopean.cli.command import argument, command
from cyclopean.cli.terminal import say
from cyclopean.texts import choice

ASKED = "_CYCLOPEAN_COMPLETE"  # variable of the environment by which the script asks
CHOICES = re.compile(r"[a-z][a-z-]*(\|[a-z][a-z-]*)+")  # a metavar that lists the words it accepts

BASH = f"""\
# cyclopean completion bash > ~/.local/share/bash-completion/completions/cyclopean
_cyclopean() {{
    local IFS=$'\\n'
    COMPREPLY=( $({ASKED}=1 "$1" "${{COMP_WORDS[@]:1:COMP_CWORD}}" 2>/dev/null) )
}}
complete -o default -F _cyclopean cyclopean
"""

ZSH = f"""\
#compdef cyclopean
# cyclopean completion zsh > a file _cyclopean in a folder of $fpath
_cyclopean() {{
    local -a found
    found=("${{(@f)$({ASKED}=1 "${{words[1]}}" "${{(@)words[2,CURRENT]}}" 2>/dev/null)}}")
    if [[ -n "${{found[*]}}" ]]; then compadd -- "${{found[@]}}"; else _files; fi
}}
if [[ "${{funcstack[1]}}" = _cyclopean ]]; then _cyclopean "$@"; else compdef _cyclopean cyclopean; fi
"""

FISH = f"""\
# cyclopean completion fish > ~/.config/fish/completions/cyclopean.fish
complete --command cyclopean --arguments \
'(env {ASKED}=1 cyclopean (commandline -cop)[2..-1] (commandline -ct) 2>/dev/null)'
"""

SCRIPTS = {"bash": BASH, "fish": FISH, "zsh": ZSH}


@command()
def completion(shell: Annotated[str, argument("bash|zsh|fish", "Your shell.")]) -> int:
    """Print the script by which a shell completes commands, options and the words they accept."""
    say(SCRIPTS[choice("SHELL", shell, tuple(SCRIPTS))].rstrip())
    return 0


def candidates(program: Any, words: list[str]) -> list[str]:
    """What the last word may become.

    Parameters
    ----------
    program : click group
        All commands.
    words : list of str
        What was typed after the program's name; the last one is to be completed.

    Returns
    -------
    list of str
        Sorted; none where a file or a value of the user's own is wanted.
    """
    *before, begun = words or [""]
    if begun == "=":  # bash breaks words at this sign
        begun = ""
    before = [word for word in before if word != "="]
    command, rest = program, list[str]()
    for word in before:
        below = getattr(command, "commands", {}).get(word)
        command, rest = (command, [*rest, word]) if below is None or rest else (below, [])
    known = {name: p for p in command.params for name in (*p.opts, *p.secondary_opts) if name.startswith("-")}
    option = known.get(rest[-1]) if rest else None
    if option is not None and not option.is_flag:
        return _words(option, begun)
    if begun.startswith("-"):
        name, equals, value = begun.partition("=")
        if equals:
            return [f"{name}={word}" for word in _words(known[name], value)] if name in known else []
        return sorted(n for n in (*known, "--help") if n.startswith("--") and n.startswith(begun))
    if hasattr(command, "commands"):
        return sorted(name for name in command.commands if name.startswith(begun))
    arguments = [p for p in command.params if not p.opts[0].startswith("-")]
    place = _positional(rest, known)
    return _words(arguments[place], begun) if place < len(arguments) else []


def _words(parameter: Any, begun: str) -> list[str]:
    """Words that a parameter accepts, where it lists them."""
    said = parameter.metavar or ""
    return [word for word in said.split("|") if word.startswith(begun)] if CHOICES.fullmatch(said) else []


def _positional(rest: list[str], known: dict[str, Any]) -> int:
    """How many of the words after a command are arguments, and no options or values of them."""
    count, value = 0, False
    for word in rest:
        if value:
            value = False
        elif word.startswith("-") and word in known:
            value = not known[word].is_flag
        elif not word.startswith("-"):
            count += 1
    return count
