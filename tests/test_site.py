"""The documentation site: what pages repeat of the source is current, and it builds without a warning or a network.

mkdocs is in the dependency group `docs`, which the tests do not need: without it the site is not built here, but by
`.ci/docs`.
"""

import contextlib
import importlib.util
import io
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = {page.name for page in DOCS.glob("*.md")}
HAS_MKDOCS = all(importlib.util.find_spec(name) for name in ("mkdocs", "material", "mkdocstrings_handlers"))


def loaded(path: Path) -> ModuleType:
    """A script as a module."""
    spec = importlib.util.spec_from_file_location(f"site_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


hooks = loaded(DOCS / "hooks.py")
generate = loaded(DOCS / "generate.py")


def test_the_navigation_lists_every_page_once() -> None:
    listed = re.findall(r": ([\w-]+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE)
    assert len(listed) == len(set(listed))
    assert set(listed) == PAGES


def test_what_is_generated_is_current(capsys: pytest.CaptureFixture[str]) -> None:
    assert generate.main(["--check"]) == 0, f"run python docs/generate.py: {capsys.readouterr().out}"


def test_a_stale_page_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(generate, "DOCS", tmp_path)
    (tmp_path / "glossary.md").write_text("<!-- symbols -->\nold\n<!-- end of symbols -->\n")
    with contextlib.redirect_stdout(io.StringIO()):
        assert generate.main(["--check"]) == 1
        assert "old" in (tmp_path / "glossary.md").read_text()
        assert generate.main([]) == 0
        assert generate.main(["--check"]) == 0
    assert "| A f = -p | equilibrium |" in (tmp_path / "glossary.md").read_text()


def test_the_reference_of_commands_names_every_option_of_check() -> None:
    page = (DOCS / "cli.md").read_text()
    section = page[page.index("\n## check\n") :].split("\n## ")[1]
    for option in ("--method cra", "--mu M", "--tilt DEG", "--certificate F"):
        assert f"`{option}" in section
    assert "*Required.*" in section


def test_symbols_are_those_of_the_source() -> None:
    rows = dict(generate.symbols())
    assert rows["A f = -p"] == "equilibrium"
    assert rows["mu"].startswith("Coulomb coefficient")
    assert len(rows) >= 12


@pytest.mark.parametrize(
    ("given", "site"),
    [
        ("- a\n  more\n- b\n", "- a\n    more\n- b\n"),
        ("- a\n\n      code\n\nafter\n", "- a\n\n        code\n\nafter\n"),
        ("1. a\n   more\n2. b\n", "1. a\n    more\n2. b\n"),
        ("text\n- a\n", "text\n\n- a\n"),
        ("- a\n  - b\n    more\n- c\n", "- a\n    - b\n        more\n- c\n"),
        ("- a\n\n  more\n- b\n", "- a\n\n    more\n\n- b\n"),
        ("    code - not a list\n", "    code - not a list\n"),
        ("```sh\n- no list\n  as it is\n```\n", "```sh\n- no list\n  as it is\n```\n"),
        ("plain\n\n| a | b |\n|---|---|\n", "plain\n\n| a | b |\n|---|---|\n"),
    ],
)
def test_lists_are_indented_as_the_site_wants_them(given: str, site: str) -> None:
    assert hooks.indented(given) == site


def test_bars_in_the_code_of_a_table_lose_their_backslash() -> None:
    row = "| `--json F\\|-` | \\|f\\| <= `a` |\n"
    assert hooks.BARRED.sub(lambda r: hooks.CODE.sub(hooks.bars, r[0]), row) == (
        "| <code>--json F&#124;-</code> | \\|f\\| <= `a` |\n"
    )


@pytest.mark.parametrize(
    ("link", "site"),
    [
        ("../examples/h_frame.py", "examples/h_frame.md"),
        ("../examples/wall_in_a_notebook.ipynb", "examples/wall_in_a_notebook.md"),
        ("../README.md#licence", "index.md"),
        ("../README.md#commands", "cli.md"),
        ("../CHANGELOG.md", "changes.md"),
    ],
)
def test_links_out_of_the_folder_lead_to_pages(link: str, site: str) -> None:
    assert hooks.site_path(link) == site


def test_the_reference_of_names_holds_every_public_name() -> None:
    import cyclopean
    from cyclopean import analysis

    pages = hooks.made_pages()
    assert all(f"::: cyclopean.{name}\n" in pages["reference/cyclopean.md"] for name in cyclopean.__all__)
    assert all(f"::: cyclopean.analysis.{name}\n" in pages["reference/analysis.md"] for name in analysis.__all__)
    assert "# A beam that hangs on nothing but friction" in pages["examples/h_frame.md"]


def test_every_room_has_a_page_of_reference() -> None:
    """The command line has a page of its own, and `api` is seen through `cyclopean`."""
    rooms = {path.parent.name for path in (ROOT / "src" / "cyclopean").glob("*/__init__.py")}
    assert rooms - {"api", "cli"} == set(hooks.ROOMS) - {""}


def test_the_page_of_validation_has_nothing_off() -> None:
    page = (DOCS / "validation.md").read_text()
    assert re.search(r"^\*\*None of \d+ rows are off\.\*\*$", page, re.MULTILINE)
    assert "**off**" not in page


def test_quick_rows_of_validation_are_what_the_script_finds() -> None:
    """Those that take no bisection; the rest stands in the tests of the same numbers."""
    script = loaded(ROOT / "bench" / "validation.py")
    page = (DOCS / "validation.md").read_text()
    known = list(script.textbook())
    assert [k.what for k in known if f"| {k.what} |" not in page] == []
    for k in known:
        if k.what.startswith(("Push that", "Share")):
            found = k.find()
            assert abs(found - k.value) <= k.within
            assert f"| {found:.{script.digits(k)}f} |" in page


@pytest.mark.skipif(not HAS_MKDOCS, reason="mkdocs-material and mkdocstrings are not installed (group docs)")
def test_the_site_builds_strictly_and_asks_no_network(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1", "NO_COLOR": "1"},
    )
    assert done.returncode == 0, done.stderr[-2000:]
    pages = sorted(tmp_path.rglob("*.html"))
    assert len(pages) > len(PAGES)
    fetched = re.compile(r"<(?:script|img|iframe)[^>]* src=\"?https?:|<link [^>]*rel=\"?stylesheet[^>]*https?:")
    for page in pages:
        assert not fetched.search(page.read_text(encoding="utf-8")), page.name
    assert "Symbols" in (tmp_path / "glossary.html").read_text(encoding="utf-8")
    assert (tmp_path / "search" / "search_index.js").stat().st_size > 100_000


def test_a_folder_that_holds_other_files_is_left_alone(tmp_path: Path) -> None:
    script = ROOT / ".ci" / "docs"
    if not script.exists():
        pytest.skip("no .ci: this is not a checkout")
    (tmp_path / "notes.txt").write_text("mine")
    run = subprocess.run([script, "."], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert run.stderr == f".ci/docs: {tmp_path} holds other files; name a folder that is empty, or not there yet\n"
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
