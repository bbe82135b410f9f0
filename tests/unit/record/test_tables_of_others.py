"""Arrow and Parquet files that lie about their sizes, or hold what is not allowed, are refused before memory is taken for them."""

from __future__ import annotations

import math
import os
import struct
import tracemalloc

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tussle.errors import ParameterError, RecordError
from tussle.plugins.stock.autonomy.trajectory_record_playback import read_recorded
from tussle.record.arrow_file import read_batches
from tussle.record.first_states import read_table
from tussle.record.parquet_file import ParquetTable
from tussle.record.parquet_sizes import Sizes, sizes_of
from tussle.record.schema import EVENTS, EVENTS_RULES, TRAJECTORY, TRAJECTORY_RULES

ROW = {"world": 0, "t": 0.5, "step": 5, "kind": "birth", "id": 1, "other": 0, "text": "prey"}


def events(**changes):
    return pa.table({name: [value] * 3 for name, value in (ROW | changes).items()}, EVENTS)


def put(path, table, **options):
    with (
        pa.OSFile(str(path), "wb") as file,
        pa.ipc.new_stream(file, table.schema, options=pa.ipc.IpcWriteOptions(**options)) as writer,
    ):
        writer.write_table(table)
    return path


def read(path, schema=EVENTS, rules=EVENTS_RULES):
    """A file with all that is missing of it; memory that was taken on the way is little."""
    notes = []
    pool = pa.default_memory_pool()
    before = pool.bytes_allocated()
    tracemalloc.start()
    try:
        return list(read_batches(path, notes, RecordError, schema, rules)), notes
    finally:
        assert tracemalloc.get_traced_memory()[1] < 1 << 26
        assert pool.bytes_allocated() - before < 1 << 26
        tracemalloc.stop()


def test_a_whole_stream_and_a_cut_one(tmp_path):
    path = put(tmp_path / "events.arrow", events())
    batches, notes = read(path)
    assert (batches[0].num_rows, notes) == (3, [])
    assert read(tmp_path / "none.arrow") == ([], ["none.arrow is missing"])
    whole = path.read_bytes()
    for size in range(0, len(whole), 7):
        path.write_bytes(whole[:size])
        batches, notes = read(path)
        assert len(notes) == 1
        assert sum(b.num_rows for b in batches) in (0, 3)


@pytest.mark.parametrize("number", [-1, 0, 1, 2**31 - 1, 2**40, 2**62, -(2**63)])
def test_a_stream_that_lies_in_any_of_its_words_takes_no_memory(tmp_path, number):
    path = put(tmp_path / "events.arrow", events())
    whole = path.read_bytes()
    n_refused = 0
    for place in range(0, len(whole) - 8, 4):
        for code, width in (("<q", 8), ("<i", 4)):
            if width == 8 or -(2**31) <= number < 2**31:
                path.write_bytes(whole[:place] + struct.pack(code, number) + whole[place + width :])
                try:
                    read(path)
                except RecordError as error:
                    n_refused += 1
                    assert str(error).startswith(str(path))  # noqa: PT017  many are tried
    assert n_refused > 50


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (events().drop_columns(["kind"]), "it has no column 'kind' of string"),
        (events().select(EVENTS.names[::-1]), "other columns than a table of tussle"),
        (events().append_column("more", pa.array([1, 2, 3])), "other columns than a table of tussle"),
        (events(t=math.nan), "column 't' holds NaN"),
        (events(t=math.inf), "t = inf in row 0 is not allowed"),
        (events(step=-1), "step = -1 in row 0 is not allowed; it takes 0 to 2147483647"),
        (events().cast(pa.schema([f.with_nullable(True) for f in EVENTS])).set_column(0, "world", pa.nulls(3, pa.int32())),
         "column 'world' has nulls"),
    ],
)  # fmt: skip
def test_a_stream_of_something_else_is_refused(tmp_path, table, said):
    with pytest.raises(RecordError, match=said):
        read(put(tmp_path / "events.arrow", table))


def test_a_stream_that_is_compressed_or_no_stream_is_refused(tmp_path):
    zeros = pa.table({"id": np.zeros(10_000_000, np.int64)})
    with pytest.raises(RecordError, match="it is compressed"):
        read(put(tmp_path / "a.arrow", zeros, compression="zstd"), None, None)
    (tmp_path / "b.arrow").write_bytes(b"something else " * 9)
    with pytest.raises(RecordError, match="it is not an Arrow stream"):
        read(tmp_path / "b.arrow")
    os.mkfifo(tmp_path / "c.arrow")
    with pytest.raises(RecordError, match="not a regular file"):
        read(tmp_path / "c.arrow")


