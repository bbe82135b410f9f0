"""Message delivery: routing by networks, delays, and spawn requests."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api.bodies import problems_of_states
from tussle.api.links import Links
from tussle.declare.columns import EntityRef
from tussle.declare.comms import EVERYONE, SAME_ENTITY, TopicBuffer
from tussle.declare.messages import ManualControl, Messages, RemoveEntity, SpawnEntity
from tussle.engine import failure
from tussle.engine.manual import request_control
from tussle.engine.state import SimulationState
from tussle.engine.world_bindings import WorldBinding
from tussle.errors import ParameterError, WiringError, clipped, listed, nearest_name
from tussle.numeric.arrays import numbers_below


def deliver(state: SimulationState) -> None:
    """Route the messages published in this step, and deliver those that are due."""
    step, topics = state.context.clock.step, state.message_bus.topics.values()
    sent: dict[str, list[TopicBuffer]] = {}
    for topic in topics:
        if topic.sent:
            if topic.type is SpawnEntity:
                _request_births(state, topic.outbox())
            if topic.type is RemoveEntity:
                _request_deaths(state, topic.outbox())
            if topic.type is ManualControl:
                request_control(state, topic.outbox())
            state.events.published(topic)
            if topic.inboxes or state.networks[topic.network].plugin.losses:
                sent.setdefault(topic.network, []).append(topic)
    for name, of_network in sent.items():
        _send(state, state.networks[name], of_network)
    for topic in topics:
        until = step
        if topic.queue and state.networks[topic.network].plugin.waits_for_traffic:
            has_traffic = np.isin(np.arange(state.n_worlds), topic.outbox().world)
            until = np.where(has_traffic, step, -1)
        topic.clear_outbox()
        if topic.queue:
            state.events.received(topic, topic.deliver(until))
    state.events.delivered(state.running)


def _request_births(state: SimulationState, batch: Messages) -> None:
    """Turn `SpawnEntity` messages into spawn requests for the next step, block by block in the order of the mission."""
    view = state.world_view
    number, has_attitude, problems = _read_births(state, batch)
    number[list(problems)] = -1
    for k, with_attitude in sorted(set(zip(number.tolist(), has_attitude.tolist(), strict=True))):
        index = np.flatnonzero((number == k) & (has_attitude == with_attitude))
        attitude = {"quat": batch.quat[:, index]} if with_attitude else {}
        if k >= 0:
            where = {"pos": batch.pos[:, index], "vel": batch.vel[:, index], **attitude}
            view.spawn(view.templates[k], batch.world[index], **where)
    for i, text in sorted(problems.items()):
        if not state.failed[world := int(batch.world[i])]:
            sender = f"sent by entity {int(batch.sender[i])}"
            state.record_failure(world, state.error(world, f"SpawnEntity: {text}", where=sender))


def _read_births(state: SimulationState, batch: Messages) -> tuple[np.ndarray, np.ndarray, dict[int, str]]:
    """Number of the template and whether there is an attitude, (n,) each, of `SpawnEntity` messages, and what is wrong with which."""
    has_attitude = (batch.quat != 0.0).any(axis=0)
    numbers = {name: k for k, name in enumerate(state.world_view.templates)}
    number = np.array([numbers.get(str(block), -1) for block in batch.block], np.int64)
    problems: dict[int, str] = {}
    for i in np.flatnonzero(number < 0).tolist():
        block = batch.block[i]
        problems[i] = f"there is no block {block!r}{nearest_name(str(block), numbers)}; {listed(numbers)}"
    for name in ("pos", "vel", "quat"):
        for i, text in problems_of_states(name, getattr(batch, name)):
            if name != "quat" or has_attitude[i]:
                problems.setdefault(i, text)
    return number, has_attitude, problems


def _request_deaths(state: SimulationState, batch: Messages) -> None:
    """Turn `RemoveEntity` messages into deaths of this step."""
    rows = state.population.bodies.rows_of(batch.world, batch.entity)
    for why in dict.fromkeys(map(str, batch.why)):
        of_cause = np.array([str(each) == why for each in batch.why])
        state.world_view.kill(rows[(rows >= 0) & of_cause], why)


def _send(state: SimulationState, network: WorldBinding, topics: list[TopicBuffer]) -> None:
    view = network.view
    view.begin(network.plugin, 1.0, state.context.clock.dt)
    try:
        routes = network.plugin.transmit(view, [topic.outbox() for topic in topics])
        if isinstance(routes, Links):
            _check_links(routes, network.plugin.losses)
            _post_links(state, network, topics, routes)
        elif not isinstance(routes, list | tuple) or len(routes) != len(topics):
            raise WiringError(
                f"transmit returned {clipped(repr(routes))}; it must return Links, or a list of what "
                "route returns, one per topic"
            )
        else:
            for topic, to in zip(topics, routes, strict=True):
                _post(state, network, topic, to)
    except Exception as error:
        raise failure.in_call(error, network.plugin, view) from error


def _post(state: SimulationState, network: WorldBinding, topic: TopicBuffer, to: Any) -> None:
    """Queue the messages of a topic for receivers as `Network.route` returns them."""
    clock, batch = state.context.clock, topic.outbox()
    if isinstance(to, tuple) and len(to) == 2:
        to = _receivers(state, topic, batch.world, *to)
    elif to not in (EVERYONE, SAME_ENTITY):
        raise WiringError(
            f"{topic.network}.route returned {to!r}; it must return EVERYONE, SAME_ENTITY or (message numbers, rows)"
        )
    if topic.inboxes:
        steps = _steps(network.plugin.comm_delay, clock.dt)[batch.world]
        topic.post(batch, to, clock.step[batch.world] + steps)


def _receivers(
    state: SimulationState, topic: TopicBuffer, world: np.ndarray, number: Any, rows: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of messages, whose worlds are `world`, and ids of their receivers, from what `Network.route` returns.

    Raises:
        ParameterError: There is no such message or row, or not one row for each message.
        WiringError: A row is in another world than its message.
    """
    where, bodies = f"{topic.network}.route:", state.population.bodies
    number = numbers_below(len(world), number, f"{where} message numbers")
    rows = numbers_below(len(bodies.id), rows, f"{where} rows", ", as of a removed entity,")
    if len(number) != len(rows):
        raise WiringError(
            f"{where} {len(number)} message numbers and {len(rows)} rows; it returns one row per message number"
        )
    strays = np.flatnonzero(world[number] != bodies.world[rows])
    if len(strays):
        k = strays[0]
        raise WiringError(
            f"{where} message {number[k]}, of world {world[number[k]]}, goes to row {rows[k]}, of world {bodies.world[rows[k]]}; messages "
            "stay in their world"
        )
    return number, bodies.id[rows]


