"""Damage to a run, batch or search directory: one kind after another, each from a seed."""

from __future__ import annotations

import json
import os
import random
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

HUGE = (2**31 - 1, -(2**31), 2**32 - 1, 2**40, 2**62, 2**63 - 1, -1, 0, 1)
NUMBERS = (*HUGE, 0.5, -0.0, 1e18, 1e308, -1e308, 5e-324, float("nan"), float("inf"), -float("inf"))
VALUES = (*NUMBERS, None, True, False, "", "x", "inf", "1e999", "../../x", "/etc/passwd", "\0", "\ud800", "[bold", "é" * 300,
          [], {}, [[]], [None], {"": None}, {"a": {"b": 1}}, [{}] * 3, list(range(50)), 10**30, "9" * 5000)  # fmt: skip
TYPES = (pa.int8(), pa.int32(), pa.int64(), pa.uint64(), pa.float32(), pa.float64(), pa.string(), pa.large_string(), pa.binary(),
         pa.bool_(), pa.dictionary(pa.int32(), pa.string()), pa.null())  # fmt: skip
N_ROWS = 100_000

Damage = Callable[[random.Random, Path], str]


def damage(rng: random.Random, source: Path, target: Path) -> str:
    """Copy a directory, damage the copy at one to three places, and say how. The bombs lie beside the source."""
    shutil.copytree(source, target)
    return "; ".join(_once(rng, target, source.parent / "bombs") for _ in range(rng.choice((1, 1, 1, 2, 3))))


def _once(rng: random.Random, folder: Path, bombs: Path) -> str:
    files = sorted(
        p for p in folder.rglob("*") if p.is_file() and not p.is_symlink() and p.stat().st_size < 2**20
    )
    if not files:
        return "nothing is left"
    file = rng.choice(files)
    special: dict[str, tuple[Damage, ...]] = {
        ".json": (_value, _value, _value, _value, _gone, _deep),
        ".arrow": (*[_column] * 24, *[_word] * 15, partial(_bomb, bombs)),
        ".parquet": (*[_column] * 24, *[_word] * 15, partial(_bomb, bombs)),
    }
    common = (_cut, _flip, _word, _zeros, _empty, _removed, _folder, _fifo, _link, _swapped, _long)
    if not file.stat().st_size:
        common = (_long, _removed, _folder, _fifo, _link)
    choice = rng.choice(
        special.get(file.suffix, common) if rng.random() < 0.7 and file.stat().st_size else common
    )
    name = f"{file.relative_to(folder)} {getattr(choice, '__name__', '_bomb')[1:]}"
    try:
        return f"{name} {choice(rng, file)}"
    except (
        ValueError,
        LookupError,
        TypeError,
        OverflowError,
        RecursionError,
        pa.ArrowException,
        OSError,
    ) as error:
        return f"{name} left alone ({type(error).__name__})"


# -- any file -----------------------------------------------------------------------------------------------------------------


def _cut(rng: random.Random, file: Path) -> str:
    n = rng.randrange(file.stat().st_size)
    os.truncate(file, n)
    return f"at {n}"


def _flip(rng: random.Random, file: Path) -> str:
    data = bytearray(file.read_bytes())
    places = [rng.randrange(len(data)) for _ in range(rng.choice((1, 1, 4, 64)))]
    for place in places:
        data[place] = rng.randrange(256)
    file.write_bytes(data)
    return f"at {places[:4]}"


def _word(rng: random.Random, file: Path) -> str:
    """A whole number where the file may hold a count, a length or an offset: more often where formats keep them, at the ends."""
    data = bytearray(file.read_bytes())
    width = rng.choice((4, 8))
    near = min(len(data), 4000)
    place = rng.choice((rng.randrange(len(data)), rng.randrange(near), len(data) - 1 - rng.randrange(near)))
    number = rng.choice(HUGE)
    place -= place % 4
    data[place : place + width] = (number % 2 ** (8 * width)).to_bytes(width, "little")
    file.write_bytes(data)
    return f"at {place}: {number}"


def _zeros(rng: random.Random, file: Path) -> str:
    data = bytearray(file.read_bytes())
    first = rng.randrange(len(data))
    last = min(len(data), first + rng.choice((8, 64, 4096)))
    data[first:last] = bytes(last - first)
    file.write_bytes(data)
    return f"{first} to {last}"


def _empty(_: random.Random, file: Path) -> str:
    file.write_bytes(b"")
    return ""


def _removed(_: random.Random, file: Path) -> str:
    file.unlink()
    return ""


def _folder(_: random.Random, file: Path) -> str:
    file.unlink()
    file.mkdir()
    return ""


def _fifo(_: random.Random, file: Path) -> str:
    file.unlink()
    os.mkfifo(file)
    return ""


def _link(rng: random.Random, file: Path) -> str:
    to = rng.choice(
        (
            file.name,
            "nowhere",
            "/dev/zero",
            "/proc/self/mem",
            "/etc",
            *sorted(p.name for p in file.parent.iterdir()),
        )
    )
    file.unlink()
    file.symlink_to(to)
    return f"to {to}"


def _swapped(rng: random.Random, file: Path) -> str:
    """Another file of the directory under this name."""
    other = rng.choice(
        sorted(
            p
            for p in file.parent.parent.rglob("*.*")
            if p.is_file() and p != file and p.stat().st_size < 2**20
        )
    )
    shutil.copyfile(other, file)
    return f"for {other.name}"


def _long(rng: random.Random, file: Path) -> str:
    """A file that says it is of many bytes, and takes none."""
    size = rng.choice((2**26, 2**40))
    os.truncate(file, size)
    return f"to {size}"


# -- documents ----------------------------------------------------------------------------------------------------------------