def test_a_long_word_in_many_rows_is_refused(tmp_path):
    words = pa.DictionaryArray.from_arrays(np.zeros(1000, np.int32), pa.array(["x" * 1_000_000]))
    columns = [words if f.name == "block" else pa.array(np.ones(1000)).cast(f.type) for f in TRAJECTORY]
    path = put(tmp_path / "trajectory.arrow", pa.Table.from_arrays(columns, schema=TRAJECTORY))
    with pytest.raises(RecordError, match="column 'block' has 1,000 rows and a text of 1,000,000 bytes"):
        read(path, TRAJECTORY, TRAJECTORY_RULES)


# -- Parquet --------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (pa.table({"a": [1]}), "is another table; it has no column 'run' of int64"),
        (pa.table({"run": [1], "a": [{"b": 1}]}), "column 'a' has type struct"),
        (pa.table([[1], [2]], names=["run", "run"]), "unique names"),
        (pa.table({"run": pa.array(np.zeros(20_000_000, np.int64))}), "takes 160,[0-9,]+ bytes in memory"),
        (pa.table({"run": [1], "a": [[1]]}), "column 'a' has type list"),
    ],
)  # fmt: skip
def test_a_parquet_table_of_something_else_is_refused(tmp_path, table, said):
    pq.write_table(table, tmp_path / "a.parquet", compression="zstd")
    with pytest.raises(RecordError, match=said):
        ParquetTable(tmp_path / "a.parquet", pa.schema([("run", pa.int64())]), RecordError).read()


def test_a_parquet_table_whose_texts_are_a_bomb_is_refused(tmp_path):
    text = pa.DictionaryArray.from_arrays(np.zeros(100_000, np.int32), pa.array(["x" * 100_000]))
    pq.write_table(pa.table({"a": text}), tmp_path / "a.parquet", compression="zstd", store_schema=False)
    assert (tmp_path / "a.parquet").stat().st_size < 10_000
    with pytest.raises(RecordError, match="it takes more than"):
        ParquetTable(tmp_path / "a.parquet", pa.schema([]), RecordError).read()
    with pytest.raises(RecordError, match="it has 100,000 rows; the limit is 99,999"):
        ParquetTable(tmp_path / "a.parquet", pa.schema([]), RecordError, most_rows=99_999).read()


def test_a_parquet_table_with_one_very_long_list_is_refused(tmp_path):
    zeros = pa.array(np.zeros(20_000_000))
    table = pa.table({"a": pa.ListArray.from_arrays(pa.array([0, len(zeros)], pa.int32()), zeros)})
    pq.write_table(table, tmp_path / "a.parquet", compression="zstd")
    with pytest.raises(RecordError, match=r"takes 160,[0-9,]+ bytes"):
        ParquetTable(tmp_path / "a.parquet", pa.schema([]), RecordError).read()


def test_a_parquet_table_with_a_very_large_page_is_refused(tmp_path):
    text = pa.array(["x" * 100_000_000])
    pq.write_table(
        pa.table({"a": text}),
        tmp_path / "a.parquet",
        compression="zstd",
        use_dictionary=False,
        write_statistics=False,
    )
    with pytest.raises(RecordError, match=r"it has a page of 100,000,[0-9]+ bytes; the limit is 67,108,864"):
        ParquetTable(tmp_path / "a.parquet", pa.schema([]), RecordError).read()


def test_the_sizes_of_a_parquet_file_are_those_that_arrow_sees(tmp_path):
    path = tmp_path / "a.parquet"
    pq.write_table(
        pa.table({"a": np.arange(5000), "b": [["x", "y"]] * 5000}),
        path,
        row_group_size=777,
        use_dictionary=False,
    )
    about = pq.read_metadata(path)
    groups = [about.row_group(i) for i in range(about.num_row_groups)]
    with path.open("rb") as file:
        sizes = sizes_of(file, path.stat().st_size)
    assert (sizes.rows, sizes.values) == (5000, sum(g.column(1).num_values for g in groups)) == (5000, 10_000)
    assert (
        0
        < sizes.largest
        <= sizes.bytes
        <= sum(g.column(i).total_uncompressed_size for g in groups for i in range(2))
    )
    pq.write_table(pa.table({"a": np.zeros(0)}), path)
    with path.open("rb") as file:
        assert sizes_of(file, path.stat().st_size) == Sizes(0)


@pytest.mark.slow
def test_a_parquet_file_that_is_damaged_anywhere_is_read_or_refused(tmp_path):
    path = tmp_path / "a.parquet"
    pq.write_table(pa.table({"a": np.arange(30), "b": [["x", "y"]] * 30}), path, row_group_size=20)
    whole = path.read_bytes()
    n_refused = 0
    for place in range(len(whole)):
        for value in (0, 0x7F, 0xFF, whole[place] ^ 0x10):
            path.write_bytes(whole[:place] + bytes([value]) + whole[place + 1 :])
            try:
                ParquetTable(path, pa.schema([("a", pa.int64())]), RecordError, ["a"]).read()
            except RecordError as error:
                n_refused += 1
                assert str(error).startswith(str(path))  # noqa: PT017  many are tried
    assert n_refused > 100


