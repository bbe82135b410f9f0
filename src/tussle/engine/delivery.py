"""Message delivery: routing by networks, delays, and spawn requests."""

from __future__ import annotations

import math

import numpy as np

from tussle.comms import EVERYONE, SAME_ENTITY, TopicBuffer
from tussle.engine import failure
from tussle.engine.state import SimulationState
from tussle.engine.world_bindings import WorldBinding
from tussle.errors import WiringError, listed, nearest_name
from tussle.messages import Messages, RemoveEntity, SpawnEntity


def deliver(state: SimulationState) -> None:
    """Route the messages published in this step, and deliver those that are due."""
    step = state.context.clock.step
    for topic in state.message_bus.topics.values():
        if topic.sent:
            if topic.type is SpawnEntity:
                _request_births(state, topic.outbox())
            if topic.type is RemoveEntity:
                _request_deaths(state, topic.outbox())
            if topic.inboxes:
                _send(state, topic)
            topic.clear_outbox()
        if topic.queue:
            topic.deliver(step)


def _request_births(state: SimulationState, batch: Messages) -> None:
    """Turn `SpawnEntity` messages into spawn requests for the next step, block by block in the order of the mission."""
    view = state.world_view
    has_attitude = (batch.quat != 0.0).any(axis=0)
    known = {name: k for k, name in enumerate(view.templates)}
    number = np.array([known.get(str(block), -1) for block in batch.block], np.int64)
    for k, turned in sorted(set(zip(number.tolist(), has_attitude.tolist(), strict=True))):
        index = np.flatnonzero((number == k) & (has_attitude == turned))
        attitude = {"quat": batch.quat[:, index]} if turned else {}
        if k >= 0:
            where = {"pos": batch.pos[:, index], "vel": batch.vel[:, index], **attitude}
            view.spawn(view.templates[k], batch.world[index], **where)
    for i in np.flatnonzero(number < 0):
        block, world = batch.block[i], int(batch.world[i])
        if not state.failed[world]:
            text = f"SpawnEntity: there is no block {block!r}{nearest_name(str(block), view.templates)}; {listed(view.templates)}"
            state.record_failure(
                world, state.error(world, text, where=f"sent by entity {int(batch.sender[i])}")
            )


def _request_deaths(state: SimulationState, batch: Messages) -> None:
    """Turn `RemoveEntity` messages into deaths of this step."""
    rows = state.population.bodies.rows_of(batch.world, batch.entity)
    for why in dict.fromkeys(map(str, batch.why)):
        of_cause = np.array([str(each) == why for each in batch.why])
        state.world_view.kill(rows[(rows >= 0) & of_cause], why)


def _send(state: SimulationState, topic: TopicBuffer) -> None:
    network, batch = state.networks[topic.network], topic.outbox()
    try:
        _route(state, topic, network, batch)
    except Exception as error:
        raise failure.in_call(error, network.plugin, network.view) from error


def _route(state: SimulationState, topic: TopicBuffer, network: WorldBinding, batch: Messages) -> None:
    clock, view = state.context.clock, network.view
    view.begin(network.plugin, 1.0, clock.dt)
    to = network.plugin.route(view, batch)
    if not isinstance(to, str):
        number, rows = to
        to = (np.asarray(number, np.int64), state.population.bodies.id[np.asarray(rows, np.int64)])
    elif to not in (EVERYONE, SAME_ENTITY):
        raise WiringError(
            f"{topic.network}.route returned {to!r}; it must return EVERYONE, SAME_ENTITY or (message numbers, rows)"
        )
    delay = network.plugin.comm_delay[batch.world]
    steps = np.array([max(0, math.ceil(d / clock.dt - 1e-9)) for d in delay], np.int64)
    topic.post(batch, to, clock.step[batch.world] + steps)
