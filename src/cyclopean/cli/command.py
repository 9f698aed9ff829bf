"""A command is a function of values; its words, its help and its checks are made from the options that it takes.

What a parameter is, is said by its annotation:

    Annotated[T, Option(...)]           an option of the command's own, or a word without dashes (`argument`)
    a dataclass of options              all of its options; the parameter is given the dataclass
    Annotated[dataclass, some("a b")]   these of its options only
    Annotated[Files, written(...)]      options for the files that the command writes; the parameter is given them
"""

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, is_dataclass, replace
from functools import cached_property, partial
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer

from cyclopean.cli.outputs import Files
from cyclopean.cli.plain import PlainCommand
from cyclopean.cli.terminal import as_option
from cyclopean.errors import InputError, spelt
from cyclopean.options import Option, check_option, check_options, options_of, read_option, shown_default

# What the options for files do, where a command says nothing else; `-` is standard output.
WRITTEN = {
    "json": ("F|-", "Write the result as JSON; - prints it and nothing else."),
    "certificate": ("F", "Write the proof of the verdict."),
    "report": ("F", "Write a page to read in a browser."),
    "drawing": ("F", "Draw it: SVG, 1:1 in millimetres."),
}
CAD = "F", "Draw it for CAD: DXF, layers by name, 1:1 in millimetres (extra dxf)."


@dataclass(frozen=True, slots=True)
class _Argument:
    """A word without dashes."""

    option: Option
    source: bool  # a file or folder that is read, which no output may overwrite


@dataclass(frozen=True, slots=True)
class _Some:
    """Options of a dataclass that a command takes, and what they do there where that is something else."""

    names: tuple[str, ...]
    helps: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class _Written:
    """Files that a command writes."""

    options: Mapping[str, Option]
    models: tuple[str, ...]  # those that are model files, and no meshes


def argument(metavar: str, help: str, *, source: bool = False, **more: Any) -> Any:
    """Annotation of a word without dashes; `source` where it names what is read."""
    return _Argument(Option(help, metavar=metavar, **more), source)


def some(names: str, **helps: str) -> Any:
    """Annotation of a dataclass of which only these options are taken; helps say what some of them do here."""
    return _Some(tuple(names.split()), helps)


def written(*names: str, models: str = "", **helps: tuple[str, str]) -> Any:
    """Annotation of the files to be written: usual ones by name, others as name=(metavar, help).

    One whose help begins with "Required" has to be given. A "drawing" is two: `svg`, and `dxf` for the same in CAD.
    """
    given: dict[str, tuple[str, str]] = {}
    for name, one in {**helps, **{name: WRITTEN[name] for name in names if name not in helps}}.items():
        given |= {"svg": one, "dxf": CAD} if name == "drawing" else {name: one}
    options = {
        name: Option(help_.removeprefix("Required: "), metavar=metavar, required=help_.startswith("Required"))
        for name, (metavar, help_) in given.items()
    }
    return _Written(options, tuple(models.split()))


