"""Opponents of a task's learners: policies that fly the other side, and the pool that self-play draws them from."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tussle.documents import is_count
from tussle.errors import ParameterError, listed
from tussle.folders import real_path
from tussle.mission import Mission
from tussle.numeric import rng
from tussle.plugins.stock import Learned
from tussle.rl.action import Actor, learned
from tussle.rl.flight import MAX_POLICIES, registered_task, registered_tasks
from tussle.rl.policy_file import kept_file, write_policy
from tussle.rl.swarm import task_of
from tussle.rl.task import Task

PAST = rng.stream_key("tussle.rl", "past")
PAST_EVERY = 10
"""Updates of training between two policies that may become past ones."""
LATEST, FORMER = "latest", "past"


def other_side(name: str, task: Task) -> Task:
    """The task of those who play against the learners.

    Raises:
        ParameterError: It has none.
    """
    if not task.opponents:
        raise ParameterError(
            f"{name} has no other side, since its task has no opponents; {listed(_with_sides())}"
        )
    return registered_task(task.opponents, f"{type(task).__name__}.opponents of {name}")


def _with_sides() -> list[str]:
    """Ids of the registered tasks that have another side."""
    return [name for name, task in registered_tasks().items() if task_of(task).opponents]


def with_policy(mission: Mission, name: str, task: Task, policy: str | Path) -> Mission:
    """A mission in which a policy, or a folder of them, flies the learners of a task.

    Args:
        mission: A mission that has these blocks.
        name: Registered id of the task.
        task: The task.
        policy: The ONNX file or the folder.
    """
    flown = {}
    for block in task.blocks:
        flies = Learned(policy=str(policy), task=name, block=block.name)
        played = learned(block, task.acts(block.name))
        flown[block.name] = played.replace(
            autonomy=tuple(flies if isinstance(plugin, Actor) else plugin for plugin in played.autonomy)
        )
    return mission.replace(blocks=[flown.get(block.name, block) for block in mission.blocks])


class Pool:
    """A folder of policies, of which each episode draws one for the other side: in each world by itself, from its seed.

    Every file is one slot and has an equal share. Slots of the latest policy are rewritten after every update of the training. Slots
    of past ones hold a random sample of all policies so far, one in `PAST_EVERY` updates (reservoir sampling: Vitter 1985, algorithm R).
    Other slots stay as they are.

    Args:
        name: Registered id of the learners' task.
        task: The task.
        folder: The folder. Slots that are there are kept, so that training goes on.
        entries: Each "latest", "past", an ONNX file, or a folder, which stands for all its files; "=3" after it makes three slots.
        seed: Of the sample of past policies.
        first: Policy of the slots of the latest and past ones at first; one that does nothing where the file does not exist.
        memory: Numbers that the learners' policy keeps from one decision to the next.

    Attributes:
        task: The task, in which the pool plays the other side.

    Raises:
        ParameterError: An entry is not allowed, or the task has no other side.
    """

    def __init__(
        self,
        name: str,
        task: Task,
        folder: Path,
        entries: Sequence[str],
        seed: int,
        first: Path,
        memory: int = 0,
    ) -> None:
        other = other_side(name, task)
        self._name, self._seed = name, seed
        slots = [slot for entry in entries for slot in _slots(entry)]
        if not 0 < len(slots) <= MAX_POLICIES:
            raise ParameterError(f"a pool of {len(slots)} slots is not allowed; it takes 1 to {MAX_POLICIES}")
        if not task.is_symmetric and {LATEST, FORMER} & {kind for kind, _ in slots}:
            raise ParameterError(
                f"{name}: 'latest' and 'past' are policies of the learners, and the other side is another one, {task.opponents}; "
                "give policies of that one"
            )
        self._files = [(kind, folder / f"{i:02d}-{kind}.onnx") for i, (kind, _) in enumerate(slots)]
        folder.mkdir(parents=True, exist_ok=True)
        for file in set(folder.glob("*.onnx")) - {file for _, file in self._files}:
            file.unlink()
        for (_, file), (_, source) in zip(self._files, slots, strict=True):
            given = source or first
            if given.is_file():
                if source or not file.exists():
                    with kept_file(file) as part:
                        shutil.copyfile(given, part)
            elif not file.exists():
                decoder, width = other.decoders[0], sum(other.widths[other.blocks[0].name])
                n_out = len(decoder.free) if decoder.is_continuous else int(decoder.sizes.sum())
                last = memory or width
                layers: list[tuple[Any, ...]] = [(np.zeros((n_out, last)), np.zeros(n_out))]
                if memory:
                    sizes = (3 * memory, width), (3 * memory, memory), (3 * memory,), (3 * memory,)
                    layers.insert(0, tuple(map(np.zeros, sizes)))
                write_policy(file, layers, task=name)
        mission = with_policy(task.given, task.opponents, other, real_path(folder))
        self.task = task.replace(mission=mission, overrides={})

    def add(self, layers: Sequence[tuple[Any, ...]], n_updates: int) -> None:
        """Take the learners' policy into the pool.

        Args:
            layers: Its layers, as for `write_policy`.
            n_updates: Updates of the training so far.
        """
        due = [file for kind, file in self._files if kind == LATEST]
        former = [file for kind, file in self._files if kind == FORMER]
        n, rest = divmod(n_updates, PAST_EVERY)
        if former and n and not rest:
            place = int(rng.uniform(self._seed, PAST, 0, n)[0, 0] * n) if n > len(former) else n - 1
            due += former[place : place + 1]
        for file in due:
            write_policy(file, layers, task=self._name)


def _slots(entry: str) -> list[tuple[str, Path | None]]:
    """Kind and file of each slot of an entry: "latest=3" are three.

    Raises:
        ParameterError: It has another form, or there is no such file.
    """
    given, equals, number = entry.strip().rpartition("=")
    given, number = (given, number) if equals else (number, "1")
    if not is_count(number) or len(number) > 3 or not given:
        raise ParameterError(
            f"opponent {entry!r} is not allowed; it takes latest, past, or an ONNX file or folder, and after it =3 for three slots"
        )
    if given in (LATEST, FORMER):
        return [(given, None)] * int(number)
    path = Path(given)
    files = sorted(path.glob("*.onnx")) if path.is_dir() else [path]
    if not files or not all(file.is_file() for file in files):
        raise ParameterError(
            f"opponent {entry!r}: there is no ONNX file {given}; it takes latest, past, or an ONNX file or a folder of them"
        )
    found: list[tuple[str, Path | None]] = [(file.stem, file) for file in files]
    return found * int(number)


__all__ = ["Pool", "other_side", "with_policy"]
