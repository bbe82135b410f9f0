"""The wire format of MOOS 10. All numbers are little endian; a text is its length (int32) and its bytes.

A client sends the 32 bytes `PROTOCOL`, then packets. A packet is

    int32 bytes of the packet, int32 number of messages, int8 0 (not compressed), messages

and a message is

    int32 bytes of the message, int32 number (-1 for none), char kind, char data ('D' number, 'S' text, 'B' bytes),
    texts: source, source's remark, community, variable; doubles: time [s], number, second number; text: the value

The first packet of a client has one message of kind IDENTITY: its text is the client's name, its variable "asynchronous", so that
mail is sent as it comes. The database answers with WELCOME, which names its community, or with POISON and a reason.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

PROTOCOL = b"ELKS CAN'T DANCE 2/8/10".ljust(32, b"\0")
IDENTITY, WELCOME, POISON, NOTIFY, REGISTER, TIMING = "i", "W", "K", "N", "R", "T"

HEADER = struct.Struct("<iib")
START = struct.Struct("<iicc")  # bytes, number, kind, data
LENGTH = struct.Struct("<i")
NUMBERS = struct.Struct("<ddd")
MIN_MESSAGE = START.size + 5 * LENGTH.size + NUMBERS.size
MAX_BYTES = 1 << 20
"""Largest packet that is read."""


class MoosMessage(NamedTuple):
    """A message that was received.

    Attributes:
        kind: One of the letters above.
        is_text: Whether its value is a text.
        source: Name of the client that has sent it.
        community: Community that it comes from.
        key: Variable.
        time: When it was sent, in time of MOOS [s].
        number: Its value, if that is a number.
        text: Its value, if that is a text.
    """

    kind: str
    is_text: bool
    source: str
    community: str
    key: str
    time: float
    number: float
    text: str

    @property
    def value(self) -> float | str:
        """The number or the text."""
        return self.text if self.is_text else self.number


def encoded_text(text: str) -> bytes:
    """A text with its length."""
    data = text.encode()
    return LENGTH.pack(len(data)) + data


def encode_head(kind: str, is_text: bool, source: str = "", community: str = "") -> bytes:
    """The part of a message between its length and its variable, which is the same for all mail of a client."""
    data = b"S" if is_text else b"D"
    texts = encoded_text(source) + encoded_text("") + encoded_text(community)
    return struct.pack("<icc", -1, kind.encode(), data) + texts


def encode_tail(key: str, value: float | str, time: float) -> bytes:
    """The part of a message from its variable on, which is the same for all receivers."""
    number, text = (-1.0, value) if isinstance(value, str) else (value, "")
    return encoded_text(key) + NUMBERS.pack(time, number, -1.0) + encoded_text(text)


def joined(head: bytes, tail: bytes) -> bytes:
    """A message of two parts."""
    return LENGTH.pack(LENGTH.size + len(head) + len(tail)) + head + tail


def packet(messages: list[bytes]) -> bytes:
    """A packet of messages."""
    return HEADER.pack(HEADER.size + sum(map(len, messages)), len(messages), 0) + b"".join(messages)


def take_packet(received: bytearray) -> list[MoosMessage] | None:
    """Remove the first packet from what has been received, and return its messages; None if it is not complete yet.

    Raises:
        ValueError: This is no packet.
    """
    if len(received) < HEADER.size:
        return None
    length, n, is_compressed = HEADER.unpack_from(received)
    if not HEADER.size <= length <= MAX_BYTES or not 0 <= n * MIN_MESSAGE <= length or is_compressed:
        raise ValueError(
            f"a packet of {length} bytes with {n} messages; it takes at most {MAX_BYTES}, uncompressed"
        )
    if len(received) < length:
        return None
    data, messages, at = bytes(received[:length]), [], HEADER.size
    del received[:length]
    for _ in range(n):
        message, at = _decode(data, at)
        messages.append(message)
    return messages


def _decode(data: bytes, at: int) -> tuple[MoosMessage, int]:
    """A message of a packet, and where it ends."""
    if len(data) - at < MIN_MESSAGE:
        raise ValueError("a message is cut short")
    length, _, kind, sort = START.unpack_from(data, at)
    end = at + length
    if not MIN_MESSAGE <= length <= len(data) - at or sort not in b"DSB":
        raise ValueError(f"a message of {length} bytes with data of the kind {sort!r}")
    texts, at = [], at + START.size
    for _ in range(4):
        text, at = _text(data, at, end)
        texts.append(text)
    if end - at < NUMBERS.size:
        raise ValueError("a message without its numbers")
    time, number, _ = NUMBERS.unpack_from(data, at)
    value, at = _text(data, at + NUMBERS.size, end)
    if at != end:
        raise ValueError(f"a message with {end - at} bytes after its end")
    source, _, community, key = texts
    is_text = sort != b"D"
    return MoosMessage(kind.decode("latin-1"), is_text, source, community, key, time, number, value), end


def _text(data: bytes, at: int, end: int) -> tuple[str, int]:
    """A text, and where it ends."""
    first = at + LENGTH.size
    length = LENGTH.unpack_from(data, at)[0] if first <= end else -1
    if not 0 <= length <= end - first:
        raise ValueError(f"a text of {length} bytes in {end - at}")
    return data[first : first + length].decode(errors="replace"), first + length
