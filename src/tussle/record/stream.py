"""Writer of a table to a file."""

from __future__ import annotations

import os
from pathlib import Path

import pyarrow as pa

from tussle.errors import RecordError
from tussle.record.arrow_blocks import END_MARK, sealed_blocks

MAX_JOINED = 1 << 18
"""Size of a block up to which its pieces are written at once [B]; copying a larger one costs more than the calls."""


class Stream:
    """An Arrow stream in a file, in blocks with checksums. When `write` returns, the batch is with the operating system.

    Raises:
        RecordError: The file cannot be created or written. Batches written before stay intact.
    """

    def __init__(self, path: Path, schema: pa.Schema) -> None:
        self.path = path
        self.rows = 0
        self._end = 0
        self._schema = schema
        try:
            self._file = pa.OSFile(str(path), "wb")
        except OSError as error:
            raise self._failed(error) from error

    def write(self, batch: pa.RecordBatch) -> None:
        """Append a batch."""
        schema, block = sealed_blocks(batch)
        try:
            if not self._end:
                self._file.write(schema)
            if sum(map(len, block)) <= MAX_JOINED:
                block = [b"".join(block)]
            for piece in block:
                self._file.write(piece)
            self._end = self._file.tell()
        except OSError as error:
            self._truncate()
            raise self._failed(error) from error
        self.rows += batch.num_rows

    def close(self) -> None:
        """Write the end mark. A second call does nothing."""
        if self._file.closed:
            return
        try:
            if not self._end:
                self._file.write(sealed_blocks(pa.RecordBatch.from_pylist([], self._schema))[0])
            self._file.write(END_MARK)
            self._file.close()
        except OSError as error:
            self._truncate()
            raise self._failed(error) from error

    @property
    def size(self) -> int:
        """Size of the file [B]."""
        return self.path.stat().st_size

    def abandon(self) -> None:
        """Close the file without writing the end mark. A second call does nothing."""
        self._file.close()

    def _truncate(self) -> None:
        """Cut the file after its last complete batch."""
        self.abandon()
        os.truncate(self.path, self._end)

    def _failed(self, error: OSError) -> RecordError:
        reason = os.strerror(error.errno) if error.errno else str(error)
        kept = f"; the {self.rows} rows written before are intact" if self.rows else ""
        return RecordError(f"{self.path}: cannot be written: {reason}{kept}")
