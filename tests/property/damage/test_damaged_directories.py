"""Directories of runs, batches, searches, studies and leagues, damaged somehow: each is read or refused in one message, in bounded time.

TUSSLE_DAMAGES sets how many are tried; by default two thousand, in two minutes of CPU time.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from cli_process import environment

N = int(os.environ.get("TUSSLE_DAMAGES", "2000"))
DOORS = Path(__file__).with_name("doors.py")
HOW = (
    "cut", "flip", "word", "zeros", "long", "empty", "removed", "folder", "fifo", "link", "swapped", "value", "gone", "deep", "column",
    "bomb",
)  # fmt: skip


@pytest.mark.slow
def test_damaged_directories_end_in_one_message_or_are_read(tmp_path):
    first = 0 if N == 2000 else int.from_bytes(os.urandom(4))
    words = [
        sys.executable,
        str(DOORS),
        str(tmp_path / "sources"),
        str(tmp_path / "work"),
        str(first),
        str(first + N),
    ]
    worker = subprocess.run(words, env=environment(), capture_output=True, text=True, check=False)
    assert worker.returncode == 0, f"{worker.stdout[-2000:]}\n{worker.stderr[-4000:]}"
    told = [json.loads(line) for line in worker.stdout.splitlines()]
    faults = [
        f"{number} {kind}: {damage}\n{door}: {said}"
        for number, kind, damage, door, _, said in told
        if said.startswith("FAULT")
    ]
    assert not faults, "\n\n".join(faults[:5])
    assert len({number for number, *_ in told}) == N
    if N < 2000:
        return  # Chance may leave a kind of damage out, or refuse all directories of a kind.
    damages = " ".join(damage for _, _, damage, *_ in told)
    assert [how for how in HOW if f" {how} " not in damages] == []
    assert {kind for _, kind, *_, said in told if said} == {kind for _, kind, *_, said in told if not said}
