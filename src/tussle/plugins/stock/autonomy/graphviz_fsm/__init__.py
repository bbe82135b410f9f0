"""A finite state machine given as a graph."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tussle.api import Autonomy, GroupView, HistoricAttributes, Param, Publish, State, Subscribe
from tussle.declare.messages import TextMessage
from tussle.errors import ParameterError, listed, nearest_name
from tussle.plugins.stock.autonomy.graphviz_fsm.dot import read_dot

EXAMPLE = """digraph {
    rankdir = LR
    node [ shape = point ]; qi
    node [ shape = circle ];
    qi -> a;
    a -> kevin [ label = "event1" ];
    kevin -> c [ label = "event2" ];
    c -> d [ label = "event3" ];
    d -> a [ label = "event4" ];
    d -> kevin [ label = "event5" ];
}"""


class Machine(NamedTuple):
    """A state machine of k states and m events.

    Attributes:
        names: Names of the states, the initial one first, (k,).
        at_once: State after an edge without label, (k,); the state itself if it has none.
        events: Number of each event.
        after: State after each event, (m + 1, k); the last row is the identity, for unknown events.
    """

    names: tuple[str, ...]
    at_once: np.ndarray
    events: dict[str, int]
    after: np.ndarray


@lru_cache(maxsize=256)
def machine(graph: str, initial: str) -> Machine:
    """Return the state machine of a graph in DOT.

    Raises:
        ParameterError: The text is no directed graph, has no node `initial`, or its edges are ambiguous.
    """
    nodes, edges = read_dot(graph)
    if initial not in nodes:
        raise ParameterError(
            f"the graph has no node {initial!r} to begin with{nearest_name(initial, nodes)}; {listed(nodes)}"
        )
    names = (initial, *(node for node in nodes if node != initial))
    number = {name: i for i, name in enumerate(names)}
    events = {label: i for i, label in enumerate(sorted({edge.label for edge in edges} - {""}))}
    at_once, after = np.arange(len(names)), np.tile(np.arange(len(names)), (len(events) + 1, 1))
    labels: dict[str, list[str]] = {}
    for tail, head, label in edges:
        others = labels.setdefault(tail, [])
        if label in others or (others and "" in (label, *others)):
            what = (
                f"two edges with the label {label!r}"
                if label and label in others
                else "an edge without label beside another one"
            )
            raise ParameterError(f"node {tail!r} of the graph has {what}; the next state must be unique")
        others.append(label)
        (after[events[label]] if label else at_once)[number[tail]] = number[head]
    return Machine(names, at_once, events, after)


class GraphvizFSM(Autonomy):
    """A finite state machine, given as a directed graph in the DOT language: nodes are states, labels of edges are events.

    An event, a text on the topic `event_topic_name`, moves the machine along the edge with this label; other events are ignored. An
    edge without label is taken in the next step; it must be the only one of its node. Each new state is published as a text on
    `state_topic_name`, the initial one too unless it is left at once. MotorSchemas and AutonomyExecutor follow it.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("generate_fsm_pdf",))

    state_topic_name = Param("State", doc="Topic of the new states.")
    event_topic_name = Param("Event", doc="Topic of the events.")
    network_name = Param("LocalNetwork", doc="Network of both topics.")
    initial_node_name = Param("qi", doc="Initial state.")
    graphviz_fsm = Param(EXAMPLE, doc="The graph.")
    node = State(
        dtype=int, doc="Number of the state: 0 for the initial one, then in order of appearance in the graph."
    )
    is_started = State(dtype=bool, doc="Whether a state was published.")
    states_entered = Publish(TextMessage, network_param="network_name", topic_param="state_topic_name")
    events = Subscribe(TextMessage, network_param="network_name", topic_param="event_topic_name")

    def check_values(self) -> None:
        """Check that the graph is a state machine."""
        machine(self.graphviz_fsm, self.initial_node_name)

    def step(self, g: GroupView) -> None:
        fsm = machine(self.graphviz_fsm, self.initial_node_name)
        self._enter(fsm, np.arange(g.n), fsm.at_once[self.node], ~self.is_started)
        self.is_started[:] = True
        if not self.events:
            return
        rows, messages = self.events.pairs()
        event = np.array([fsm.events.get(text, -1) for text in messages.text], np.int64)
        rank = np.arange(len(rows)) - np.searchsorted(rows, rows)
        for k in range(int(rank.max(initial=-1)) + 1):  # one after another for each entity
            now = np.flatnonzero(rank == k)
            self._enter(fsm, rows[now], fsm.after[event[now], self.node[rows[now]]], np.zeros(len(now), bool))

    def _enter(self, fsm: Machine, rows: np.ndarray, node: np.ndarray, is_new: np.ndarray) -> None:
        """Set the states of rows, (m,), and publish those that differ from before or are new."""
        changed = np.flatnonzero((node != self.node[rows]) | is_new)
        self.node[rows] = node
        self.states_entered.publish(rows[changed], text=[fsm.names[i] for i in node[changed]])
