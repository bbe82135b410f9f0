"""Counts of messages for a run directory: by link and outcome, and by topic and step."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import pyarrow as pa

from tussle.errors import ParameterError, RecordError, listed, nearest_name
from tussle.record.arrow_values import arrow_array
from tussle.record.schema import FILES, LINKS

MAX_LINKS = 1_000_000
"""Links that are collected before equal ones are added up."""


def check_file_names(networks: Sequence[Any]) -> dict[str, str]:
    """File of the counts of each network that has one, by instance name.

    Raises:
        ParameterError: A name is no plain file name, or taken.
    """
    found: dict[str, str] = {}
    for network in networks:
        name = network.values["csv_filename"]
        if name and (Path(name).name != name or name.startswith(".") or name in (*FILES, *found.values())):
            taken = listed([*FILES, *found.values()])
            raise ParameterError(
                f"{network.instance_name}.csv_filename = {name!r} is not allowed; it takes a plain file name that is not taken; {taken}"
            )
        if name:
            found[network.instance_name] = name
    return found


class Traffic:
    """Counts the messages of a simulation.

    Args:
        networks: The networks of the mission.
        directory: The run directory.
        n_worlds: Number of worlds.

    Raises:
        ParameterError: A file name is not allowed.
        RecordError: A file cannot be created.
    """

    def __init__(self, networks: Sequence[Any], directory: Path, n_worlds: int) -> None:
        names = check_file_names(networks)
        self.has_links = any(network.losses for network in networks)
        self._monitors = {
            network.instance_name: TopicMonitor(network, directory / names[network.instance_name], n_worlds)
            for network in networks
            if network.instance_name in names
        }
        self._outcomes = {n.instance_name: ("delivered", *n.losses) for n in networks}
        self._links: list[np.ndarray] = []
        self._n_links = 0

    def published(self, network: str, topic: str, count: np.ndarray) -> None:
        """Count messages published on a topic in this step, (n_worlds,)."""
        if network in self._monitors:
            self._monitors[network].add("Pub", topic, count)

    def counts_received(self, network: str, topic: str) -> bool:
        """Return True if the messages received on a topic are counted."""
        return network in self._monitors and self._monitors[network].has("Sub", topic)

    def received(self, network: str, topic: str, count: np.ndarray) -> None:
        """Count copies of messages received on a topic in this step, (n_worlds,)."""
        self._monitors[network].add("Sub", topic, count)

    def links(
        self,
        network: str,
        world: np.ndarray,
        sender: np.ndarray,
        receiver: np.ndarray,
        outcome: np.ndarray,
    ) -> None:
        """Count links of a network, each (m,); `outcome` is 0 or 1 + the index of a reason in the network's losses."""
        m, number = len(world), list(self._outcomes).index(network)
        rows = np.empty((6, m), np.int32)  # as in the file: half the memory, which is most of the cost
        rows[0], rows[1], rows[2], rows[3], rows[4], rows[5] = world, number, sender, receiver, outcome, 1
        self._links.append(rows)
        self._n_links += m
        if self._n_links > MAX_LINKS:
            self._links = [self._summed()]
            self._n_links = 0

    def _summed(self) -> np.ndarray:
        """The links so far, equal ones added up, (6, m)."""
        table = pa.table(dict(zip(LINKS.names, np.concatenate(self._links, axis=1), strict=True)))
        found = table.group_by(LINKS.names[:-1], use_threads=False).aggregate([("messages", "sum")])
        return np.stack([found[name].to_numpy() for name in (*LINKS.names[:-1], "messages_sum")])

    def take_links(self) -> pa.RecordBatch:
        """All links, ordered by world, network, sender, receiver and outcome."""
        found = self._summed() if self._links else np.empty((6, 0), np.int64)
        found = found[:, np.lexsort(found[-2::-1])]
        names = list(self._outcomes)
        columns: dict[str, Any] = dict(zip(LINKS.names, found, strict=True))
        columns["network"] = [names[i] for i in found[1].tolist()]
        columns["outcome"] = [self._outcomes[names[i]][k] for i, k in found[[1, 4]].T.tolist()]
        arrays = [arrow_array(columns[field.name], field.type) for field in LINKS]
        return pa.RecordBatch.from_arrays(arrays, schema=LINKS)

    def end_step(self, t: np.ndarray, running: np.ndarray) -> None:
        """Write the counts of a step: time of its beginning [s], (n_worlds,), and which worlds played it."""
        for monitor in self._monitors.values():
            monitor.end_step(t, running)

    def unknown_topics(self, topics: Iterable[tuple[str, str]]) -> list[str]:
        """A warning for each monitored topic that is not in `topics`, (network, name) of all topics that the game had."""
        known: dict[str, list[str]] = {name: [] for name in self._monitors}
        for network, name in topics:
            known.setdefault(network, []).append(name)
        return [
            f"{network} had no topic {topic!r} to count{nearest_name(topic, known[network])}; {listed(known[network])}"
            for network, monitor in self._monitors.items()
            for topic in dict.fromkeys(topic for _, topic in monitor.counts)
            if topic not in ("*", *known[network])
        ]

    @property
    def file_names(self) -> list[str]:
        """Names of the CSV files."""
        return [Path(monitor.file.name).name for monitor in self._monitors.values()]

    def close(self) -> None:
        for monitor in self._monitors.values():
            monitor.file.close()


class TopicMonitor:
    """Counts the messages of some topics of a network, and writes one line per step and world to a CSV file.

    The columns are those of SCRIMMAGE: t, TOPIC_Pub_Count, TOPIC_Sub_Count; and the world.
    """

    file: TextIO

    def __init__(self, network: Any, path: Path, n_worlds: int) -> None:
        kinds = ("Pub", "monitor_publisher_topics"), ("Sub", "monitor_subscriber_topics")
        self.counts = {
            (kind, topic): np.zeros(n_worlds, np.int64)
            for kind, param in kinds
            for topic in sorted(network.values[param].replace(",", " ").split())
        }
        try:
            self.file = path.open("x", newline="", encoding="utf-8")
        except OSError as error:
            where = f"{network.instance_name}.csv_filename"
            raise RecordError(f"{path}: {where} cannot be written: {error.strerror or error}") from error
        self._lines = csv.writer(self.file, lineterminator="\n")
        self._lines.writerow(["t", "world", *(f"{topic}_{kind}_Count" for kind, topic in self.counts)])

    def has(self, kind: str, topic: str) -> bool:
        """Return True if messages of a topic are counted; `kind` is "Pub" or "Sub"."""
        return any(True for _ in self._counted(kind, topic))

    def _counted(self, kind: str, topic: str) -> Iterator[np.ndarray]:
        for name in (topic, "*"):
            if (kind, name) in self.counts:
                yield self.counts[kind, name]

    def add(self, kind: str, topic: str, count: np.ndarray) -> None:
        """Count messages of this step, (n_worlds,)."""
        for counted in self._counted(kind, topic):
            np.add(counted, count, out=counted)

    def end_step(self, t: np.ndarray, running: np.ndarray) -> None:
        for world in np.flatnonzero(running):
            counts = [int(count[world]) for count in self.counts.values()]
            self._lines.writerow([repr(float(t[world])), world, *counts])
        for count in self.counts.values():
            count[:] = 0
