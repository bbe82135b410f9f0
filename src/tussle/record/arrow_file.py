"""Reader for untrusted Arrow streams, see `arrow_blocks`: a damaged block is left out, and what follows is read."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from tussle.declare.displays import counted
from tussle.errors import TussleError
from tussle.record.arrow_blocks import SCHEMA, InvalidStreamError, StreamBlocks, find_blocks
from tussle.record.plugin_columns import is_of_plugin
from tussle.record.table_values import Rules, check_values

MAX_CHECKED_MAPPED = 1 << 28
"""Maximum size of a file that is mapped into memory and whose checksums are compared [B]; a larger one is checked by `tussle check`."""
MAX_WORDS = 1 << 26
"""Maximum size of a dictionary column if every row held its longest entry [B]; block names take about 2 MB."""


def read_batches(
    path: Path,
    notes: list[str],
    error: type[TussleError],
    schema: pa.Schema | None = None,
    rules: Rules | None = None,
    *,
    is_mapped: bool = False,
    damage: list[str] | None = None,
    optional: Collection[str] = (),
) -> Iterator[pa.RecordBatch]:
    """Yield the complete and undamaged batches of a file, in order.

    Args:
        path: The file.
        notes: Receives a line for each part that is missing.
        error: Class of the errors that are raised.
        schema: Required columns, behind which columns of plugins may follow; None for any.
        rules: Allowed values by column.
        is_mapped: Leave the rows in the file, which is mapped into memory, and check no values.
        damage: Receives a line if blocks are damaged; None if that is an error.
        optional: Names of required columns that files of older versions lack.

    Raises:
        TussleError: As `error`: the file is not a regular file, has other columns, is compressed, or a batch is invalid.
    """
    if not path.exists():
        notes.append(f"{path.name} is missing")
        return
    n = 0
    try:
        is_checked = not is_mapped or path.stat().st_size <= MAX_CHECKED_MAPPED
        blocks = find_blocks(path, is_checked=is_checked)
        if damaged := damage_of(path, blocks):
            if damage is None:
                raise error(f"{path.parent}: {damaged}")
            damage.append(f"{damaged}; what was there is left out")
        elif not blocks.intact:
            notes.append(f"{path.name} is truncated before its first batch")
            return
        for found in _batches(path, blocks, schema, is_mapped, optional):
            batch = (
                found
                if schema is None
                else pa.RecordBatch.from_arrays(
                    found.columns, schema=with_plugin_columns(found.schema, schema, optional)
                )
            )
            batch.validate(full=not is_mapped)
            _check_columns(batch)
            if not is_mapped:
                check_values(zip(batch.schema.names, batch.columns, strict=True), rules or {}, path, error)
            n += 1
            yield batch
    except (InvalidStreamError, pa.ArrowException, OSError, ValueError) as reason:
        raise error(f"{path}: cannot be read: {reason}") from None
    if blocks.is_truncated:
        notes.append(f"{path.name} is truncated after {n} complete batches")


def damage_of(path: Path, blocks: StreamBlocks) -> str:
    """Describe the damaged parts of a file; "" if there are none."""
    if not blocks.lost:
        return ""
    n, (start, end) = len(blocks.lost), min(blocks.lost)
    others = f" and in {counted(n - 1, 'other part')}" if n > 1 else ""
    return f"{path.name} is damaged between bytes {start:,} and {end:,}{others}"


def _batches(
    path: Path, blocks: StreamBlocks, schema: pa.Schema | None, is_mapped: bool, optional: Collection[str]
) -> Iterator[pa.RecordBatch]:
    """The batches of the intact blocks.

    Raises:
        InvalidStreamError: The file has other columns, or its schema is damaged and not known.
    """
    if blocks.lost:
        yield from _batches_of_damaged(path, blocks, schema, optional)
        return
    with pa.memory_map(str(path)) if is_mapped else pa.OSFile(str(path), "rb") as file:
        reader = pa.ipc.open_stream(
            file.read_buffer(blocks.end) if is_mapped else file.get_stream(0, blocks.end)
        )
        if schema is not None:
            _check_schema(reader.schema, schema, optional)
        while (batch := _next(reader)) is not None:
            yield batch


def _batches_of_damaged(
    path: Path, blocks: StreamBlocks, schema: pa.Schema | None, optional: Collection[str]
) -> Iterator[pa.RecordBatch]:
    """The batches of the intact blocks, each with its dictionaries. If the schema in the file is damaged, the required one is used."""
    head = None if schema is None else schema.serialize().to_pybytes()
    with path.open("rb") as file:
        for block in blocks.intact:
            file.seek(block.start)
            data = file.read(block.end - block.start)
            if block.kind == SCHEMA:
                head = data
            elif head is None:
                raise InvalidStreamError("its schema is damaged")
            else:
                reader = pa.ipc.open_stream(head + data)
                if schema is not None:
                    _check_schema(reader.schema, schema, optional)
                yield reader.read_next_batch()


def _next(reader: pa.RecordBatchReader) -> pa.RecordBatch | None:
    try:
        return reader.read_next_batch()
    except StopIteration:
        return None


def same_columns(found: pa.Schema, wanted: pa.Schema, optional: Collection[str] = ()) -> str:
    """Describe the first column that is missing, unless it is optional, or has another type; "" if there is none."""
    wanted = _required(found, wanted, optional)
    types = dict(zip(found.names, found.types, strict=True))
    wrong = [column for column in wanted if types.get(column.name) != column.type]
    return f"it has no column {wrong[0].name!r} of {wrong[0].type}" if wrong else ""


def _required(found: pa.Schema, wanted: pa.Schema, optional: Collection[str]) -> pa.Schema:
    return pa.schema([each for each in wanted if each.name in found.names or each.name not in optional])


def with_plugin_columns(found: pa.Schema, wanted: pa.Schema, optional: Collection[str] = ()) -> pa.Schema:
    """The required columns, and the columns of plugins that a table has behind them."""
    wanted = _required(found, wanted, optional)
    return pa.schema([*wanted, *(part for part in list(found)[len(wanted) :] if is_of_plugin(part))])


def _check_schema(found: pa.Schema, wanted: pa.Schema, optional: Collection[str]) -> None:
    difference = same_columns(found, wanted, optional)
    if not difference and (
        len({*found.names}) < len(found) or found.names != with_plugin_columns(found, wanted, optional).names
    ):
        difference = "it has other columns than a table of tussle"
    if difference:
        raise InvalidStreamError(difference)


def _check_columns(batch: pa.RecordBatch) -> None:
    """Check that a batch has no nulls where none are allowed, and stays small when its dictionaries are decoded."""
    for field, column in zip(batch.schema, batch.columns, strict=True):
        if not field.nullable and column.null_count:
            raise InvalidStreamError(f"column {field.name!r} has nulls")
        if pa.types.is_dictionary(column.type):
            column.dictionary.validate(full=True)
            longest = pc.max(pc.binary_length(column.dictionary)).as_py() or 0
            if longest * len(column) > MAX_WORDS:
                raise InvalidStreamError(
                    f"column {field.name!r} has {len(column):,} rows and a text of {longest:,} bytes; "
                    f"the limit of their product is {MAX_WORDS:,} bytes"
                )