# -- a table to start from --------------------------------------------------------------------------------------------------------


def test_a_csv_that_is_a_bomb_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("tussle.record.first_states.MARGIN", 1 << 16)
    monkeypatch.setattr("tussle.record.first_states.MAX_EXPANSION", 10)
    with pa.output_stream(str(tmp_path / "a.csv.gz"), compression="gzip") as file:
        file.write(b"id,t\n" + b"\n" * 10_000_000)
    with pytest.raises(RecordError, match=r"a.csv.gz: cannot be read: its decompressed size exceeds"):
        read_table(tmp_path / "a.csv.gz")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"id": [1.5e300]}, "column 'id' must hold integers"),
        ({"team": [math.nan]}, "column 'team' must hold integers"),
        ({"team": [0.5]}, "column 'team' must hold integers .*, not 0.5"),
        ({"world": ["a"]}, "column 'world' must hold numbers"),
        ({"block": [1]}, "column 'block' must hold names"),
    ],
)
def test_a_table_to_start_from_with_odd_columns_is_refused(tmp_path, change, said):
    row = {"id": [1], "t": [0.0], "x": [0.0], "y": [0.0], "z": [0.0], "qw": [1.0], "qx": [0.0], "qy": [0.0], "qz": [0.0], "vx": [0.0],
           "vy": [0.0], "vz": [0.0]}  # fmt: skip
    pq.write_table(pa.table(row | change), tmp_path / "a.parquet")
    with pytest.raises(RecordError, match=said):
        read_table(tmp_path / "a.parquet")
    table = pa.table(row | {"other": [0]}).rename_columns([*row, "x"])
    with pytest.raises(RecordError, match="two columns have the same name"):
        read_table(put(tmp_path / "b.arrow", table))


HEAD = "id,t,x,y,z,qw,qx,qy,qz,vx,vy,vz"
FIRST, OTHER = "1,0,5,6,7,1,0,0,0,1,0,0", "1,0,8,6,7,1,0,0,0,1,0,0"
READERS = {
    "start": (read_table, RecordError),
    "playback": (lambda path: read_recorded(str(path)), ParameterError),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ((HEAD, FIRST.replace("1,", "1.5,", 1)), "column 'id' must hold integers .*, not 1.5"),
        ((HEAD, FIRST, OTHER), "entity 1 has two states at t = 0 s; it takes one"),
        ((HEAD, OTHER, FIRST, FIRST), "entity 1 has two states at t = 0 s"),
        ((f"x,{HEAD}", f"9,{FIRST}"), "two columns have the same name; there are: x, id, t, x"),
        ((HEAD.upper(), FIRST), "column 'id' is missing .*'ID'.*; there are: ID, T, X"),
        ((f"name,{HEAD[:-3]}", f"a,{FIRST[:-2]}"), "column 'vz' is missing.*; there are: name, id, t, x"),
        *(
            ((HEAD.replace(",", mark), FIRST.replace("5", number).replace(",", mark)), f"its values are separated by {name}")
            for mark, name in ((";", "';'"), ("\t", "tabs"), ("|", "'\\|'"))
            for number in ("5", "5.5")
        ),
        ((HEAD.replace(",", ";"), FIRST.replace(",", ";").replace("5", "5,5")), "takes commas between values, and points in numbers"),
    ],
)  # fmt: skip
def test_a_csv_of_another_program_is_refused_for_what_it_is(tmp_path, reader, lines, said):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines) + "\n")
    read_it, error = READERS[reader]
    with pytest.raises(error, match=rf"a\.csv: .*{said}"):
        read_it(path)


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize(
    "change",
    [
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace(",", ", "),
        lambda text: text.replace("\n1,", "\n1.0,"),
        lambda text: text + FIRST + "\n",  # once more the same
        lambda text: text.replace("id", "note,id").replace("\n1,", "\nhi,1,"),
    ],
)
def test_a_csv_of_another_program_is_read_as_our_own(tmp_path, reader, change):
    text = f"{HEAD}\n{FIRST}\n"
    (tmp_path / "a.csv").write_text(text)
    (tmp_path / "b.csv").write_text(change(text), newline="")
    own, other = (READERS[reader][0](tmp_path / name) for name in ("a.csv", "b.csv"))
    at = ("pos", "quat", "vel") if reader == "start" else ("values",)
    for name in at:
        np.testing.assert_array_equal(getattr(own, name)[:, :1], getattr(other, name)[:, :1])
    assert own.id.tolist() == other.id.tolist() == [1]
