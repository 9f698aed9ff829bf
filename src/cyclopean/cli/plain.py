"""Commands whose values stay text, so that nothing heavy is imported to read them."""

from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

__all__ = ["PlainCommand", "PlainGroup"]


class _AsText:
    """Stands where typer would have pydantic (0.15 s to import) turn text into text."""

    def coerce(self, value: Any, **_: Any) -> Any:
        return value


def _spared(parameters: list[Any]) -> list[Any]:
    for parameter in parameters:
        vars(parameter)["_runtime_param"] = _AsText()  # an attribute without a meaning in other versions of typer
    return parameters


class PlainCommand(TyperCommand):
    """A command that takes text and flags only."""

    def get_params(self, ctx: typer.Context) -> list[Any]:  # type: ignore[override]
        """Parameters, the one for help included."""
        return _spared(super().get_params(ctx))


class PlainGroup(TyperGroup):
    """A group of commands that takes text and flags only."""

    def get_params(self, ctx: typer.Context) -> list[Any]:  # type: ignore[override]
        """Parameters, the one for help included."""
        return _spared(super().get_params(ctx))