def _check_links(links: Links, losses: tuple[str, ...]) -> None:
    """Check the links that a network returns.

    Raises:
        WiringError: Links are lost for an unknown reason, or their delays are no numbers.
    """
    outcome, delay = links.outcome, links.delay
    if len(outcome) and not 0 <= outcome.min() <= outcome.max() <= len(losses):
        wrong = outcome[(outcome < 0) | (outcome > len(losses))][0] - 1
        known = listed(f"{i} ({name})" for i, name in enumerate(losses))
        raise WiringError(f"transmit lost links for the reason number {wrong}; in losses {known}")
    if delay is not None and (
        np.shape(delay) != outcome.shape or np.asarray(delay).dtype.kind not in "iuf" or np.isnan(delay).any()
    ):
        raise WiringError(
            f"transmit returned links with delay = {clipped(repr(delay))}; it takes numbers [s], {outcome.shape}, one per link"
        )


def _post_links(
    state: SimulationState, network: WorldBinding, topics: list[TopicBuffer], links: Links
) -> None:
    """Count the links of a network, and queue the messages that are received."""
    if network.plugin.losses:
        _count_links(state, network, topics, links)
    own = np.flatnonzero((links.sender >= 0) & links.reaches_sender)
    received = np.flatnonzero(links.outcome == 0)
    number = np.concatenate([own, links.message[received]])
    ids = state.population.bodies.id[np.concatenate([links.sender[own], links.receiver[received]])]
    delay = network.plugin.comm_delay[links.world[number]]
    if links.delay is not None:
        delay[len(own) :] += links.delay[received]
    steps = _steps(delay, state.context.clock.dt)
    for topic, first, last in zip(topics, links.starts[:-1], links.starts[1:], strict=True):
        here: Any = (number >= first) & (number < last) if len(topics) > 1 else slice(None)
        if topic.inboxes:
            _post_copies(topic, number[here] - first, ids[here], steps[here], state.context.clock.step)


def _post_copies(
    topic: TopicBuffer, number: np.ndarray, ids: np.ndarray, steps: np.ndarray, now: np.ndarray
) -> None:
    """Queue copies of a topic's messages: message number, id of the receiver and number of steps until then, (m,) each."""
    batch = topic.outbox()
    delays = steps[:1] if (steps == steps[:1]).all() else np.unique(steps)
    for n_steps in delays:
        mine: Any = steps == n_steps if len(delays) > 1 else slice(None)
        # Keep only messages with a receiver: the other messages may belong to other worlds of the stack.
        is_kept = np.zeros(batch.n, bool)
        is_kept[number[mine]] = True
        part = batch if is_kept.all() else batch.take(np.flatnonzero(is_kept))
        place = number[mine] if part is batch else (np.cumsum(is_kept) - 1)[number[mine]]
        topic.post(part, (place, ids[mine]), now[part.world] + n_steps)


