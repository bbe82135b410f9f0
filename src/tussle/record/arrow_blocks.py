"""Blocks of an Arrow stream: the schema, or a record batch with its dictionaries. Each holds its own checksum.

The sizes that a message declares are checked against the file before Arrow reads it. The message formats are those of Message.fbs
and Schema.fbs of Apache Arrow.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import pyarrow as pa

from tussle.checksums import BLANK, N_DIGITS, as_digits, crc_of_part, crc_of_zeros, find_seal, sealed
from tussle.documents import size_of

MAX_HEAD = 1 << 24
"""Maximum size of a message's metadata [B]."""
MAX_BODY = 1 << 29
"""Maximum size of a message's body [B]; tussle writes about 5 MB at a time."""
SCHEMA, DICTIONARY, BATCH = 1, 2, 3
"""Message types, from Arrow's Message.fbs."""
END_MARK = struct.pack("<Ii", 0xFFFFFFFF, 0)
KEY = "checksum"
"""Name of the metadata entry that holds the checksum of a block."""
CHUNK = 1 << 20
MAX_SEARCHED = 128_000_000
"""Number of bytes behind a damaged block in which the next intact one is searched, far more than a block has: a file may seem enormous."""
MAX_SEARCH = 8
"""Bytes that the search for intact blocks behind damaged ones may read, per byte of the file: a file can be made to be slow to search."""
_START = re.compile(rb"\xff\xff\xff\xff(?=[\s\S]{3}\x00)")  # not \xff{4}, which is searched 15 times slower
"""Beginning of a message whose metadata is not longer than MAX_HEAD."""


class InvalidStreamError(Exception):
    """The stream is not one that tussle writes, or its metadata is inconsistent."""


class _NoMessageError(InvalidStreamError):
    """No message begins here."""


class StreamBlock(NamedTuple):
    """A block of a stream.

    Attributes:
        start: Its first byte.
        end: The byte behind it.
        kind: SCHEMA or BATCH.
        digits: Position of the digits of its checksum in the file; None if it has none.
    """

    start: int
    end: int
    kind: int
    digits: int | None


@dataclass
class StreamBlocks:
    """The blocks of a file.

    Attributes:
        intact: Those that can be decoded, in order.
        lost: (first byte, byte behind) of each part that is damaged.
        is_truncated: The file ends within a block.
        is_sealed: Its blocks have checksums.
    """

    intact: list[StreamBlock] = field(default_factory=list)
    lost: list[tuple[int, int]] = field(default_factory=list)
    is_truncated: bool = False
    is_sealed: bool = False

    @property
    def end(self) -> int:
        """The byte behind the last block."""
        return self.intact[-1].end if self.intact else 0


class _Pieces:
    """A file that keeps references to what an Arrow writer writes, and copies nothing."""

    closed = False

    def __init__(self) -> None:
        self._held: list[Any] = []

    def write(self, data: Any) -> int:
        self._held.append(data)
        return len(data)

    def flush(self) -> None: ...

    def close(self) -> None: ...

    def messages(self) -> Iterator[tuple[bytes, list[Any]]]:
        """Head and metadata, and pieces of the body, of each message."""
        pieces = iter(self._held)

        def take(n: int) -> list[Any]:
            found = []
            while n > 0:
                found.append(next(pieces))
                n -= len(found[-1])
            assert n == 0, "a piece belongs to one part of a message"
            return found

        while (head := b"".join(take(8))) != END_MARK:
            metadata = b"".join(take(int.from_bytes(head[4:], "little")))
            yield head + metadata, take(_metadata(metadata, 0)[1])


def sealed_blocks(batch: pa.RecordBatch) -> tuple[bytes, list[Any]]:
    """The schema of a batch as a block with its checksum; and the batch with its dictionaries, in pieces, as another one."""
    pieces = _Pieces()
    schema = batch.schema.with_metadata({**(batch.schema.metadata or {}), KEY: BLANK})
    with pa.ipc.new_stream(pa.PythonFile(pieces, mode="w"), schema) as writer:
        writer.write_batch(batch, custom_metadata={KEY: BLANK})
    (first, _), *others = pieces.messages()
    block: list[Any] = []
    for head, body in others:
        block += [head, *body]
    head = others[-1][0]
    digits = find_seal(head)
    assert digits is not None
    crc = 0
    for piece in block:
        crc = zlib.crc32(piece, crc)
    block[-1 - len(others[-1][1])] = head[:digits] + as_digits(crc) + head[digits + N_DIGITS :]
    return sealed(first), block


def find_blocks(path: Path, *, is_checked: bool = True) -> StreamBlocks:
    """Find the blocks of a file. Behind a damaged block, the next intact one is searched.

    Args:
        path: The file.
        is_checked: Compare checksums.

    Raises:
        OSError: It is not a regular file.
        InvalidStreamError: It is not an Arrow stream, or a message of a stream without checksums is invalid.
    """
    size, found = size_of(path), StreamBlocks()
    search = _Search(MAX_SEARCH * size)
    with path.open("rb") as file:
        at = 0
        while at < size and not (_is_end(file, at) and at and (at + 8 == size or not found.is_sealed)):
            block, problem = None, None
            try:
                block = _block(file, at, size)
            except InvalidStreamError as error:
                problem = error
            if block is not None:
                found.is_sealed |= block.digits is not None
                if not is_checked or block.digits is None or _is_intact(file, block):
                    found.intact.append(block)
                    at = block.end
                    continue
            behind = search.next_intact(file, at + 1, size) if found.is_sealed or not at else None
            is_legacy = behind is None and not found.is_sealed
            if is_legacy and problem is not None and not (at and isinstance(problem, _NoMessageError)):
                raise problem
            if behind is None and block is None and (problem is None or is_legacy):
                if found.is_sealed and _is_end(file, size - 8):  # only a length can be wrong
                    found.lost.append((at, size))
                found.is_truncated = not found.lost or found.lost[-1][1] < size
                break
            found.is_sealed = True
            found.lost.append((at, size if behind is None else behind))
            at = found.lost[-1][1]
    if found.is_sealed:  # where the checksum itself is damaged, a block seems to have none
        found.lost += [(block.start, block.end) for block in found.intact if block.digits is None]
        found.intact = [block for block in found.intact if block.digits is not None]
    return found