class Command:
    """A function as a command: called with texts as they were typed, it answers the exit status.

    Attributes
    ----------
    retired : mapping of str to str
        Options that have another word now, each with what is said of it.
    parser : type
        What reads the words.
    fields : mapping of str to str
        What refusals may begin with that is no option's name, and the option (and its part) that is meant.
    """

    def __init__(
        self,
        function: Callable[..., int],
        retired: Mapping[str, str],
        parser: type[PlainCommand],
        fields: Mapping[str, str],
    ) -> None:
        self.function, self.retired, self.parser, self.fields = function, retired, parser, fields
        self.__name__, self.__doc__ = function.__name__, function.__doc__

    @cached_property
    def parameters(self) -> dict[str, tuple[Any, inspect.Parameter]]:
        """What each parameter of the function is, from its annotation."""
        hints = get_type_hints(self.function, include_extras=True)
        return {name: (hints[name], one) for name, one in inspect.signature(self.function).parameters.items()}

    @cached_property
    def options(self) -> dict[str, tuple[str, Option]]:
        """Every option by its name, with the parameter that it belongs to."""
        found: dict[str, tuple[str, Option]] = {}
        for name, (hint, one) in self.parameters.items():
            kind, about = _parted(hint)
            if isinstance(about, _Argument | Option):
                described = about.option if isinstance(about, _Argument) else about
                default = None if one.default is one.empty else one.default
                found[name] = (name, replace(described, default=default, required=one.default is one.empty))
            elif isinstance(about, _Written):
                found |= {word: (name, option) for word, option in about.options.items()}
            else:
                found |= {word: (name, option) for word, option in _taken(kind, about, one.default).items()}
        return found

    def click(self, name: str) -> Any:
        """The command as the parser knows it."""
        program = typer.Typer(add_completion=False, rich_markup_mode=None)
        program.command(name, cls=self.parser)(self._typed())
        made = typer.main.get_command(program)
        vars(made)["retired"] = self.retired
        return made

    def _typed(self) -> Callable[..., int]:
        """A function of texts and flags alone, which is what the parser gives."""

        def run(**given: Any) -> int:
            with self._named():
                return self.function(**self._values(given))

        arguments = [n for n, (hint, _) in self.parameters.items() if isinstance(_parted(hint)[1], _Argument)]
        made = [_parameter(n, option, n in arguments) for n, (_, option) in self.options.items()]
        made.sort(key=lambda one: one.default is not one.empty)
        about: Any = run
        about.__signature__ = inspect.Signature(made, return_annotation=int)
        about.__annotations__ = {one.name: one.annotation for one in made} | {"return": int}
        run.__name__, run.__doc__ = self.__name__, self.__doc__
        return run

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Refusals name options as they are typed, also where a field is called otherwise.

        Raises
        ------
        InputError
            In place of any other.
        """
        words = {name: option.word for name, (_, option) in self.options.items() if option.word}
        try:
            yield
        except InputError as error:
            text = error.spelt(lambda name: as_option(words.get(name, name)))
            raise InputError(self._as_typed(text, words)) from None

    def _as_typed(self, text: str, words: Mapping[str, str]) -> str:
        """A refusal that begins with a field, as those of design do, with the option instead: `--opening: sill ...`."""
        head, colon, rest = text.partition(":")
        first, _, part = head.partition(" ")
        option, _, more = self.fields.get(first, first).partition(" ")
        if not colon or (option not in self.options and not option.isupper()) or " " in part:
            return text
        shown = option if option.isupper() else as_option(words.get(option, option))
        return f"{shown}:{''.join(f' {word}' for word in (more, part) if word)}{rest}"

    def _values(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Values of the function's parameters from what was typed.

        Raises
        ------
        InputError
            A text that says no such value, a value out of range, or a file that cannot be written.
        """
        read: dict[str, dict[str, Any]] = {name: {} for name in self.parameters}
        for name, (parameter, option) in self.options.items():
            hint = _parted(self.parameters[parameter][0])[1]
            if given[name] is None or given[name] == []:
                continue
            as_it_is = option.kind == "flag" or isinstance(hint, _Written)
            where = option.metavar if isinstance(hint, _Argument) else f"`{name}`"
            read[parameter][name] = given[name] if as_it_is else read_option(where, option, given[name])
        read_from = [n for n, (hint, _) in self.parameters.items() if getattr(_parted(hint)[1], "source", False)]
        sources = [given[name] for name in read_from if given[name] is not None]
        values: dict[str, Any] = {}
        for name, (hint, one) in self.parameters.items():
            kind, about = _parted(hint)
            if isinstance(about, _Argument | Option):
                if name in read[name]:
                    values[name] = read[name][name]
                    check_option(name, self.options[name][1], values[name])
            elif isinstance(about, _Written):
                values[name] = Files.planned(read[name], sources, about.models)
            else:
                given_to = kind if one.default is one.empty else partial(replace, one.default)
                values[name] = given_to(**read[name])
                check_options(values[name])
        return values


def command(
    parser: type[PlainCommand] = PlainCommand, fields: Mapping[str, str] | None = None, **retired: str
) -> Callable[[Callable[..., int]], Command]:
    """Make a command of a function; `retired` are options by their old names, and what is said to who types one."""
    return lambda function: Command(function, retired, parser, fields or {})


def _parted(hint: Any) -> tuple[Any, Any]:
    """A type and what an annotation says of it."""
    if get_origin(hint) is Annotated:
        kind, *about = get_args(hint)
        return kind, about[0]
    return hint, None


def _taken(kind: Any, about: _Some | None, base: Any) -> dict[str, Option]:
    """Options of a dataclass that a command takes."""
    assert is_dataclass(kind), kind
    every = options_of(kind)
    names, helps = (tuple(every), {}) if about is None else (about.names, about.helps)
    taken = {name: replace(every[name], help=helps.get(name, every[name].help)) for name in names}
    if base is inspect.Parameter.empty:
        return taken
    return {name: replace(option, default=getattr(base, name)) for name, option in taken.items()}


def _parameter(name: str, option: Option, bare: bool) -> inspect.Parameter:
    """One parameter of text as typer wants it annotated."""
    kept: dict[str, Any] = {
        "metavar": option.takes or None,
        "help": spelt(shown_default(option), as_option),
        "show_default": False,
    }
    typed: Any = str if option.required else str | None
    default: Any = inspect.Parameter.empty if option.required else None
    if option.kind == "flag":
        both = option.default is not False  # None and True can be denied
        word = as_option(option.word or name)
        about: Any = typer.Option(f"{word}/--no-{word[2:]}" if both else word, **(kept | {"metavar": None}))
        typed, default = (bool | None, None) if both else (bool, False)
    elif bare:
        about = typer.Argument(**kept)
    else:
        about = typer.Option(as_option(option.word or name), **kept)
        typed = list[str] | None if option.repeated else typed
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[typed, about])
