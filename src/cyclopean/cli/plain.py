"""Commands whose values stay text, so that nothing heavy is imported to read them."""

from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from cyclopean.cli.examples import EXAMPLES

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

    def format_epilog(self, ctx: typer.Context, formatter: Any) -> None:  # type: ignore[override]
        """Examples, one a line as it is to be typed; the formatter would fill them up into a paragraph."""
        shown = EXAMPLES.get(ctx.command_path.removeprefix("cyclopean "), ())
        if shown:
            formatter.write("\nExamples:\n" + "".join(f"  {line}\n" for line in shown))


class PlainGroup(TyperGroup):
    """A group of commands that takes text and flags only."""

    def get_params(self, ctx: typer.Context) -> list[Any]:  # type: ignore[override]
        """Parameters, the one for help included."""
        return _spared(super().get_params(ctx))
