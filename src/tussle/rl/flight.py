"""Policies from ONNX files: checked, and applied to the rows of a simulation as the task's agents."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from math import prod
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from tussle.api import GroupView
from tussle.api.channel_map import CHANNEL_UNITS
from tussle.documents import read_bytes
from tussle.errors import MissingExtraError, ParameterError, listed, nearest_name
from tussle.folders import real_path
from tussle.mission import Mission
from tussle.numeric import rng
from tussle.rl.action import Actor, Decoder, learned
from tussle.rl.computed import Computed
from tussle.rl.observation import AgentRows
from tussle.rl.policy_file import TASK_KEY
from tussle.rl.reward import Situation
from tussle.rl.swarm import task_of
from tussle.rl.task import Task

BATCH = 64
"""Rows per inference. Runtimes may sum in another order in a batch of another size, so the last one is filled up."""
MAX_BYTES = 256 * 2**20
"""Largest policy: a perceptron with layers of 4096 has 64 MiB."""

MAX_MEMORY = 4 * 2**30
"""Memory of the weights and layers of all policies in a process: a few nodes could otherwise ask for any amount."""
MAX_POLICIES = 64
"""Policies of a folder."""
MAX_MEMORY_NUMBERS = 2**14
"""Numbers that an agent keeps: two LSTM layers of 4096 keep as many. A small file could otherwise ask for any amount per entity."""


@dataclass(frozen=True)
class Kept:
    """An input of a network that gets what an output returned in the decision before.

    Attributes:
        given: Name of the input; returned: of the output.
        shape: Shape of one agent's part.
        axis: Place of the agents among the axes.
    """

    given: str
    returned: str
    shape: tuple[int, ...]
    axis: int


class Policy:
    """An inference session of an ONNX file, which is one network without loops from (n, width) to (n, outputs).

    With more inputs it has memory: each of them gets, in the next decision of the same agent, what the output at the same place
    among the outputs has returned, and zeros in the first decision.

    Args:
        path: The file. Weights in other files are read from its folder only.

    Attributes:
        task: Name of the task in the metadata, or "".
        width: Numbers of an observation that it takes; n_out: numbers that it returns.
        n_kept: Numbers that it keeps from one decision of an agent to the next.

    Raises:
        MissingExtraError: onnxruntime or onnx is not installed.
        ParameterError: The file cannot be used.
    """

    def __init__(self, path: str) -> None:
        try:
            import onnxruntime
        except ImportError:
            raise MissingExtraError("Learned needs onnxruntime: pip install 'tussle[policy]'") from None
        self.path = path
        model = self._model()
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.use_deterministic_compute = True
        if has_limited_memory():
            options.add_session_config_entry("session.use_env_allocators", "1")
        options.log_severity_level = 4
        try:
            session = onnxruntime.InferenceSession(
                model.SerializeToString(), options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:  # noqa: BLE001 - the runtime has a class for each of its codes
            raise self._refused(f"onnxruntime refuses it: {str(error).splitlines()[0][:200]}") from None
        self._session = session
        self.task = session.get_modelmeta().custom_metadata_map.get(TASK_KEY, "")
        inputs, outputs = session.get_inputs(), session.get_outputs()
        if len(inputs) != len(outputs):
            raise self._refused(
                f"its inputs are {', '.join(_shown(end) for end in inputs)}, its outputs {', '.join(_shown(end) for end in outputs)}; a "
                "policy has as many outputs as inputs: the first are observation and action, and what the second output returns is "
                "given to the second input in the next decision"
            )
        self.width, self.n_out = self._columns(inputs[0]), self._columns(outputs[0])
        self._kept = [self._pair(*ends) for ends in zip(inputs[1:], outputs[1:], strict=True)]
        self._parts = np.cumsum([0, *(prod(kept.shape) for kept in self._kept)])
        self.n_kept = int(self._parts[-1])
        if self.n_kept > MAX_MEMORY_NUMBERS:
            raise self._refused(
                f"it keeps {self.n_kept:,} numbers for each agent; at most {MAX_MEMORY_NUMBERS:,} are allowed"
            )
        self._observation = inputs[0].name
        self._returned = [outputs[0].name, *(kept.returned for kept in self._kept)]
        self._check_rows()

    def _check_rows(self) -> None:
        """Refuse a network in which a row depends on others, or on chance: a world would depend on its stack."""
        numbers = np.sin(np.arange(BATCH * (self.width + self.n_kept))).astype(np.float32).reshape(BATCH, -1)
        one = self._run(*np.split(numbers, [self.width], axis=1))
        numbers[1::2] = 0.0
        other = self._run(*np.split(numbers, [self.width], axis=1))
        shapes = (BATCH, self.n_out), (BATCH, self.n_kept)
        if [found.shape for found in one] != [*shapes] or not all(
            np.array_equal(a[::2], b[::2], equal_nan=True) for a, b in zip(one, other, strict=True)
        ):
            raise self._refused(
                "outputs of a row depend on other rows or on chance; a policy decides for each agent by what that agent observes and keeps"
            )

    def _refused(self, why: str) -> ParameterError:
        return ParameterError(f"Learned.policy = {self.path!r}: {why}")

    def _model(self) -> Any:
        """The file's content, with the weights from other files."""
        try:
            import onnx
        except ImportError:
            raise MissingExtraError("Learned needs onnx: pip install 'tussle[policy]'") from None
        path = Path(self.path)
        if not path.is_file():
            raise self._refused("there is no such file; it takes an ONNX file")
        if path.stat().st_size > MAX_BYTES:
            raise self._refused(f"it has more than {MAX_BYTES // 2**20} MiB")
        data = read_bytes(path, ParameterError, MAX_BYTES)
        try:
            model = onnx.load_model_from_string(data)
        except Exception:  # noqa: BLE001 - a class of protobuf, which onnx does not export
            model = None
        if model is None or not model.graph.node:
            raise self._refused("it is not an ONNX file")
        folder = real_path(path.parent)
        for tensor in tensors_of(model.graph, self._refused):
            if tensor.data_location == onnx.TensorProto.EXTERNAL:
                location = next((e.value for e in tensor.external_data if e.key == "location"), "")
                other = real_path(folder / location)
                if not (
                    other.is_relative_to(folder) and other.is_file() and other.stat().st_size <= MAX_BYTES
                ):
                    raise self._refused(
                        f"weights in {location!r} are not allowed; they are in the file itself, or in a file of at most "
                        f"{MAX_BYTES // 2**20} MiB in its folder"
                    )
        try:
            onnx.load_external_data_for_model(model, str(folder))
        except Exception as error:  # noqa: BLE001 - onnx raises errors of several bases
            raise self._refused(f"weights cannot be read: {str(error)[:200]}") from None
        return model

    def _columns(self, end: Any) -> int:
        """Width of the observation, or of the action."""
        shape = end.shape
        if (
            end.type == "tensor(float)"
            and len(shape) == 2
            and not isinstance(shape[0], int)
            and isinstance(shape[1], int)
        ):
            return int(shape[1])
        raise self._refused(
            f"{_shown(end)} is not allowed; observation and action, the first input and output, are each a tensor(float) of a free number "
            "of rows and a fixed number of columns"
        )

    def _pair(self, given: Any, returned: Any) -> Kept:
        """An input after the first and the output at the same place."""
        free = [axis for axis, n in enumerate(given.shape) if not isinstance(n, int)]
        sizes = [n for n in given.shape if isinstance(n, int)]
        if given.type != "tensor(float)" or len(free) != 1 or not sizes or min(sizes) < 1:
            raise self._refused(
                f"{_shown(given)} is not allowed; an input that gets what an output returned before is a tensor(float) of which one size, "
                "the number of agents, is free, and the others are fixed"
            )
        if (
            returned.type != given.type
            or len(returned.shape) != len(given.shape)
            or any(isinstance(n, int) and n != m for n, m in zip(returned.shape, given.shape, strict=True))
        ):
            raise self._refused(
                f"what {_shown(returned)} returns does not fit {_shown(given)}, which gets it in the next decision: the input and the "
                "output at the same place have the same type and sizes"
            )
        return Kept(given.name, returned.name, tuple(sizes), free[0])

    def __call__(self, obs: np.ndarray, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Outputs for observations, (n, width), as (n, n_out), and what agents keep, (n, n_kept), of what they have kept."""
        n = len(obs)
        out, after = np.empty((n, self.n_out), np.float32), np.empty((n, self.n_kept), np.float32)
        rows = np.zeros((BATCH, self.width), np.float32)
        before = np.zeros((BATCH, self.n_kept), np.float32)
        for first in range(0, n, BATCH):
            some, part = min(BATCH, n - first), slice(first, first + BATCH)
            rows[:some], rows[some:], before[:some], before[some:] = obs[part], 0.0, kept[part], 0.0
            out[part], after[part] = (found[:some] for found in self._run(rows, before))
        return out, after

    def _run(self, rows: np.ndarray, before: np.ndarray) -> tuple[Any, Any]:
        given = {self._observation: np.ascontiguousarray(rows)}
        for kept, first, last in zip(self._kept, self._parts, self._parts[1:], strict=False):
            part = before[:, first:last].reshape(BATCH, *kept.shape)
            given[kept.given] = np.ascontiguousarray(np.moveaxis(part, 0, kept.axis))
        try:
            out, *after = self._session.run(self._returned, given)
        except Exception as error:  # noqa: BLE001 - the runtime has a class for each of its codes
            raise self._refused(f"onnxruntime cannot apply it: {str(error).splitlines()[0][:200]}") from None
        for part, kept in zip(after, self._kept, strict=True):
            if part.shape != given[kept.given].shape:
                raise self._refused(
                    f"its output {kept.returned!r} returns {part.shape}, and its input {kept.given!r} takes {given[kept.given].shape}"
                )
        parts = [np.moveaxis(part, kept.axis, 0) for part, kept in zip(after, self._kept, strict=True)]
        return out, np.concatenate([before[:, :0], *(part.reshape(BATCH, -1) for part in parts)], axis=1)


def _shown(end: Any) -> str:
    """Name, type and sizes of an input or output; None is a free size."""
    return f"{end.name!r:.60} {end.type} {end.shape!s:.100}"


@cache
def has_limited_memory() -> bool:
    """Limit the memory of the policies of this process; false where onnxruntime does not let us."""
    import onnxruntime

    memory = onnxruntime.OrtMemoryInfo(
        "Cpu", onnxruntime.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, onnxruntime.OrtMemType.DEFAULT
    )
    try:
        onnxruntime.create_and_register_allocator(
            memory, onnxruntime.OrtArenaCfg({"max_mem": MAX_MEMORY, "arena_extend_strategy": 1})
        )
    except Exception:  # noqa: BLE001 - another library of this process has registered one
        return False
    return True


def tensors_of(graph: Any, refused: Callable[[str], ParameterError]) -> Iterator[Any]:
    """All tensors of a graph; refuses nodes with graphs of their own, such as loops, which need not end."""
    yield from graph.initializer
    for node in graph.node:
        for attribute in node.attribute:
            if attribute.HasField("g") or attribute.graphs:
                raise refused(f"{node.op_type} is not allowed; a policy has no loops and branches")
            yield from [attribute.t] if attribute.HasField("t") else []
            yield from attribute.tensors


class LearnedFlight:
    """Policies of one form as the agents of one block of a task; in each world one of them flies, which the world's seed draws.

    Attributes:
        channels: Channels that they set.
        n_kept: Numbers that an agent keeps from one decision to the next, with the policy that keeps most.
    """

    def __init__(self, policies: Sequence[Policy], task: Task, name: str, block: str) -> None:
        self.policies, self.task = policies, task
        self.n_kept = max(policy.n_kept for policy in policies)
        self._draw = rng.stream_key("Learned", name)
        blocks = {b.name: b for b in task.blocks}
        if block not in blocks and (block or len(blocks) > 1):
            raise ParameterError(
                f"Learned.block = {block!r}: {name} has no such block{nearest_name(block, blocks)}; {listed(blocks)}"
            )
        self.block = block or next(iter(blocks))
        self._fits: tuple[Any, set[int]] = (None, set())
        acts = task.acts(self.block)
        for act in acts:
            if act.value is None and "." in act.target:
                raise ParameterError(
                    f"Learned: {name} sets {act.target}; a policy flies where the actions of its task set channels"
                )
        played = learned(blocks[self.block], acts)
        actor = next(type(p) for p in played.autonomy if isinstance(p, Actor))
        self.channels, self._constants = tuple(actor.outputs()), actor.constants
        for channel in self.channels:
            if channel not in CHANNEL_UNITS:
                raise ParameterError(
                    f"Learned: {name} sets channel {channel!r}, which no vehicle that ships reads{nearest_name(channel, CHANNEL_UNITS)}; "
                    f"give the input of the motion model or controller another name; {listed(CHANNEL_UNITS)}"
                )
        self._decoder = Decoder(self.block, acts, np.float32)
        width, sizes = sum(task.widths[self.block]), self._decoder.sizes
        n_out = len(sizes) if self._decoder.is_continuous else int(sizes.sum())
        for policy in policies:
            if (policy.width, policy.n_out) != (width, n_out):
                raise ParameterError(
                    f"Learned.policy = {policy.path!r} takes {policy.width} and returns {policy.n_out} numbers; agents of {name} "
                    f"observe {width} and decide by {n_out}"
                )
        is_computed = any(isinstance(c, Computed) for c in task.components(self.block))
        if len(blocks) > 1 and (is_computed or task.has_mask):
            what = "Computed observations" if is_computed else "a mask"
            raise ParameterError(
                f"Learned: {name} has {what} of several blocks; give each block its own task"
            )

    def decide(
        self, g: GroupView, columns: Mapping[str, np.ndarray], memory: np.ndarray, rate: float | None
    ) -> None:
        """Set the channels of the rows whose decision is due, by name, and what they keep, (numbers, n), at a rate [Hz]."""
        simulation = g.context.simulation()
        interval = self.task.given.dt * self.task.decide_every
        every = round(interval / simulation.mission.dt)
        if abs(every * simulation.mission.dt - interval) > 1e-9 * interval:
            raise ParameterError(
                f"Learned: the policy decides every {interval:g} s, which is no multiple of the mission's dt = {simulation.mission.dt:g} s"
            )
        calls = interval * rate if rate is not None else 1.0
        if abs(calls - round(calls)) > 1e-9 or calls < 0.5:
            raise ParameterError(
                f"Learned: rate = {rate:g} Hz is not allowed; the policy decides every {interval:g} s, so it takes a multiple of "
                f"{1.0 / interval:g} Hz, or None"
            )
        due = np.flatnonzero(g.step_count % every == 0)
        if not len(due):
            return
        for name, value in self._constants.items():
            columns[name][due] = value
        g.context.has_chance |= len(self.policies) > 1
        share = rng.uniform(g.context.seeds, self._draw, 0, 0)[0]
        which = (share * len(self.policies)).astype(int)[g.world[due]]
        if len(memory) != max(1, self.n_kept):
            raise ParameterError(
                f"Learned.policy = {self.policies[0].path!r} was replaced by one that keeps another number of values, {self.n_kept} "
                f"instead of {len(memory)}; make a new simulation"
            )
        obs, allowed = (each[due] for each in self.observe(simulation, g))
        out, kept = np.empty((len(due), self.policies[0].n_out), np.float32), memory[:, due].T
        for k in np.unique(which):
            policy, mine = self.policies[k], np.flatnonzero(which == k)
            out[mine], kept[mine, : policy.n_kept] = policy(obs[mine], kept[mine, : policy.n_kept])
        memory[:, due] = kept.T
        if not self._decoder.is_continuous:
            edges = np.cumsum(self._decoder.sizes)[:-1]
            stuck = np.flatnonzero([~free.any(axis=1) for free in np.split(allowed, edges, axis=1)])
            if len(stuck):
                row = int(due[stuck[0] % len(due)])
                g.fail(row, f"action_mask of {type(self.task).__name__} leaves {g.who(row)} no level")
            parts = np.split(np.where(allowed | np.isnan(out), out, -np.inf), edges, axis=1)
            actions = np.stack([part.argmax(axis=1) for part in parts], axis=1)
            actions[~np.all([part.max(axis=1) > -np.inf for part in parts], axis=0)] = -1
        else:
            actions = out.astype(float)
        wrong = self._decoder.decode(actions, np.arange(len(due)), due, columns.__getitem__)
        if wrong >= 0:
            path = self.policies[which[wrong]].path
            g.fail(int(due[wrong]), f"the policy {path} returned a value that is not a number")
        lost = np.flatnonzero(~np.isfinite(kept).all(axis=1))
        if len(lost):
            path = self.policies[which[lost[0]]].path
            g.fail(int(due[lost[0]]), f"the policy {path} keeps a value that is not a finite number")

    def _check_fit(self, mission: Mission, number: int) -> None:
        """Refuse a block of a mission in which agents observe more or less than in the task."""
        if self._fits[0] is not mission:
            self._fits = mission, set()
        if number in self._fits[1]:
            return
        name, where = mission.blocks[number].name, f"Learned: observation of {type(self.task).__name__}"
        try:
            for component, n in zip(
                self.task.components(self.block), self.task.widths[self.block], strict=True
            ):
                if (width := component.width(mission, name)) != n:
                    raise ParameterError(
                        f"{type(component).__name__} has {width} numbers in this mission, and {n} in that of the task: "
                        "the blocks that it names have the same counts, and plugins the same columns"
                    )
        except ParameterError as error:
            raise ParameterError(f"{where}: {error}") from None
        self._fits[1].add(number)

    def observe(self, simulation: Any, g: GroupView) -> tuple[np.ndarray, np.ndarray]:
        """Observations of all rows, (n, numbers), and which levels they may choose, (n, levels): the task computes them, as in a swarm."""
        rows = g.first + np.arange(g.n)
        group = next(
            group for group in simulation.state.population.groups if group.first <= g.first < group.last
        )
        width = self.policies[0].width
        seen = np.zeros((g.n, width), self.task.dtype)
        allowed = np.ones((g.n, self.policies[0].n_out), bool)
        for number in np.unique(g.block):
            self._check_fit(simulation.mission, int(number))
            mine = np.flatnonzero(g.block == number)
            place = g.block_index[mine]
            count = max(simulation.mission.blocks[number].count, int(place.max()) + 1)
            agents = g.world[mine] * count + place
            out = np.zeros((simulation.n_worlds * count, width), self.task.dtype)
            span = int(rows[mine[0]]), int(rows[mine[-1]]) + 1
            part = AgentRows(self.block, group, rows[mine], agents, g.team[mine].astype(float), {}, span)
            column = 0
            for component, n in zip(
                self.task.components(self.block), self.task.widths[self.block], strict=True
            ):
                component.write(simulation, part, column, out)
                column += n
            seen[mine] = out[agents]
            if self.task.has_mask:
                allowed[mine] = self._mask(simulation, part, count)[agents]
        return seen, allowed

    def _mask(self, simulation: Any, part: AgentRows, count: int) -> np.ndarray:
        """The task's mask of the agents of a block, up to `count` in each world, (worlds count, levels)."""
        alive = np.zeros((simulation.n_worlds, count), bool)
        now = Situation(simulation, np.full(count, part.team[0]), alive)
        alive.reshape(-1)[part.agents] = True
        now.id.reshape(-1)[part.agents] = simulation.state.population.bodies.id[part.rows]
        now.look([part])
        del now.was_alive, now.died, now.actions, now._events  # of the last decision, which is not known
        shape = *alive.shape, self.policies[0].n_out
        found = np.asarray(self.task.action_mask(now))
        if found.dtype != bool:
            raise ParameterError(
                f"{type(self.task).__name__}.action_mask returns {found.dtype}; it returns truth values, {shape}"
            )
        return np.broadcast_to(found, shape).reshape(-1, shape[2])


def registered_tasks() -> dict[str, Any]:
    """The tasks, or classes of them, that are registered, by id."""
    return {
        key: spec.kwargs["task"]
        for key, spec in gymnasium.registry.items()
        if spec.entry_point == "tussle.rl.environments:TaskEnv"
    }


def registered_task(name: str, where: str) -> Task:
    """The task that is registered under an id.

    Args:
        name: The id, such as "tussle/Battle-v0".
        where: What names it, for the error.

    Raises:
        ParameterError: There is none.
    """
    known = registered_tasks()
    if name not in known:
        near = nearest_name(name, known) or nearest_name(f"tussle/{name}-v0", known)
        what = f"there is no task {name!r}{near}" if name else "name one"
        raise ParameterError(f"{where}: {what}; {listed(known)}; `tussle.rl.register` adds others")
    return task_of(known[name])


def load_flight(path: str, task: str, block: str) -> LearnedFlight:
    """A policy, or those of a folder, with their task; read once per version of each file.

    Raises:
        MissingExtraError: A package is not installed.
        ParameterError: File, task or block cannot be used.
    """
    files = [Path(path)]
    if files[0].is_dir():
        files = sorted(files[0].glob("*.onnx"))[: MAX_POLICIES + 1]
        if not 0 < len(files) <= MAX_POLICIES:
            n = f"more than {MAX_POLICIES}" if files else "no"
            raise ParameterError(
                f"Learned.policy = {path!r}: the folder has {n} ONNX files; it takes 1 to {MAX_POLICIES}"
            )
    stats = [(file, file.stat() if file.is_file() else None) for file in files]
    stamps = tuple(
        (str(file), (found.st_mtime_ns, found.st_ino) if found else (0, 0)) for file, found in stats
    )
    return _flight(stamps, task, block)


@lru_cache(maxsize=64)
def _flight(stamps: tuple[tuple[str, tuple[int, int]], ...], task: str, block: str) -> LearnedFlight:
    policies = [_policy(*stamp) for stamp in stamps]
    name = task or policies[0].task
    file = policies[0].path
    where = f"metadata of {file}, {TASK_KEY}" if name else f"{file} names no task"
    if task:
        where = "Learned.task"
    return LearnedFlight(policies, registered_task(name, where), name, block)


@lru_cache(maxsize=2 * MAX_POLICIES)
def _policy(path: str, stamp: tuple[int, int]) -> Policy:
    return Policy(path)


__all__ = ["LearnedFlight", "Policy", "load_flight", "registered_task", "registered_tasks"]
