"""What came from outside while a game was played: messages, and columns that were set, between two steps."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.declare.columns import Handle, Numbers
from tussle.declare.lists import RaggedColumn
from tussle.declare.messages import Message, Messages
from tussle.errors import ParameterError

MESSAGE, COLUMN = "message", "column"


@dataclass(frozen=True)
class ExternalInput:
    """What came from outside before a step of a world.

    Attributes:
        step: The step.
        kind: "message" or "column".
        name: Name of the message's type, or path of the column.
        values: Field -> value of the message; or the column's values in this world, shaped as those of `Simulation.read`. None if a
            message held an object that cannot be written down.
        network: Network of the message; "" is the one that reaches everyone.
        topic: Topic of the message; "" is the name of the type.
        to: Ids of the entities that get the message; () is whoever the network reaches.
        by: Who gave it, such as "operate team 1"; "" where nobody said so, see `given_by`.
    """

    step: int
    kind: str
    name: str
    values: Any
    network: str = ""
    topic: str = ""
    to: tuple[int, ...] = ()
    by: str = ""


GIVER: ContextVar[str] = ContextVar("GIVER", default="")
"""Who gives what comes from outside now, in this thread."""
MAX_NAME = 100
"""Characters of the name of who gives it."""


@contextmanager
def given_by(name: str) -> Generator[None]:
    """Record what comes from outside within as given by somebody: messages that are published, and columns that are written.

    Args:
        name: Who gives it; printable, at most 100 characters.

    Raises:
        ParameterError: It is not.
    """
    check_giver("given_by", name)
    token = GIVER.set(name)
    try:
        yield
    finally:
        GIVER.reset(token)


def check_giver(where: str, name: Any) -> None:
    """Check the name of who gives what comes from outside; programs without type checks pass anything.

    Raises:
        ParameterError: It is no printable text, or too long.
    """
    if not (isinstance(name, str) and name.isprintable() and len(name) <= MAX_NAME):
        raise ParameterError(
            f"{where}: {name!r:.{MAX_NAME}} is not allowed; it takes a printable text of at most {MAX_NAME} characters"
        )


InputListener = Callable[[int, ExternalInput], None]
"""Called with the world and what has come from outside."""


def of_message(
    sent: Messages, place: int, step: int, network: str, topic: str, to: tuple[int, ...] = ()
) -> ExternalInput:
    """The input that is a message of a batch.

    Args:
        sent: The batch.
        place: Number of the message in it.
        step: The step before which it came.
        network: As it was published.
        topic: The same.
        to: The same.
    """
    values: dict[str, Any] | None = {name: _plain(sent.data[name], place) for name in sent.type.fields}
    try:
        json.dumps(values)
    except TypeError:
        values = None
    return ExternalInput(step, MESSAGE, sent.type.__name__, values, network, topic, to)


def _plain(values: Any, place: int) -> Any:
    if isinstance(values, RaggedColumn):
        return values[place].tolist()
    return values[..., place].tolist() if isinstance(values, np.ndarray) else values[place]


def fields_of(type_: type[Message], values: dict[str, Any]) -> dict[str, Any]:
    """The fields of one message as `Simulation.publish` takes them, from the values of its input."""
    kinds = {name: type_.fields.get(name) for name in values}
    return {
        name: [np.array(value, kind.dtype)]
        if isinstance(kind := kinds[name], Numbers) and kind.ragged
        else [value]
        if isinstance(kind, Handle)
        else value
        for name, value in values.items()
    }