@dataclass
class _Search:
    """Search for intact blocks in a file; `left` is the number of bytes that it may still read."""

    left: int

    def next_intact(self, file: BinaryIO, at: int, size: int) -> int | None:
        """Position of the first intact block from a position on; None if there is none."""
        end = min(size, at + MAX_SEARCHED)
        while at < end:
            file.seek(at)
            chunk = file.read(CHUNK + 7)
            for match in _START.finditer(chunk):
                place = at + match.start()
                self.left -= 8 + int.from_bytes(chunk[match.start() + 4 : match.start() + 8], "little")
                if self.left < 0:
                    return None
                try:
                    block = _block(file, place, size)
                except InvalidStreamError:
                    continue
                if block is not None and block.digits is not None:
                    self.left -= block.end - place
                    if _is_intact(file, block):
                        return place
            at += CHUNK
        return None


def _is_intact(file: BinaryIO, block: StreamBlock) -> bool:
    assert block.digits is not None
    crc = crc_of_part(file, 0, block.start, block.digits)
    digits = file.read(N_DIGITS)
    return as_digits(crc_of_part(file, crc_of_zeros(crc), block.digits + N_DIGITS, block.end)) == digits


# -- messages -----------------------------------------------------------------------------------------------------------------


def _is_end(file: BinaryIO, at: int) -> bool:
    file.seek(at)
    return file.read(8) == END_MARK


def _block(file: BinaryIO, start: int, size: int) -> StreamBlock | None:
    """The block that begins at a position: dictionaries and the message behind them. None if the file ends within it.

    Raises:
        InvalidStreamError: A message's metadata is invalid.
    """
    at = start
    while True:
        file.seek(at)
        head = file.read(8)
        if len(head) < 8:
            return None
        mark, length = struct.unpack("<Ii", head)
        if at > start and head == END_MARK:
            return StreamBlock(start, at, DICTIONARY, None)
        if mark != 0xFFFFFFFF:
            raise _NoMessageError("it is not an Arrow stream")
        if _is_within(length, MAX_HEAD, size - at - 8):
            kind, body, digits = _metadata(file.read(length), at + 8)
            if _is_within(body, MAX_BODY, size - at - 8 - length):
                at += 8 + length + body
                if kind != DICTIONARY:
                    return StreamBlock(start, at, kind, digits)
                continue
        return None


def _is_within(n: int, most: int, left: int) -> bool:
    """Return True if so many bytes are left in the file.

    Raises:
        InvalidStreamError: No message has so many.
    """
    if not 0 <= n <= most:
        raise InvalidStreamError(f"a message declares {n:,} bytes; the limit is {most:,}")
    return n <= left


def _metadata(data: bytes, at: int) -> tuple[int, int, int | None]:
    """Type of a message, size of its body [B], and position of its checksum's digits; checks the sizes that the metadata declares.

    The metadata is a FlatBuffer: a table begins with the offset back to its vtable, which holds the offsets of its fields.

    Args:
        data: The metadata.
        at: Its position in the file.

    Raises:
        InvalidStreamError: It is damaged.
    """
    try:
        message = _u32(data, 0)
        place = _field(data, message, 1)
        kind = data[place] if place else 0
        place = _field(data, message, 3)
        body: int = struct.unpack_from("<q", data, place)[0] if place else 0
        if kind in (DICTIONARY, BATCH):
            place = _field(data, message, 2)
            header = place + _u32(data, place)
            if kind == DICTIONARY:
                place = _field(data, header, 1)
                header = place + _u32(data, place)
            _check_rows(data, header, body)
    except (struct.error, IndexError):
        raise InvalidStreamError("the metadata of a message is damaged") from None
    digits = find_seal(data)
    return kind, body, None if digits is None else at + digits


def _check_rows(data: bytes, header: int, body: int) -> None:
    """Check that a batch is not compressed, and that its body has at least one bit per row."""
    place = _field(data, header, 0)
    rows = struct.unpack_from("<q", data, place)[0] if place else 0
    if _field(data, header, 3):
        raise InvalidStreamError("it is compressed, which is not supported")
    if not 0 <= rows <= 8 * body:
        raise InvalidStreamError(f"a batch of {body:,} bytes declares {rows:,} rows")


def _field(data: bytes, table: int, number: int) -> int:
    """Position of a table's field; 0 if the table does not have it."""
    fields = table - struct.unpack_from("<i", data, table)[0]
    at = 4 + 2 * number
    if fields < 0 or table < 0:
        raise IndexError
    if at + 2 > struct.unpack_from("<H", data, fields)[0]:
        return 0
    offset: int = struct.unpack_from("<H", data, fields + at)[0]
    return table + offset if offset else 0


def _u32(data: bytes, place: int) -> int:
    number: int = struct.unpack_from("<I", data, place)[0]
    return number
