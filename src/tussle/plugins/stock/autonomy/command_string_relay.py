"""Autonomies that pass texts from one network to another."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, Children, GroupView, Param, Publish, Subscribe
from tussle.declare.messages import TextMessage
from tussle.errors import ParameterError


class TopicRelay(Autonomy):
    """Publishes each text that the entity receives on a topic of one network on the same topic of another one.

    A text for another entity (field `to`) is not passed on. Example: a command that `Simulation.publish` sends on GlobalNetwork reaches
    the other plugins of the entity on LocalNetwork one step later.
    """

    grade = "portable"

    source = Param("GlobalNetwork", doc="Network that the texts are received on.")
    topic = Param("State", doc="Topic on both networks.")
    target = Param("LocalNetwork", doc="Network that the texts are published on.")
    heard = Subscribe(TextMessage, network_param="source", topic_param="topic", from_outside=True)
    passed = Publish(TextMessage, network_param="target", topic_param="topic")

    def check_values(self) -> None:
        """Check that the two networks differ."""
        if self.source == self.target:
            raise ParameterError(f"TopicRelay: source and target are both {self.source!r}; they must differ")

    def step(self, g: GroupView) -> None:
        if self.heard:
            rows, messages = self.heard.pairs()
            mine = np.flatnonzero((messages.to == 0) | (messages.to == g.id[rows]))
            self.passed.publish(rows[mine], text=[messages.text[i] for i in mine], to=messages.to[mine])


class CommandStringRelay(Autonomy):
    """Several relays in one plugin.

    A mission file gives them as rows of source, topic and target: "[ GlobalNetwork State LocalNetwork ]".
    """

    grade = "portable"

    relays = Children(TopicRelay, fields="source topic target", doc="The relays.")

    def step(self, g: GroupView) -> None:
        for relay in self.relays:
            g.step(relay)
