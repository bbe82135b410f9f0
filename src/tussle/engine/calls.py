"""The calls of a step as a list that users can extend."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, overload

from tussle.api.group import GroupView
from tussle.arguments import check_kind, explained
from tussle.errors import ParameterError, listed, nearest_name


@dataclass(frozen=True, slots=True)
class Call:
    """One entry of the schedule.

    Attributes:
        label: Its description, which `describe` prints.
        run: The function to call.
        names: What it is called by in `Schedule.insert`: "motion", "Unicycle"; besides them, its label.
        views: Views of plugins that only call kernels; none if there may be others.
    """

    label: str
    run: Callable[[], None]
    names: tuple[str, ...] = ()
    views: tuple[GroupView, ...] = ()


@explained
class Schedule(Sequence[Call]):
    """The calls of a step, in order.

    Calls that were inserted stay where they were put when plugins of new groups join the schedule.

    Args:
        compose: Returns the calls of the plugins and of the engine.
        join: Returns the functions of a step for its calls; one function may be that of several calls.
        owner: What inserted functions are called with.
    """

    def __init__(
        self,
        compose: Callable[[], list[Call]],
        join: Callable[[list[Call]], list[Callable[[], None]]],
        owner: Callable[[], Any],
    ) -> None:
        self._compose, self.join, self._owner = compose, join, owner
        self._calls: list[Call] | None = None
        self._functions: list[Callable[[], None]] | None = None
        self._inserted: list[tuple[str, bool, Call]] = []

    @property
    def calls(self) -> list[Call]:
        """The calls, composed when they are asked for and something has changed."""
        if self._calls is None:
            calls = self._compose()
            for name, is_before, call in self._inserted:
                calls.insert(_place(calls, name, is_before), call)
            self._calls = calls
        return self._calls

    @property
    def functions(self) -> list[Callable[[], None]]:
        """The functions of a step, in order."""
        if self._functions is None or self._calls is None:
            self._functions = self.join(self.calls)
        return self._functions

    def forget(self) -> None:
        """Compose the calls again before the next step."""
        self._calls = None

    def insert(
        self,
        *,
        before: str | None = None,
        after: str | None = None,
        call: Callable[[Any], object],
        name: str | None = None,
    ) -> Call:
        """Call a function in each step, with the simulation.

        What it reads and writes with `Simulation.read` and `Simulation.write` is the state at that place of the step. The results stay
        repeatable if it is a function of that state. An exception in it ends the step, and is not recorded as one of a plugin.

        Args:
            before: Name of a call; the function is called before the first of that name. A name is a kind ("autonomy", "controller",
                "motion", "sensor", "interaction", "metric"), a plugin ("Boids"), the whole label of a call as `describe` prints it, or
                the name of one that was inserted.
            after: Likewise; it is called after the last of that name.
            call: The function.
            name: What `describe` calls it; by default the name of the function.

        Returns:
            The inserted call, which `remove` takes.

        Raises:
            ParameterError: No call has that name, or not exactly one place is given.
        """
        if (before is None) == (after is None):
            raise ParameterError(
                f"before = {before!r}, after = {after!r}: exactly one of them is a name of a call"
            )
        check_kind("insert: call", call, Callable[[Any], object])
        label = name or str(getattr(call, "__name__", type(call).__name__))
        owner = self._owner

        def run() -> None:
            call(owner())

        made = Call(label, run)
        place = (before, True) if before is not None else (str(after), False)
        self.calls.insert(_place(self.calls, *place), made)
        self._functions = None
        self._inserted.append((*place, made))
        return made

    def remove(self, call: Call) -> None:
        """Take out a call that was inserted.

        Raises:
            ParameterError: It was not inserted, has been removed, or is the place of another one.
        """
        kept = [each for each in self._inserted if each[2] is not call]
        if len(kept) == len(self._inserted):
            raise ParameterError(f"{call.label!r} is not an inserted call; only those can be removed")
        for name, _, other in kept:
            if name == call.label:
                raise ParameterError(
                    f"{call.label!r} is the place of {other.label!r}, which is removed first"
                )
        self._inserted = kept
        self.forget()

    @overload
    def __getitem__(self, place: int) -> Call: ...
    @overload
    def __getitem__(self, place: slice) -> list[Call]: ...
    def __getitem__(self, place: int | slice) -> Call | list[Call]:
        return self.calls[place]

    def __len__(self) -> int:
        return len(self.calls)

    def __iter__(self) -> Iterator[Call]:
        return iter(self.calls)


def _place(calls: list[Call], name: str, is_before: bool) -> int:
    found = [place for place, call in enumerate(calls) if name in (call.label, *call.names)]
    if not found:
        known = list(dict.fromkeys(each for call in calls for each in call.names or (call.label,)))
        raise ParameterError(
            f"no call of the schedule is named {name!r}{nearest_name(name, known)}; {listed(known)}"
        )
    return found[0] if is_before else found[-1] + 1
