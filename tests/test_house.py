"""What keeps the code readable: short functions, few arguments, docstrings with shape or unit, reasons of constants."""

import ast
import functools
import re
from pathlib import Path

from test_floors import SOURCE

Function = ast.FunctionDef | ast.AsyncFunctionDef

MEDIAN, MOST, LONGEST = 8, 27, 70  # lines without the docstring: half of them, 95 %, all
ARGUMENTS, WITH_MORE = 6, 19  # arguments, and how many functions may have more: fewer is better, more is not
ARRAY = re.compile(r"\b(Floats|Ints|Bools|NDArray)\b")
SHAPE_OR_UNIT = re.compile(
    r"\([\w+ .]+,[\w+, ]*\)"
    r"|\b(m|m2|m3|N|Nm|Pa|kg|s|rad|scaled|metres|degrees|unit|index|indices|number|numbers|rows?|each)\b"
)


@functools.cache  # four tests read all of them
def modules(folder: Path = SOURCE) -> list[tuple[str, str, ast.Module]]:
    """Every module: its place, its text and its tree."""
    found = [(str(path.relative_to(folder)), path.read_text()) for path in sorted(folder.rglob("*.py"))]
    return [(place, text, ast.parse(text)) for place, text in found]


@functools.cache  # two tests read those of every module
def functions(tree: ast.Module) -> list[Function]:
    return [node for node in ast.walk(tree) if isinstance(node, Function)]


def length(function: Function) -> int:
    """Lines without the docstring."""
    lines = function.end_lineno - function.lineno + 1
    first = function.body[0]
    return lines - (first.end_lineno - first.lineno + 1 if ast.get_docstring(function, clean=False) else 0)


def arguments(function: Function) -> list[ast.arg]:
    given = function.args
    return [a for a in (*given.posonlyargs, *given.args, *given.kwonlyargs) if a.arg not in ("self", "cls")]


def public(tree: ast.Module) -> list[Function]:
    """Functions of a module and methods of its classes that others may call."""
    bodies = [tree.body, *(node.body for node in tree.body if isinstance(node, ast.ClassDef) and node.name[0] != "_")]
    return [node for body in bodies for node in body if isinstance(node, Function) and node.name[0] != "_"]


def silent(tree: ast.Module) -> list[str]:
    """Public functions that take arrays and do not say of what shape or in what unit."""
    taking = [
        f for f in public(tree) if any(a.annotation and ARRAY.search(ast.unparse(a.annotation)) for a in arguments(f))
    ]
    return [f.name for f in taking if not SHAPE_OR_UNIT.search(ast.get_docstring(f) or "")]


def unreasoned(text: str, tree: ast.Module) -> list[str]:
    """Numeric constants of a module without a remark on their line, above it or in a docstring below."""
    lines, found = text.splitlines(), []
    for node, after in zip(tree.body, [*tree.body[1:], None], strict=True):
        number = (
            isinstance(node, ast.Assign)
            and isinstance(node.value, ast.Constant)
            and type(node.value.value) in (int, float)
        )
        told = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        if number and not told and "#" not in lines[node.lineno - 1] and not lines[node.lineno - 2].startswith("#"):
            found.append(lines[node.lineno - 1])
    return found


def test_functions_are_short() -> None:
    sizes = sorted((length(f), f"{place}:{f.name}") for place, _, tree in modules() for f in functions(tree))
    assert sizes[len(sizes) // 2][0] <= MEDIAN
    assert sizes[int(0.95 * len(sizes))][0] <= MOST
    assert [size for size in sizes if size[0] > LONGEST] == []


def test_few_functions_take_many_arguments() -> None:
    many = [
        f"{place}:{f.name}" for place, _, tree in modules() for f in functions(tree) if len(arguments(f)) > ARGUMENTS
    ]
    assert len(many) <= WITH_MORE, many


def test_docstrings_of_arrays_say_shape_or_unit() -> None:
    assert [f"{place}:{name}" for place, _, tree in modules() for name in silent(tree)] == []


def test_constants_have_a_reason() -> None:
    assert [f"{place}: {line}" for place, text, tree in modules() for line in unreasoned(text, tree)] == []


def test_what_is_not_so_is_seen() -> None:
    text = 'STEPS = 7\n\ndef f(a: Floats, b, c, d, e, g, h):\n    """Do it."""\n    return a\n'
    tree = ast.parse(text)
    assert unreasoned(text, tree) == ["STEPS = 7"]
    assert silent(tree) == ["f"]
    assert [(length(f), len(arguments(f))) for f in functions(tree)] == [(2, 7)]
    assert silent(ast.parse('def f(a: Floats):\n    """Do it; (n, 3) m."""')) == []