def _places(node: Any, above: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Ways to all values of a document, of a long list to its first ones."""
    pairs = node.items() if isinstance(node, dict) else enumerate(node[:20]) if isinstance(node, list) else ()
    return [way for key, inner in pairs for way in [(*above, key), *_places(inner, (*above, key))]]


def _chosen(rng: random.Random, file: Path) -> tuple[Any, tuple[Any, ...], Any]:
    """A document, the way to one of its values, and what holds that."""
    document = json.loads(file.read_text())
    way = rng.choice(_places(document))
    holder = document
    for key in way[:-1]:
        holder = holder[key]
    return document, way, holder


def _value(rng: random.Random, file: Path) -> str:
    document, way, holder = _chosen(rng, file)
    holder[way[-1]] = value = rng.choice(VALUES)
    file.write_text(json.dumps(document))
    return f"{way} = {value!r:.60}"


def _gone(rng: random.Random, file: Path) -> str:
    document, way, holder = _chosen(rng, file)
    del holder[way[-1]]
    file.write_text(json.dumps(document))
    return f"{way}"


def _deep(rng: random.Random, file: Path) -> str:
    document, way, holder = _chosen(rng, file)
    holder[way[-1]] = "HERE"
    n = rng.choice((60, 900, 200_000))
    opening, closing = rng.choice((("[", "]"), ('{"a":', "}")))
    file.write_text(json.dumps(document).replace('"HERE"', opening * n + "1" + closing * n))
    return f"{way}: {n}"


# -- tables -------------------------------------------------------------------------------------------------------------------


def _table(file: Path) -> pa.Table:
    if file.suffix == ".parquet":
        with pq.ParquetFile(file) as parquet:
            return (
                parquet.read() if parquet.metadata.num_rows < 10_000 else parquet.schema_arrow.empty_table()
            )
    with pa.OSFile(str(file)) as source, pa.ipc.open_stream(source) as reader:
        return reader.read_all() if file.stat().st_size < 2**20 else reader.schema.empty_table()


def _put(file: Path, table: pa.Table, n_times: int = 1) -> None:
    """Write a table so many times into one file; packed, where it is more than once."""
    if ".parquet" in file.name:
        with pq.ParquetWriter(file, table.schema, compression="zstd", write_page_checksum=True) as writer:
            for _ in range(n_times):
                writer.write_table(table)
        return
    options = pa.ipc.IpcWriteOptions(compression="zstd" if n_times > 1 else None)
    with (
        pa.OSFile(str(file), "wb") as target,
        pa.ipc.new_stream(target, table.schema, options=options) as writer,
    ):
        for _ in range(n_times):
            writer.write_table(table)


def _column(rng: random.Random, file: Path) -> str:
    """A column of another type, gone, under another name, with wild values, or in another order of rows."""
    table = _table(file)
    i = rng.randrange(table.num_columns)
    name, column = table.schema.names[i], table.column(i)
    how = rng.choice(
        ("values", "values", "values", "values", "type", "drop", "rename", "null", "order", "repeat")
    )
    if how == "values":
        values = column.to_pylist()
        for _ in range(rng.choice((1, 3, len(values)))):
            values[rng.randrange(len(values))] = rng.choice((*NUMBERS, None, "x", "", "é" * 5000))
        table = table.set_column(i, name, pa.array([_cast(v, column.type) for v in values], column.type))
    elif how == "type":
        kind = rng.choice(TYPES)
        table = table.set_column(i, name, column.cast(kind, safe=False))
        how = f"type {kind}"
    elif how == "drop":
        table = table.remove_column(i)
    elif how == "rename":
        table = table.rename_columns(
            [*table.schema.names[:i], rng.choice((*table.schema.names, "x")), *table.schema.names[i + 1 :]]
        )
    elif how == "null":
        table = table.set_column(i, name, pa.nulls(len(table), column.type))
    elif how == "order":
        table = table.take(pa.array(rng.sample(range(len(table)), len(table))))
    else:
        table = pa.concat_tables([table] * 3)
    _put(file, table)
    return f"{name} {how}"


def _cast(value: Any, kind: pa.DataType) -> Any:
    """A value as far as a column can hold it, else something near."""
    try:
        return pa.scalar(value, kind).as_py()
    except (pa.ArrowException, ValueError, TypeError, OverflowError):
        return (
            None
            if pa.types.is_nested(kind)
            else pa.scalar(7 if not pa.types.is_dictionary(kind) else "x").cast(kind).as_py()
        )


def _bomb(bombs: Path, rng: random.Random, file: Path) -> str:
    """One of the small files with very many rows, or with a long text in very many of them, see `make_bombs`."""
    how = rng.choice(("rows", "texts"))
    shutil.copyfile(bombs / f"{file.name}.{how}", file)
    return how


def make_bombs(root: Path, folder: Path) -> None:
    """For each table below `root` two that unpack to some hundred times as much as their files lead to expect."""
    folder.mkdir()
    for file in sorted({p.name: p for p in root.rglob("*") if p.suffix in (".arrow", ".parquet")}.values()):
        table = _table(file)
        _put(
            folder / f"{file.name}.rows",
            table.take(pa.array(np.zeros(N_ROWS, np.int64))),
            20 if file.suffix == ".parquet" else 2,
        )
        text = pa.DictionaryArray.from_arrays(np.zeros(20_000, np.int32), pa.array(["x" * 1_000_000]))
        table = table.take(pa.array(np.zeros(len(text), np.int64)))
        for i, field in enumerate(table.schema):
            if field.type in (pa.string(), pa.dictionary(pa.int32(), pa.string())):
                table = table.set_column(i, pa.field(field.name, text.type, nullable=field.nullable), text)
        _put(folder / f"{file.name}.texts", table)
