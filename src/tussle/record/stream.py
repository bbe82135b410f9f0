"""A table on its way to a file."""

from __future__ import annotations

import os
from pathlib import Path

import pyarrow as pa

from tussle.errors import RecordError


class Stream:
    """An Arrow stream in a file. What `write` has returned from is with the operating system.

    Raises:
        RecordError: The file cannot be made or written. What was written before stays whole.
    """

    def __init__(self, path: Path, schema: pa.Schema) -> None:
        self.path = path
        self.rows = 0
        self.whole = 0
        try:
            self._file = pa.OSFile(str(path), "wb")
            self._writer = pa.ipc.new_stream(self._file, schema)  # writes nothing before the first batch
        except OSError as error:
            raise self._failed(error) from error

    def write(self, batch: pa.RecordBatch) -> None:
        """Append a batch."""
        try:
            self._writer.write_batch(batch)
            self.whole = self._file.tell()
        except OSError as error:
            self._drop()
            raise self._failed(error) from error
        self.rows += batch.num_rows

    def close(self) -> None:
        """Write the end mark. A second call does nothing."""
        if self._file.closed:
            return
        try:
            self._writer.close()
            self._file.close()
        except OSError as error:
            self._drop()
            raise self._failed(error) from error

    @property
    def size(self) -> int:
        """Length of the file [B]."""
        return self.path.stat().st_size

    def abandon(self) -> None:
        """Close the file as it is, without the end mark. A second call does nothing."""
        self._file.close()

    def _drop(self) -> None:
        """Leave the file with its whole batches only: half a batch is of no use to anybody."""
        self.abandon()
        os.truncate(self.path, self.whole)

    def _failed(self, error: OSError) -> RecordError:
        reason = os.strerror(error.errno) if error.errno else str(error)
        kept = f"; the {self.rows} rows written before are whole" if self.rows else ""
        return RecordError(f"{self.path}: cannot be written: {reason}{kept}")
