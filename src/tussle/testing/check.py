"""The conformance kit: `check_plugin(MyPlugin)` in a test checks a plugin against the contract."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from tussle.api import MotionModel, Plugin
from tussle.errors import ConformanceError, TussleError, WiringError
from tussle.testing.declarations import check_declarations
from tussle.testing.game import build
from tussle.testing.limits import check_limits
from tussle.testing.motion import check_motion
from tussle.testing.stacks import Traces, check_kernels, check_reset, check_snapshot, check_stacks
from tussle.testing.watch import check_calls, check_class_values, class_values


def check_plugin(cls: type[Plugin], *, companions: Sequence[Any] | None = None, **params: Any) -> None:
    """Check a plugin class against the contract, in small games that are built around it.

    The rules, by the names that errors give them:

    * declarations: a docstring, no lists or dicts on the class, hooks only, SI units, valid defaults.
    * own columns, memory in columns: calls change the plugin's own columns only, and store nothing elsewhere.
    * draws: no label is drawn twice in a step, which would give the same numbers.
    * stack invariance: a world is bit-identical alone and in stacks of 1, 2, 7 and 64, in another order, with threads, deaths,
      births during the run, moved entities, and worlds that end at different times.
    * only_calls_kernels: where the plugin promises it, its kernels called without it give the same bits.
    * reset: reset worlds equal new ones, and the other worlds do not change. snapshot: the same future follows after a restore.
    * finite: all numbers stay finite at every finite bound, and at 0.1 and 10 times each default.
    * velocity, rollout, rows, body round trip, from_body, order of convergence, convergence, advance: for motion models. vel is the
      rate of pos; a rollout equals the flight; a kernel solves its equation.
    * runs: the plugin fits the game and raises no error.

    Each value of a structural boolean and each choice of a text parameter is checked too, if it fits the companions. For grade
    "external", the rules that need repeatable runs are skipped.

    Args:
        cls: The class.
        companions: Plugins as data that it needs, in place of the kit's own: a motion model, an interaction, a network ...
        **params: Parameters other than the defaults.

    Raises:
        ConformanceError: The plugin breaks a rule; the message names the plugin, the rule and what was observed.
    """
    given: Any = cls
    if not (isinstance(given, type) and issubclass(given, Plugin)):
        raise ConformanceError(
            getattr(cls, "__name__", repr(cls)), "declarations", "check_plugin takes the class of a plugin"
        )
    before = class_values(cls)
    check_declarations(cls)
    plugin = cls(**params)
    for number, variant in enumerate([plugin, *_variants(plugin)]):
        try:
            _play(variant, companions or (), is_first=number == 0)
        except ConformanceError as error:
            check_class_values(cls, before)  # it names the cause
            if number and repr(variant) not in error.evidence:
                text = f"as {variant!r}, {error.evidence}"
                raise ConformanceError(error.plugin, error.rule, text) from error
            raise
        except TussleError as error:
            if number and companions and isinstance(error, WiringError):
                continue  # the companions do not fit this variant
            cause = error.__cause__
            if isinstance(cause, ConformanceError):  # raised inside a call and wrapped as its failure
                raise cause from None
            text = f"as {variant!r} in the kit's game: {error}"
            raise ConformanceError(cls.__name__, "runs", text) from error
        check_class_values(cls, before)


def _play(plugin: Plugin, companions: Sequence[Any], is_first: bool) -> None:
    game = build(plugin, companions)
    check_calls(game)
    if type(plugin).grade != "external":
        if isinstance(plugin, MotionModel):
            check_motion(game, is_first)
        traces = Traces(game)
        check_kernels(game)
        check_stacks(game, traces)
        check_reset(game, traces)
        check_snapshot(game, traces)
    check_limits(game)


def _variants(plugin: Plugin) -> Iterator[Plugin]:
    """The plugin with one structural boolean or one choice changed."""
    for name, column in plugin.params().items():
        value = plugin.values[name]
        if column.structural and column.dtype is bool and not column.is_text:
            yield plugin.replace(**{name: not value})
        elif column.is_text:
            for choice in column.choices:
                if choice != value:
                    yield plugin.replace(**{name: choice})
