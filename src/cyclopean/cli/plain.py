"""Commands whose values stay text, so that nothing heavy is imported to read them."""

from collections.abc import Mapping
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from cyclopean.cli.examples import EXAMPLES
from cyclopean.errors import InputError


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

    retired: Mapping[str, str] = {}  # options that have another word now, by the old one, and what is said of it

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Answer options by their old words with the new ones."""
        for word in args:
            name = word.partition("=")[0].removeprefix("--").replace("-", "_")
            if word.startswith("--") and name in self.retired:
                raise InputError(f"{word.partition('=')[0]}: {self.retired[name]}")
        return super().parse_args(ctx, args)

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
