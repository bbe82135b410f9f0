"""Commands whose options are the fields of a dataclass, and the options that all commands with a mission share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, Field, dataclass, field, fields
from importlib import import_module
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

import typer
from typer.core import TyperCommand

from tussle.cli import completion
from tussle.cli.terminal import EXIT_CODES, OK, reported, say_note
from tussle.declare.units import parse
from tussle.errors import MissionError, ParameterError

if TYPE_CHECKING:
    from tussle.mission import Loaded, Mission
    from tussle.view.ground_map import GroundMap

# \b keeps click from rewrapping the lines that follow.
EPILOG = "\b\nExit codes:\n" + "\n".join(f"  {code:>3}  {meaning}" for code, meaning in EXIT_CODES.items())
MAX_SEED = 2**64 - 1
RENAMED = {"--log": "--record-runs"}
"""Former names of options."""


def argument(metavar: str, text: str, default: Any = ..., **more: Any) -> Any:
    """A positional argument, as a field of options."""
    return _field(typer.Argument(metavar=metavar, help=text, show_default=False, **more), default)


def option(
    metavar: str | None, text: str, *names: str, default: Any = None, shows_default: bool = False, **more: Any
) -> Any:
    """An option with a value, as a field of options; its name is that of the field where `names` is empty."""
    return _field(
        typer.Option(*names, metavar=metavar, help=text, show_default=shows_default, **more), default
    )


def columns_option() -> Any:
    """The option for columns of plugins that are recorded."""
    return option(
        "COLUMNS",
        "Record these State and Output columns of plugins, too: prey.Boids.goal,'*.goal'; * is any characters.",
    )


def over_option() -> Any:
    """The option for the variable that the answer to a target is about."""
    return option(
        "NAME",
        "The variable whose smallest value is searched; by default the first range, or choice of numbers.",
    )


def flag(name: str, text: str) -> Any:
    """An option without a value, as a field of options."""
    return _field(typer.Option(name, help=text), False)


def _field(declared: Any, default: Any) -> Any:
    """A field with what `add_command` declares. As defaults, ... makes it required, and `list` stands for an empty list."""
    of_default = (
        {"default_factory": list} if default is list else {} if default is ... else {"default": default}
    )
    return field(metadata={"declared": declared}, **of_default)


class TussleCommand(TyperCommand):
    """A command that names the new name of a renamed option, and reads command lines that the shell completes."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Parse the command line.

        Raises:
            typer.BadParameter: The command line is wrong.
        """
        for name in (word.partition("=")[0] for word in args):
            if name in RENAMED and any(RENAMED[name] in each.opts for each in self.params):
                raise typer.BadParameter(f"no such option: {name}; it is now called {RENAMED[name]}")
        for word in args:
            try:
                word.encode()
            except (
                UnicodeEncodeError
            ):  # run and batch directories keep the command and the names of files as text
                raise typer.BadParameter(
                    f"{word!r} is not UTF-8 text; rename the file, or set a locale of UTF-8"
                ) from None
        if not ctx.resilient_parsing:
            self._check_empty(args)
        # The word after an option's name is being completed: without this, the parser would stop before the mission.
        is_cut = ctx.resilient_parsing and bool(args) and any(args[-1] in each.opts for each in self.params)
        return super().parse_args(ctx, args[:-1] if is_cut else args)

    def _check_empty(self, args: list[str]) -> None:
        """Check that no path is an empty word, such as that of a variable of the shell which is not set: it would be the present folder.

        Raises:
            typer.BadParameter: One is.
        """
        asked = signature(self.callback).parameters if self.callback else {}
        taking = {name: key for each in self.params for name in each.opts if (key := each.name) in asked}
        paths = {name for name, key in taking.items() if "Path" in str(get_args(asked[key].annotation)[0])}
        for before, word in zip(["", *args], args, strict=False):
            name = word.removesuffix("=") if word else before
            if name in paths and (word == "" or word.endswith("=")):
                raise typer.BadParameter(f"{name} is empty; it takes a path")
            if not word and not before.startswith("-"):
                raise typer.BadParameter("an argument is empty; it takes a path or a name")


def add_command(
    app: typer.Typer, name: str, options: type[Any], target: str, cls: type[TyperCommand] = TussleCommand
) -> None:
    """Add a command with an option for each field of a dataclass, and `--debug`.

    Args:
        app: The command line.
        name: Name of the command.
        options: The dataclass; its docstring is the help text of the command.
        target: "module:function". The module is imported when the command runs; the function takes the options and returns the
            exit code, or None for success.
        cls: Parses the command line.
    """
    hints = get_type_hints(options)
    # Own options come first, then those of the base classes.
    declared = {
        key: place
        for place, base in reversed(list(enumerate(options.__mro__)))
        for key in vars(base).get("__annotations__", ())
    }
    parameters = [
        Parameter(
            f.name,
            Parameter.KEYWORD_ONLY,
            default=_default(f),
            annotation=Annotated[hints[f.name], f.metadata["declared"]],
        )
        for f in sorted(fields(options), key=lambda f: declared[f.name])
    ]
    debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")]

    def call(*, debug: bool, **given: Any) -> None:
        with reported(debug):
            module, _, function = target.partition(":")
            asked = options(**{key: value for key, value in given.items() if value is not None})
            code = getattr(import_module(module), function)(asked)
        raise typer.Exit(code or OK)

    call.__signature__ = Signature(  # type: ignore[attr-defined]
        [*parameters, Parameter("debug", Parameter.KEYWORD_ONLY, default=False, annotation=debug)]
    )
    app.command(name, help=options.__doc__, epilog=EPILOG, cls=cls)(call)


def _default(declared: Field[Any]) -> Any:
    if declared.default_factory is not MISSING:
        return None
    return Parameter.empty if declared.default is MISSING else declared.default


def check_positive(**values: float | None) -> None:
    """Check options that take a positive number; None is allowed.

    Raises:
        typer.BadParameter: A number is not positive.
    """
    for name, value in values.items():
        if value is not None and not 0.0 < value < float("inf"):
            option_name = f"--{name.replace('_', '-')}"
            raise typer.BadParameter(f"{option_name} {value:g} is not allowed; it takes a number > 0")


def read_settings(texts: Sequence[str]) -> dict[str, str]:
    """Parse texts "name=value" into a dict.

    Raises:
        typer.BadParameter: A text has another form, or a name is set twice.
    """
    settings: dict[str, str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not name:
            raise typer.BadParameter(
                f"{text!r} does not have the form NAME=VALUE, such as prey.Boids.max_speed='50 kt'"
            )
        if name in settings:
            raise typer.BadParameter(f"{name} is set twice, to {settings[name]!r} and to {value!r}")
        settings[name] = value
    return settings


def read_time(name: str, text: str) -> float:
    """Parse the time of an option [s].

    Raises:
        ParameterError: The text is not a time.
    """
    try:
        return parse(text, "s")
    except ParameterError as error:
        raise ParameterError(f"{name}: {error}") from None


@dataclass(frozen=True, kw_only=True)
class PluginOptions:
    """List all plugins: those of tussle, of other packages, and of your files."""

    plugin_files: list[Path] = option(
        "FILE", "A Python file with plugins. Can be repeated.", "--plugin-path", default=list
    )


@dataclass(frozen=True, kw_only=True)
class MapOptions:
    """A map on the ground of pictures."""

    map_file: Path | None = option(
        "FILE",
        "Show this map on the ground: GeoTIFF, MBTiles, PMTiles, or PNG or JPEG with --map-bounds. The mission needs an origin.",
        "--map",
    )
    map_bounds: str | None = option(
        "W,S,E,N", "Edges of the map in degrees: west, south, east, north.", "--map-bounds"
    )

    @property
    def ground_map(self) -> GroundMap | None:
        """The map; None without one.

        Raises:
            typer.BadParameter: There are bounds without a map.
            ParameterError: The file is no map, or its bounds are not allowed.
        """
        if self.map_file is None:
            if self.map_bounds is not None:
                raise typer.BadParameter("--map-bounds is allowed with --map only")
            return None
        from tussle.view.ground_map import GroundMap, read_bounds

        return GroundMap(self.map_file, None if self.map_bounds is None else read_bounds(self.map_bounds))


@dataclass(frozen=True, kw_only=True)
class MissionOptions(PluginOptions):
    """Check a mission, or all of a folder: read it, build its game, report all errors. Of a run or batch directory, report all damage."""

    mission: str = argument(
        "MISSION",
        "A mission file, a built-in mission, or a plugin, for its example.",
        autocompletion=completion.missions,
    )
    more: list[str] = argument(
        "NAME=VALUE", "Same as --set.", autocompletion=completion.settings, default=list
    )
    seed: int | None = option(
        "N", "Seed of the game; by default that of the mission, or 1.", min=0, max=MAX_SEED
    )
    settings: list[str] = option(
        "NAME=VALUE",
        "Set a variable ${name=default} of the mission, or any value by its path: prey.Boids.max_speed='50 kt', "
        "prey.motion_model=SimpleAircraft, run.dt=0.05. Can be repeated.",
        "--set",
        autocompletion=completion.settings,
        default=list,
    )
    end: str | None = option("TIME", "End the game at this time: 60, or '2 min'.")
    strict: bool | None = option(
        None,
        "Treat unknown tags and attributes of the mission as errors, or ignore them; by default they are errors, "
        "except in missions that were written for SCRIMMAGE.",
        "--strict/--lenient",
    )
    allow_large: bool = flag("--allow-large", "Lift the limits on the size of a mission.")
    compat: str | None = option(
        "LAWS", "Play by other laws than tussle's: scrimmage, for SCRIMMAGE's own where they differ."
    )

    data_path: list[Path] = option(
        "DIR",
        "A folder of data, such as SCRIMMAGE's: aircraft, scripts, maps, terrains that the mission names. Can be repeated; "
        "SCRIMMAGE_DATA_PATH names further ones.",
        "--data-path",
        default=list,
    )

    def __post_init__(self) -> None:
        read_settings([*self.settings, *self.more])
        for folder in self.data_path:
            if not folder.expanduser().is_dir():
                raise MissionError(f"--data-path {folder}: there is no such folder")

    @property
    def given(self) -> dict[str, Any]:
        """All settings by name, including the end time.

        Raises:
            ParameterError: The end time is not a time.
        """
        end = {} if self.end is None else {"run.end": read_time("--end", self.end)}
        return read_settings([*self.settings, *self.more]) | end

    def read(
        self, *, shows_viewer_notes: bool = False, shows_notes: bool = True
    ) -> tuple[Loaded, Mission, int]:
        """Return the mission file as read, the mission, and the seed; print the notes.

        Raises:
            TussleError: The mission cannot be read.
        """
        from tussle.mission import read_mission

        loaded = read_mission(
            self.mission,
            self.given,
            strict=self.strict,
            plugin_files=tuple(self.plugin_files),
            allow_large=self.allow_large,
            compat=self.compat,
            search=self.data_path,
        )
        if shows_notes:
            show_notes(loaded, shows_viewer_notes)
        seed = self.seed if self.seed is not None else loaded.seed if loaded.seed is not None else 1
        return loaded, loaded.mission if self.end is None else loaded.mission.ending_by_time(), seed


def show_notes(loaded: Loaded | None, shows_viewer_notes: bool = False) -> None:
    """Print the notes on a mission file, by default without those on settings of the viewer."""
    if loaded is not None:
        for note in loaded.notes if shows_viewer_notes else loaded.game_notes:
            say_note(note)
