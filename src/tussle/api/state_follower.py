"""The base class of autonomies whose inner plugins act in some states of the entity."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api.kinds import Autonomy
from tussle.declare.columns import Param, State, Subscribe
from tussle.declare.messages import TextMessage


class StateFollower(Autonomy):
    """An autonomy with plugins inside that act in some states of the entity; abstract.

    The state is the last text that the entity received on the topic `state_topic_name` of the network that the subclass names in its
    parameter `network_name`. Inner plugins with `states` act in these, the others always. Before the first text only the latter act.
    """

    state_topic_name = Param("State", doc="Topic of the entity's state.")
    state = State(
        dtype=int, default=-1, doc="Number of the state among those named by inner plugins; -1 for others."
    )
    told_state = Subscribe(TextMessage, network_param="network_name", topic_param="state_topic_name")

    def unused_states(self) -> tuple[str, ...]:
        """Return `state` if no inner plugin has states."""
        return () if self._names() else ("state",)

    def read_state(self) -> None:
        """Update `state` with the messages received; call it once in each step."""
        names = self._names()
        if names and self.told_state:
            rows, received = self.told_state.latest()
            number = {name: i for i, name in enumerate(names)}
            self.state[rows] = [number.get(text, -1) for text in received.text]

    def acts(self, plugin: Any, state: np.ndarray | None = None) -> np.ndarray | None:
        """Return True if an inner plugin acts in each row, (n,), for `g.step`; None if it always acts.

        Args:
            plugin: The inner plugin.
            state: State numbers, (n,); by default the present ones.
        """
        if not plugin.active_in:
            return None
        names = self._names()
        return np.isin(self.state if state is None else state, [names.index(n) for n in plugin.active_in])

    def _names(self) -> list[str]:
        inner = [p for key in self.children() for p in self.values[key]]
        return sorted({name for p in inner for name in p.active_in})
