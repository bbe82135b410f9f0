"""Reads chunks of frames and offline pages, from what the format says and with nothing of what writes them."""

from __future__ import annotations

import base64
import json
import re
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np


class Bytes:
    """Numbers one block after another."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def take(self, n: int) -> bytes:
        self.at += n
        assert self.at <= len(self.data)
        return self.data[self.at - n : self.at]

    def ints(self, n: int) -> list[int]:
        n_planes = self.take(1)[0]
        assert n_planes <= 4
        planes = [self.take(n) for _ in range(n_planes)]
        zigzag = [sum(plane[i] << 8 * k for k, plane in enumerate(planes)) for i in range(n)]
        return [v // 2 if v % 2 == 0 else -(v + 1) // 2 for v in zigzag]

    def column(self, counts: list[int]) -> np.ndarray:
        order = self.take(1)[0]
        heads, steps = self.ints(len(counts)), iter(self.ints(sum(counts) - len(counts)))
        out = []
        for head, count in zip(heads, counts, strict=True):
            values, slope = [head], 0
            for _ in range(count - 1):
                slope = next(steps) + (slope if order == 2 else 0)
                values.append(values[-1] + slope)
            out += values
        return np.array(out)

    def reals(self, n: int) -> np.ndarray:
        return np.frombuffer(self.take(8 * n), "<f8")


@dataclass
class Seen:
    """One entity in one frame."""

    team: int
    block: int
    pos: np.ndarray
    quat: np.ndarray
    health: float


@dataclass
class ChunkData:
    """A chunk: times of its frames, id -> entity of each, and its tracks."""

    first: int
    t: np.ndarray
    frames: list[dict[int, Seen]]
    tracks: dict[str, list[int]]
    step: float
    full_health: float


def read_chunk(raw: bytes) -> ChunkData:
    """A chunk of frames; blocks are numbers."""
    data = Bytes(raw)
    *low, step, full_health = struct.unpack("<5d", data.take(40))
    first, n_frames, n_tracks = struct.unpack("<3I", data.take(12))
    t = data.reals(n_frames)
    tracks = {name: data.ints(n_tracks) for name in ("id", "team", "block", "first", "last")}
    counts = [last - begin + 1 for begin, last in zip(tracks["first"], tracks["last"], strict=True)]
    x, y, z, largest, *others, health = (data.column(counts) for _ in range(8))
    assert data.at == len(data.data)
    pos = np.array(low) + step * np.stack([x, y, z], 1)
    three = np.stack(others, 1) * np.sqrt(0.5) / 2047
    quat = np.zeros((len(pos), 4))
    for row, leader in enumerate(largest):
        quat[row, [(leader + k) % 4 for k in (1, 2, 3)]] = three[row]
        quat[row, leader] = np.sqrt(1.0 - (three[row] ** 2).sum())
    frames: list[dict[int, Seen]] = [{} for _ in t]
    row = 0
    for k, count in enumerate(counts):
        for i in range(count):
            seen = Seen(
                tracks["team"][k], tracks["block"][k], pos[row], quat[row], health[row] / 255 * full_health
            )
            assert tracks["id"][k] not in frames[tracks["first"][k] + i]
            frames[tracks["first"][k] + i][tracks["id"][k]] = seen
            row += 1
    return ChunkData(first, t, frames, tracks, step, full_health)


class PageReader:
    """What stands on an offline page."""

    def __init__(self, path: Path) -> None:
        self.text = path.read_text(encoding="utf-8")
        scripts = re.findall(r'<script type="([^"]*)" id="([^"]*)">([^<]*)</script>', self.text)
        self.blobs = {name: text for _, name, text in scripts}
        self.document = json.loads(self.blobs["document"])
        self.t = Bytes(self.blob("times")).reals(self.document["nFrames"])
        self.events = json.loads(self.blob("events"))
        self.chunks = [read_chunk(self.blob(f"chunk-{i}")) for i in range(len(self.document["chunks"]))]
        self.frames: list[dict[int, Seen]] = [{} for _ in self.t]
        for (first, last), chunk in zip(self.document["chunks"], self.chunks, strict=True):
            assert (chunk.first, len(chunk.t)) == (first, last - first + 1)
            assert (chunk.t == self.t[first : last + 1]).all()
            for i, seen in enumerate(chunk.frames):
                # The frame at which one chunk ends and the next begins is in both.
                assert not self.frames[first + i] or sorted(self.frames[first + i]) == sorted(seen)
                self.frames[first + i] = seen

    def blob(self, name: str) -> bytes:
        return zlib.decompress(base64.b64decode(self.blobs[f"data-{name}"], validate=True))
