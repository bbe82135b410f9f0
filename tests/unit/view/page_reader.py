"""Reads the data of an offline page, from what the format says and with nothing of what writes it."""

from __future__ import annotations

import base64
import json
import re
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
        planes = [self.take(n) for _ in range(8)]
        return np.frombuffer(bytes(planes[k][i] for i in range(n) for k in range(8)), "<f8")


@dataclass
class Seen:
    """One entity in one frame."""

    team: int
    block: str
    pos: np.ndarray
    quat: np.ndarray
    health: float


class PageReader:
    """The first recording of a page."""

    def __init__(self, path: Path) -> None:
        self.text = path.read_text(encoding="utf-8")
        scripts = re.findall(r'<script type="([^"]*)" id="([^"]*)">([^<]*)</script>', self.text)
        self.blobs = {name: text for _, name, text in scripts}
        self.document = json.loads(self.blobs["document"])
        self.layer = self.document["layers"][0]
        index = Bytes(self.blob("index"))
        self.t = index.reals(self.layer["nFrames"])
        names = ("id", "team", "block", "first", "last")
        self.tracks = {name: index.ints(self.layer["nTracks"]) for name in names}
        assert index.at == len(index.data)
        self.frames: list[dict[int, Seen]] = [{} for _ in self.t]
        for i, (first, last) in enumerate(self.layer["pieces"]):
            self._read_piece(Bytes(self.blob(f"piece-{i}")), first, last)
        self.happenings = json.loads(self.blob("happenings"))

    def blob(self, name: str) -> bytes:
        return zlib.decompress(base64.b64decode(self.blobs[f"data-{name}"], validate=True))

    def _read_piece(self, data: Bytes, first: int, last: int) -> None:
        tracks, layer = self.tracks, self.layer
        who = [
            k for k in range(layer["nTracks"]) if tracks["first"][k] <= last and tracks["last"][k] >= first
        ]
        begin = [max(tracks["first"][k], first) for k in who]
        counts = [min(tracks["last"][k], last) - b + 1 for k, b in zip(who, begin, strict=True)]
        x, y, z, largest, *others, health = (data.column(counts) for _ in range(8))
        assert data.at == len(data.data)
        pos = np.array(layer["low"]) + layer["step"] * np.stack([x, y, z], 1)
        three = np.stack(others, 1) * np.sqrt(0.5) / layer["attitudeUnit"]
        quat = np.zeros((len(pos), 4))
        for row, leader in enumerate(largest):
            quat[row, [(leader + k) % 4 for k in (1, 2, 3)]] = three[row]
            quat[row, leader] = np.sqrt(1.0 - (three[row] ** 2).sum())
        row = 0
        for k, b, count in zip(who, begin, counts, strict=True):
            block = layer["blocks"][tracks["block"][k]]["name"]
            for frame in range(b, b + count):
                share = health[row] / layer["healthSteps"] * layer["fullHealth"]
                seen = Seen(tracks["team"][k], block, pos[row], quat[row], share)
                known = self.frames[frame].setdefault(tracks["id"][k], seen)
                # The frame at which one piece ends and the next begins is in both.
                assert (known.pos == seen.pos).all()
                assert (known.quat == seen.quat).all()
                row += 1
