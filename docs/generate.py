"""Writes what pages repeat of the source: the reference of the commands, and the table of symbols.

Run `python docs/generate.py` after a change of a command or of a symbol; `--check` only says whether that was done.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from cyclopean import statics
from cyclopean.cli.app import program

DOCS = Path(__file__).parent
TABLE = re.compile(r"(<!-- symbols -->\n).*?(<!-- end of symbols -->)", re.DOTALL)
HEAD = """# Commands

Every command with every option, as `--help` after it says. In a copy of the repository, `./run COMMAND` does what
`cyclopean COMMAND` does once it is installed. Bad input is answered by one line on the error stream and status 2; files
are written whole or not at all. This page is written by `python docs/generate.py`.

"""


def commands(command: Any, name: str = "cyclopean") -> Iterator[tuple[str, Any]]:
    """Every command that does something, those of groups included, with its full name."""
    for word, inner in sorted(getattr(command, "commands", {}).items()):
        if hasattr(inner, "commands"):
            yield from commands(inner, f"{name} {word}")
        else:
            yield f"{name} {word}", inner


def cell(text: str | None) -> str:
    """Text as it may stand in a table."""
    return " ".join((text or "").split()).replace("|", "\\|").replace("<", "&lt;")


def spelled(option: Any) -> str:
    """An option with all its names and what it takes, as it is typed."""
    value = "" if option.is_flag else f" {option.metavar or option.name.upper()}"
    names = " / ".join(f"`{name}{value}`" for name in (*option.opts, *option.secondary_opts))
    return names.replace("|", "\\|")


def remark(parameter: Any) -> str:
    """What the help says of a parameter, its default and whether it has to be given included."""
    shown = parameter.default if getattr(parameter, "show_default", False) and not callable(parameter.default) else None
    said = cell(parameter.help)
    if shown not in (None, False, True, (), []) and "[" not in said:
        said += f" [{shown}]"
    return said + (" *Required.*" if parameter.required else "")


def command_reference() -> str:
    """The page of all commands."""
    root = program()
    parts = [HEAD]
    for name, command in commands(root):
        arguments = [p for p in command.params if p.param_type_name == "argument"]
        options = [p for p in command.params if p.param_type_name == "option"]
        takes = [a.metavar or a.name.upper() for a in arguments]
        usage = " ".join([name, *(t if a.required else f"[{t}]" for a, t in zip(arguments, takes, strict=True))])
        usage += " [OPTIONS]" if options else ""
        parts.append(f"## {name.removeprefix('cyclopean ')}\n\n```text\n{usage}\n```\n\n")
        parts.append(re.sub(r"\n{3,}", "\n\n", (command.help or "").replace("\b", "").strip()) + "\n\n")
        rows = [(f"`{t}`", remark(a)) for a, t in zip(arguments, takes, strict=True)]
        rows += [(spelled(o), remark(o)) for o in options if "--help" not in o.opts]
        parts.append("| | |\n|---|---|\n" + "".join(f"| {left} | {right} |\n" for left, right in rows) + "\n")
        if command.epilog:
            parts.append("```text\n" + command.epilog.replace("\b", "").strip("\n") + "\n```\n\n")
    return "".join(parts).rstrip() + "\n"


def symbols() -> list[tuple[str, str]]:
    """The rows of the one table of symbols, which stands in the source of `cyclopean.statics`."""
    rows: list[tuple[str, str]] = []
    for line in (statics.__doc__ or "").split("\n\n")[2].splitlines():
        symbol, meaning = line[4:14].strip(), line[14:].strip()
        if symbol:
            rows.append((symbol, meaning))
        else:
            rows[-1] = rows[-1][0], f"{rows[-1][1]} {meaning}"
    return rows


def glossary() -> str:
    """The page of terms, with the table of symbols renewed."""
    table = "| Symbol | Meaning |\n|---|---|\n" + "".join(f"| {cell(s)} | {cell(m)} |\n" for s, m in symbols())
    page = (DOCS / "glossary.md").read_text(encoding="utf-8")
    return TABLE.sub(lambda found: f"{found[1]}\n{table}\n{found[2]}", page)


def main(given: Sequence[str] | None = None) -> int:
    """Write the pages, or say which of them are not as they would be written."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; status 1 if a page is out of date")
    check = parser.parse_args(given).check
    stale = False
    for name, text in (("cli.md", command_reference()), ("glossary.md", glossary())):
        page = DOCS / name
        if page.exists() and page.read_text(encoding="utf-8") == text:
            continue
        stale = True
        if not check:
            page.write_text(text, encoding="utf-8")
        sys.stdout.write(f"{name}: {'out of date' if check else 'written'}\n")
    return int(check and stale)


if __name__ == "__main__":
    raise SystemExit(main())
