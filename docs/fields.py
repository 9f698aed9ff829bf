"""Shows the fields of dataclasses in the reference: shapes and units stand in the comments beside them.

An extension of griffe, which reads the source for mkdocstrings.
"""

from __future__ import annotations

import ast
from typing import Any

import griffe


def is_dataclass(node: ast.ClassDef) -> bool:
    """Whether a class is decorated as one."""
    return any("dataclass" in ast.unparse(decorator) for decorator in node.decorator_list)


class Fields(griffe.Extension):
    """Adds the source of its fields to the docstring of every dataclass."""

    def on_class_members(self, *, node: ast.AST | griffe.ObjectNode, cls: griffe.Class, **_: Any) -> None:
        """Once per class, when its body has been read."""
        if not isinstance(node, ast.ClassDef) or not is_dataclass(node) or cls.docstring is None:
            return
        fields = [part for part in node.body if isinstance(part, ast.AnnAssign)]
        if not fields:
            return
        first, last = fields[0].lineno, max(part.end_lineno or part.lineno for part in fields)
        shown = "\n".join(line.removeprefix("    ") for line in cls.lines[first - cls.lineno : last + 1 - cls.lineno])
        cls.docstring.value += f"\n\n```python\n{shown}\n```\n"
