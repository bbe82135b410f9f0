"""An autonomy that is a trained policy."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

from tussle.api import Autonomy, GroupView, Output, Param, State
from tussle.api.channel_map import CHANNEL_UNITS
from tussle.plugins import stock

SHIPPED = Path(str(files("tussle.plugins.stock.autonomy.learned")))
"""Folder of the policies that ship; docs/learning.md tells how each was trained."""
EXAMPLE = SHIPPED / "predator_team.onnx"
"""A team of predators, trained by `tussle train tussle/PredatorTeam-v0`."""


def policy_path(policy: str) -> str:
    """The file that a mission names, or of a policy that ships, "prey_escape"; by default the team of predators."""
    shipped = SHIPPED / f"{policy}.onnx"
    return str(shipped) if policy.isidentifier() and shipped.is_file() else policy or str(EXAMPLE)


class Learned(Autonomy):
    """Flies as a policy from an ONNX file decides, which was trained for a task of `tussle.rl`.

    It observes and acts as agents of the task do: the task's own code computes observations, (n, numbers), and maps the outputs to
    channels: for ranges, one number of -1 to 1 for each; for levels, a number for each level, of which the greatest counts. The
    policy decides in each `decide_every` steps of the task's mission; outputs stay in between. Parameters that the task holds
    constant are those of this mission; channels that no action sets are 0, unless the task keeps other autonomies.

    A policy with memory has further inputs and outputs: what an output returns is given to the input at the same place in the next
    decision of the same entity. Each entity begins with zeros.

    One inference serves all entities of all worlds, in batches of a fixed size, so that results do not depend on the stack; they may
    differ between machines. It needs `pip install 'tussle[policy,rl]'`.
    """

    grade = "machine"

    policy = Param(
        "",
        doc="The ONNX file, or a folder of them, of which the seed of each world draws one; or the name of one that ships, such as "
        "prey_escape; by default predator_team.",
    )
    task = Param(
        "", doc="Registered id of the task, tussle/PredatorTeam-v0; by default that in the file's metadata."
    )
    block = Param(
        "", doc="Block of the task whose observations and actions are used; by default its only one."
    )
    memory = State(doc="What the policy keeps from one decision to the next.")
    for _channel, _unit in CHANNEL_UNITS.items():
        vars()[_channel] = Output(unit=_unit, doc="Command.")

    def _flight(self) -> Any:
        """The policy and its task, from the file."""
        load = stock.import_class("tussle.rl.flight:load_flight")  # `tussle.rl` is above this package
        return load(policy_path(self.policy), self.task, self.block)

    def offered_outputs(self) -> list[str]:
        """Return the channels that the actions of the task set."""
        return list(self._flight().channels)

    def state_size(self, name: str) -> int:
        """Return the number of values that the policy keeps for an entity, or 1 if it keeps none."""
        n: int = self._flight().n_kept
        return max(1, n)

    def unused_states(self) -> tuple[str, ...]:
        """Return the memory, if the policy has none."""
        return () if self._flight().n_kept else ("memory",)

    def step(self, g: GroupView) -> None:
        flight = self._flight()
        flight.decide(g, {name: getattr(self, name) for name in flight.channels}, self.memory, self.rate)
