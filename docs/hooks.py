"""What the site adds to the pages as they stand in the repository; mkdocs calls these functions while it builds.

Four things differ between a page read in the repository and the same page on the site. Links out of this folder (to an
example, the change log, the readme) need a page to lead to, so each becomes one. The reference of the Python names is
made from the source at build time and so is never stale. The repository's Markdown (CommonMark) indents what belongs
to a list item by the width of its bullet, where the site's wants four columns. And in the cells of a table the site's
Markdown shows the backslash before a bar in code.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "cyclopean"
ROOMS = {  # package -> what is asked of it
    "": "The names that most scripts need",
    "assembly": "Blocks, contacts, loads",
    "analysis": "Does it stand?",
    "proof": "Certificates and their checker",
    "design": "Proposing geometry",
    "io": "Files and units",
    "view": "Pages and pictures",
    "service": "Answering Grasshopper",
    "statics": "Equilibrium and cones",
    "solvers": "Programmes and factorisations",
    "geometry": "Polygons, meshes, diagrams",
}
LINK = re.compile(r"\]\((\.\./[^)\s]+)\)")
SECTIONS = {"#commands": "cli.md", "#how-to-read-a-verdict": "reading-a-verdict.md", "#the-model-file": "model-file.md"}
BAR = r"\|"
BARRED = re.compile(r"^\|.*\\\|.*$", re.MULTILINE)  # a row of a table with such a bar in it
CODE = re.compile(r"`([^`]+)`")
FENCE = re.compile(r"^\s*(```|~~~)")
ITEM = re.compile(r"^(\s*)([-*+]|\d+\.)(\s+)\S")


def public_names(package: Path) -> list[str]:
    """What `__all__` of a package says, read without importing it."""
    for statement in ast.parse((package / "__init__.py").read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == "__all__":
            return list(ast.literal_eval(statement.value))
    return []


def packages_of(room: str) -> Iterator[tuple[str, list[str]]]:
    """Every package of a room that shows names, itself first: dotted name under `cyclopean`, and the names."""
    top = SOURCE / room
    below = [] if room == "" else sorted(path.parent for path in top.rglob("__init__.py") if path.parent != top)
    for package in (top, *below):
        if names := public_names(package):
            yield ".".join(("cyclopean", *package.relative_to(SOURCE).parts)), names


def reference_page(room: str, title: str) -> str:
    """Markdown of the reference of one room; mkdocstrings fills in what `:::` names."""
    parts = [f"# {'.'.join(filter(None, ('cyclopean', room)))}: {title[0].lower()}{title[1:]}\n"]
    for package, names in packages_of(room):
        parts.append(f"From `{package}`:\n")
        parts += [f"::: {package}.{name}\n" for name in names]
    return "\n".join(parts)


def notebook_page(notebook: Path) -> str:
    """Markdown of a notebook: what its cells say, and their code."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    texts = [("".join(cell["source"]), cell["cell_type"]) for cell in cells]
    parts = [text if kind == "markdown" else f"```python\n{text}\n```" for text, kind in texts]
    return "\n\n".join([*parts, f"The notebook: `examples/{notebook.name}`", ""])


def example_page(script: Path) -> str:
    """Markdown of one example: its first line as the title, then the whole script."""
    text = script.read_text(encoding="utf-8")
    title = (ast.get_docstring(ast.parse(text)) or script.stem).splitlines()[0].rstrip(".")
    return f"# {title}\n\n`examples/{script.name}`\n\n```python\n{text}```\n"


def made_pages() -> dict[str, str]:
    """Path on the site -> Markdown of every page that no file of this folder holds."""
    pages = {f"reference/{room or 'cyclopean'}.md": reference_page(room, title) for room, title in ROOMS.items()}
    for path in sorted((ROOT / "examples").iterdir()):
        if path.suffix in (".py", ".ipynb"):
            pages[f"examples/{path.stem}.md"] = example_page(path) if path.suffix == ".py" else notebook_page(path)
    return pages | {"changes.md": (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")}


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """List the made pages in the navigation."""
    pages = made_pages()
    reference = next(entry["Reference"] for entry in config.nav or [] if "Reference" in entry)
    reference.append({"Python": [{Path(p).stem: p} for p in pages if p.startswith("reference/")]})
    reference.append({"Examples": [p for p in pages if p.startswith("examples/")]})
    reference.append({"Changes": "changes.md"})
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the made pages."""
    from mkdocs.structure.files import File

    for path, text in made_pages().items():
        files.append(File.generated(config, path, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """A page of the repository as the site needs it."""
    up = "../" * page.file.src_uri.count("/")
    if page.file.src_uri == "changes.md":
        markdown = markdown.replace("](docs/", "](")
    markdown = BARRED.sub(lambda row: CODE.sub(bars, row[0]), markdown)
    return indented(LINK.sub(lambda found: f"]({up}{site_path(found[1])})", markdown))


def bars(code: re.Match[str]) -> str:
    """A code span of a table, with the bars in it spelled as HTML."""
    return f"<code>{escape(code[1], quote=False).replace(BAR, '&#124;')}</code>" if BAR in code[1] else code[0]


def site_path(link: str) -> str:
    """Where a link that leaves the folder of the pages leads on the site."""
    path, _, anchor = link.removeprefix("../").partition("#")
    anchor = anchor and f"#{anchor}"
    if path.startswith("examples/"):
        return re.sub(r"\.(py|ipynb)$", ".md", path)
    if path == "README.md":
        return SECTIONS.get(anchor, "index.md")
    return {"CHANGELOG.md": "changes.md"}.get(path, path) + anchor


def indented(markdown: str) -> str:
    """What belongs to a list item, indented by four columns a level; a blank line before every list."""
    lines: list[str] = []
    offsets: list[int] = []  # columns at which the text of each open item begins
    fenced, blank, loose = False, True, False  # loose: the open item has more than one paragraph
    for line in markdown.split("\n"):
        column = len(line) - len(line.lstrip())
        item = None if fenced else ITEM.match(line)
        if line.strip() and not fenced:
            while offsets and column < offsets[-1] and (blank or item):
                offsets.pop()
        inner = offsets[-1] if offsets else 0
        after_text = not offsets and bool(lines) and not ITEM.match(lines[-1]) and not lines[-1].startswith("    ")
        if item and not blank and (loose or after_text):
            lines.append("")
        lines.append(" " * (4 * len(offsets)) + line[min(inner, column) :] if line.strip() else line)
        if item:
            offsets.append(len(item[0]) - 1)
        if FENCE.match(line):
            fenced = not fenced
        blank = not line.strip()
        loose = bool(offsets) and not item and (loose or blank)
    return "\n".join(lines)
