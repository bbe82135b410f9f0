"""The wire format of MOOS: the product's reader and writer against those of the tests, and against bytes of no sense."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from moos_database import message, packet, parse

from tussle.plugins.stock.autonomy.moos import wire

words = st.text(max_size=20)
numbers = st.floats(allow_nan=False)
mail = st.tuples(st.sampled_from("NRTWKi."), words, st.one_of(numbers, words), words, words, numbers)


@given(st.lists(mail, max_size=5), st.binary(max_size=8))
def test_what_a_database_writes_is_read(messages, rest):
    received = bytearray(packet(*(message(*m) for m in messages)) + rest)
    read = wire.take_packet(received)
    assert [(m.kind, m.key, m.value, m.source, m.community, m.time) for m in read] == messages
    assert received == rest


@given(st.lists(mail, max_size=5))
def test_what_is_written_is_what_the_format_says(messages):
    written = [
        wire.joined(
            wire.encode_head(kind, isinstance(value, str), source, community),
            wire.encode_tail(key, value, time),
        )
        for kind, key, value, source, community, time in messages
    ]
    assert parse(wire.packet(written)) == messages
    assert wire.packet(written) == packet(*(message(*m) for m in messages))


@given(
    st.lists(mail, min_size=1, max_size=3),
    st.lists(st.tuples(st.integers(0, 500), st.integers(0, 255)), min_size=1, max_size=4),
)
def test_bytes_of_no_sense_are_refused_and_nothing_else_happens(messages, changes):
    received = bytearray(packet(*(message(*m) for m in messages)))
    for place, value in changes:
        received[place % len(received)] = value
    try:
        read = wire.take_packet(received)
    except ValueError:
        return
    assert read is None or all(isinstance(m, wire.MoosMessage) for m in read)


@pytest.mark.parametrize(
    "header",
    [
        (8, 0, 0),
        (-1, 0, 0),
        (wire.MAX_BYTES + 1, 0, 0),
        (9, 1, 0),
        (9, -1, 0),
        (9, 0, 1),
        (10, 2**31 - 1, 0),
    ],
)
def test_a_header_of_no_sense_is_refused_before_memory_is_taken(header):
    with pytest.raises(ValueError, match="a packet of"):
        wire.take_packet(bytearray(struct.pack("<iib", *header)))


def test_a_packet_that_is_not_complete_waits():
    whole = packet(message("N", "NAV_X", 1.0))
    for n in range(len(whole)):
        received = bytearray(whole[:n])
        assert wire.take_packet(received) is None
        assert received == whole[:n]
