"""A room imports only from floors below it, lazy imports included."""

import ast
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "src" / "cyclopean"
FLOOR = {
    "errors": 0, "lazy_exports": 0, "representation": 0,
    "processes": 0, "arrays": 0.5, "texts": 0.5, "options": 0.7,  # ground: steps
    "geometry": 1, "solvers": 1, "proof": 1,
    "assembly": 2, "statics": 3, "analysis": 4, "design": 5, "io": 6, "view": 7, "api": 8, "service": 8.3, "cli": 8.5,
    "__init__": 9, "__main__": 9,
}  # fmt: skip


def imported_rooms(tree: ast.AST) -> set[str]:
    """Rooms of this package that a module imports anywhere in its text."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative import"
            names |= {f"{node.module}.{alias.name}" for alias in node.names} if node.module == "cyclopean" else set()
            names.add(node.module or "")
    return {name.split(".")[1] for name in names if name.startswith("cyclopean.")} - {"__version__"}


def upward(path: Path) -> list[str]:
    """Imports of a module from its own floor or from a higher one, in words."""
    room = path.relative_to(SOURCE).parts[0].removesuffix(".py")
    rooms = imported_rooms(ast.parse(path.read_text())) - {room}
    return [f"{path}: {room} imports {other}" for other in sorted(rooms) if not FLOOR[other] < FLOOR[room]]


def test_imports_go_down() -> None:
    paths = sorted(SOURCE.rglob("*.py"))
    assert len(paths) > 100
    assert [line for path in paths for line in upward(path)] == []


def test_a_lazy_import_of_a_higher_floor_is_seen() -> None:
    assert imported_rooms(ast.parse("def f():\n    from cyclopean.cli import main")) == {"cli"}
    assert imported_rooms(ast.parse("from cyclopean import view")) == {"view"}