def _count_links(
    state: SimulationState, network: WorldBinding, topics: list[TopicBuffer], links: Links
) -> None:
    """Count the links of a network to subscribers."""
    counts, bodies = network.plugin.link_counts, state.population.bodies
    place = links.outcome * state.n_worlds + links.world[links.message]
    subscribes = np.zeros(len(place), bool)
    firsts, lasts = np.searchsorted(links.message, [links.starts[:-1], links.starts[1:]])
    for topic, first, last in zip(topics, firsts, lasts, strict=True):
        subscribes[first:last] = topic.is_receiver(bodies.n)[links.receiver[first:last]]
    counts += np.bincount(place[subscribes], minlength=counts.size).reshape(counts.shape)
    state.events.links(network.spec.instance_name, bodies.id, links, subscribes)


def order(
    state: SimulationState, topic: TopicBuffer, batch: Messages, ids: tuple[int, ...], *, is_repeated: bool
) -> None:
    """Publish messages from outside, or queue them for some entities of their worlds, which receive them at the end of the step that comes.

    Raises:
        ParameterError: As `check_order`; for those that are repeated, as `check_receivers`.
    """
    number, receiver = (check_receivers if is_repeated else check_order)(state, topic, batch, ids)
    if ids:
        topic.post(batch, (number, receiver), state.context.clock.step[batch.world])
    else:
        topic.add(batch)


def check_order(
    state: SimulationState, topic: TopicBuffer, batch: Messages, ids: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Return message number and id of the receiver of each copy, (m,), of messages to some entities.

    Raises:
        ParameterError: As `check_receivers`; a field names an entity that never was, or a new entity cannot be as it is asked for.
    """
    _check_references(state, batch)
    if batch.type is SpawnEntity and (problems := _read_births(state, batch)[2]):
        raise ParameterError(f"SpawnEntity: {problems[min(problems)]}")
    return check_receivers(state, topic, batch, ids)


def check_receivers(
    state: SimulationState, topic: TopicBuffer, batch: Messages, ids: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Return message number and id of the receiver of each copy, (m,), of messages to some entities.

    Raises:
        ParameterError: An entity does not exist in a world, or does not subscribe to the topic.
    """
    bodies = state.population.bodies
    number, receiver = np.repeat(np.arange(batch.n), len(ids)), np.tile(np.array(ids, np.int64), batch.n)
    rows = bodies.rows_of(batch.world[number], receiver)
    for world, who, row in zip(batch.world[number].tolist(), receiver.tolist(), rows.tolist(), strict=True):
        if row < 0:
            raise ParameterError(
                f"publish: receivers = {who} is not allowed; world {world} has no entity {who} now"
            )
        if not any(inbox.view.first <= row < inbox.view.last for inbox in topic.inboxes):
            group = next(g for g in state.population.groups if g.first <= row < g.last)
            topics = state.message_bus.topics.values()
            heard = [f"{t.network}/{t.name}" for t in topics if any(i.view in group.views for i in t.inboxes)]
            raise ParameterError(
                f"publish: receivers = {who} is not allowed; no plugin of entity {who} subscribes to {topic.network}/{topic.name}"
                f"{nearest_name(f'{topic.network}/{topic.name}', heard)}; {listed(heard)}"
            )
    return number, receiver


def _check_references(state: SimulationState, batch: Messages) -> None:
    """Check the ids in messages from outside. An entity that has died is no error, since the sender cannot know it yet.

    Raises:
        ParameterError: No entity of the world has had an id; or it is 0, nobody, in a request to the engine.
    """
    n_ids = state.births.next_id[batch.world] - 1
    least = int(batch.type in (RemoveEntity, ManualControl))
    for name in (name for name, column in batch.type.fields.items() if isinstance(column, EntityRef)):
        ids = batch.data[name]
        for i in np.flatnonzero((ids < least) | (ids > n_ids))[:1]:
            raise ParameterError(
                f"{batch.type.__name__}: {name} = {ids[i]} is not allowed; no entity of world {batch.world[i]} has had this id; "
                f"ids are {least} to {n_ids[i]}{'' if least else ', and 0 is nobody'}"
            )


def _steps(delay: np.ndarray, dt: float) -> np.ndarray:
    """Number of whole steps until a delay [s] is over."""
    return np.clip(np.ceil(delay / dt - 1e-9), 0.0, 2.0**53).astype(np.int64)
