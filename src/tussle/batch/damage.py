"""Looks for damage in a batch directory."""

from __future__ import annotations

from pathlib import Path

from tussle.batch import store
from tussle.batch.schemas import BATCH_FILE, PARTS, TABLES
from tussle.errors import BatchError, RecordError
from tussle.record.damage import damage_in_run, stream_damage
from tussle.record.parquet_blocks import intact_groups


def damage_in_batch(path: str | Path) -> tuple[list[str], list[str]]:
    """Compare the files of a batch directory, and of the runs that are recorded in it, with their checksums.

    Args:
        path: The directory.

    Returns:
        What is damaged, and what has no checksum, one line each.

    Raises:
        BatchError: There is no batch.
    """
    place = Path(path)
    damage, unchecked = list[str](), list[str]()
    try:
        info = store.read_info(place)
        damage += store.damage(place, info)
        for name in TABLES:
            file = place / name
            if file.exists() and not damage:
                with file.open("rb") as opened:
                    if intact_groups(opened, file.stat().st_size) is None:
                        unchecked.append(f"{name} has no checksums")
    except BatchError as error:
        if not (place / BATCH_FILE).exists():
            raise
        damage.append(str(error))
    for part in sorted((place / PARTS).glob("*.arrow")):
        found, unknown = stream_damage(part)
        damage += [f"{PARTS}/{found}"] if found else []
        unchecked += [f"{PARTS}/{unknown}"] if unknown else []
    for run in sorted((place / store.RUNS).glob("*")):
        try:
            found_in, unknown_in = damage_in_run(run)
        except RecordError as error:
            found_in, unknown_in = [str(error)], []
        damage += [f"{store.RUNS}/{run.name}: {line}" for line in found_in]
        unchecked += [f"{store.RUNS}/{run.name}: {line}" for line in unknown_in]
    return damage, unchecked
