"""What the documentation says is run: commands with their output, Python blocks, examples; links and options exist."""

import contextlib
import io
import re
import runpy
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from cyclopean.analysis import safety_margins
from cyclopean.cli import main

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
SHOWN = {name for page in PAGES for name in re.findall(r"^\$ python examples/(\S+)", page.read_text(), re.MULTILINE)}
RUNNABLE = [page for page in PAGES if "```python\n" in page.read_text() or "```console\n" in page.read_text()]
MARGINED = safety_margins.POINTS  # contact points up to which margins are told without being asked for
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def name(path: Path) -> str:
    return path.name


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """Nothing is written into the repository, and no page leans on where it is run."""
    monkeypatch.chdir(tmp_path)


def commands(block: str) -> Iterator[tuple[str, str]]:
    """Lines after `$ ` of a console block, and what is shown below each."""
    for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        command, _, shown = part.partition("\n")
        yield command, shown


def ran(command: str, last: int) -> tuple[int, str]:
    """Status and all output of one command of the documentation; `last` is the status of the one before."""
    words = shlex.split(command)
    if words == ["echo", "$?"]:
        return last, f"{last}\n"
    if words[0] == "python":
        done = subprocess.run(
            [sys.executable, "-I", ROOT / words[1], *words[2:]], capture_output=True, text=True, check=False
        )
        return done.returncode, done.stdout + done.stderr
    if words[0] == "mkdir":
        Path(words[1]).mkdir()
        return 0, ""
    assert words[0] == "./run", f"{command}: only ./run, python, mkdir and 'echo $?' may stand in a console block"
    assert words[1] != "test", "the tests do not run themselves"
    output = io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        status = main(words[1:])
    return status, output.getvalue()


def agrees(shown: str, output: str) -> bool:
    """Whether the output is as shown; `...` stands for part of a line, or for any lines where it is alone."""
    pattern = ""
    for line in shown.splitlines():
        pattern += r"(.*\n)*?" if line.strip() == "..." else re.escape(line).replace(r"\.\.\.", ".*") + r"\n"
    return re.fullmatch(pattern, output) is not None


@pytest.mark.parametrize("page", RUNNABLE, ids=name)
def test_page_runs(page: Path, monkeypatch) -> None:
    """Console and Python blocks in the order of the page; the Python of one page is one program."""
    program: dict[str, object] = {"__name__": "__main__"}
    status = 0
    for language, block in FENCE.findall(page.read_text()):
        if language == "python":
            with contextlib.redirect_stdout(io.StringIO()):
                exec(compile(block, f"{page.name} (python block)", "exec"), program)
        elif language == "console":
            for command, shown in commands(block):
                told = "margins" in shown or "would fall" in shown
                monkeypatch.setattr(safety_margins, "POINTS", MARGINED if told else -1)
                status, output = ran(command, status)
                assert agrees(shown, output), f"{page.name}: {command}\n--- shown\n{shown}--- but it says\n{output}"


def test_the_comparison_can_fail() -> None:
    assert agrees("stable: ...\n...\n", "stable: so it is\nmore\nand more\n")
    assert agrees("a\n...\nc\n", "a\nc\n")
    assert not agrees("stable\n", "unstable\n")
    assert not agrees("stable\n", "stable\nmore\n")


@pytest.mark.parametrize("script", [script for script in EXAMPLES if script.name not in SHOWN], ids=name)
def test_example(script: Path, capsys) -> None:
    runpy.run_path(str(script), run_name="__main__")
    assert capsys.readouterr().out


def test_the_readme_names_every_example() -> None:
    text = (ROOT / "README.md").read_text()
    assert [e.name for e in EXAMPLES if f"(examples/{e.name})" not in text] == []
    assert len(EXAMPLES) >= 4


def anchors(page: Path) -> set[str]:
    headings = re.findall(r"^#+ (.*)$", FENCE.sub("", page.read_text()), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", FENCE.sub("", page.read_text())):
        if link.startswith(("http://", "https://")):
            continue
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        assert target.exists(), f"{page.name}: {link}"
        assert target.is_relative_to(ROOT), f"{page.name}: {link} leaves the repository"
        assert not anchor or anchor in anchors(target), f"{page.name}: no heading for {link}"


def test_pages_and_pictures_belong_together() -> None:
    text = "".join(page.read_text() for page in PAGES)
    for picture in (ROOT / "docs" / "images").iterdir():
        assert f"images/{picture.name}" in text, f"{picture.name} is shown nowhere"
        assert picture.stat().st_size < 300_000
    readme = (ROOT / "README.md").read_text()
    assert [p.name for p in (ROOT / "docs").glob("*.md") if f"(docs/{p.name})" not in readme] == []


def helped(*command: str) -> str:
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        assert main([*command, "--help"]) == 0
    return output.getvalue()


def known_commands(*group: str) -> Iterator[tuple[str, ...]]:
    """Every command, those of groups included, as the help lists them."""
    listed = re.findall(r"^  ([a-z]\w+)  ", helped(*group).partition("\nOptions:\n")[2], re.MULTILINE)
    if not listed:
        yield group
    for found in listed:
        yield from known_commands(*group, found)


def known_options(command: tuple[str, ...]) -> set[str]:
    listed = re.findall(r"^  (?:-\w, )?(--[a-z-]+)(?: / (--[a-z-]+))?", helped(*command), re.MULTILINE)
    return {option for pair in listed for option in pair if option} - {"--help"}


def table(heading: str) -> list[list[str]]:
    """Cells of the rows of the readme's table that begins with this cell."""
    text = (ROOT / "README.md").read_text()
    rows = text[text.index(f"| {heading} |") :].split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", row)[1:-1]] for row in rows]


def test_the_readme_lists_every_command_and_option() -> None:
    listed = {}
    for command, _, options in table("Command"):
        words = command.strip("`").split()
        listed[tuple(w for w in words if w.islower())] = set(re.findall(r"--[a-z-]+", options))
    assert listed == {command: known_options(command) for command in known_commands()}


def test_the_readme_explains_every_option_of_check() -> None:
    explained = {option for cells in table("Option") for option in re.findall(r"--[a-z-]+", cells[0])}
    assert explained == known_options(("check",))


def test_the_package_loads_nothing_until_it_is_asked() -> None:
    program = (
        "import sys, cyclopean\n"
        "assert not {'numpy', 'scipy', 'typer', 'cyclopean.io'} & sys.modules.keys()\n"
        "assert set(cyclopean.__all__) <= set(dir(cyclopean))\n"
        "assert cyclopean.stack(1).name == 'stack of 1' and 'stack' in vars(cyclopean)\n"
        "assert not hasattr(cyclopean, 'nothing')\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
