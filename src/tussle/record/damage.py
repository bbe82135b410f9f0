"""Looks for damage in a run directory, block by block, without loading it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tussle.documents import DAMAGED
from tussle.errors import RecordError
from tussle.folders import real_path
from tussle.record.arrow_blocks import InvalidStreamError, find_blocks
from tussle.record.arrow_file import damage_of
from tussle.record.run import run_directory
from tussle.record.run_file import crc_of_file
from tussle.record.schema import FILES, RUN, RUN_FILE


def damage_in_run(path: str | Path) -> tuple[list[str], list[str]]:
    """Compare the files of a run directory with their checksums.

    Args:
        path: The directory.

    Returns:
        What is damaged or missing, and what has no checksum, one line each.

    Raises:
        RecordError: It is not a run directory.
    """
    place = run_directory(path)
    damage, unchecked = list[str](), list[str]()
    info: dict[str, Any] = {}
    if RUN.is_damaged(place / RUN_FILE):
        damage.append(f"{RUN_FILE} {DAMAGED}")
    elif (place / RUN_FILE).exists():
        try:
            info = RUN.read(place / RUN_FILE)
        except RecordError as error:
            damage.append(str(error))
    for name in (name for name in FILES if name.endswith(".arrow")):
        written = info.get("files", {}).get(name)
        if (place / name).exists():
            found, unknown = stream_damage(place / name)
            size = (place / name).stat().st_size
            if not found and written is not None and size != written["bytes"]:
                found = f"{name} has {size:,} bytes, but {written['bytes']:,} were written"
            damage += [found] if found else []
            unchecked += [unknown] if unknown else []
        elif written is not None:
            damage.append(f"{name} is missing")
    damage += file_damage(place, info.get("checksums") or {}, RUN_FILE)
    return damage, unchecked


def stream_damage(path: Path) -> tuple[str, str]:
    """What is damaged in an Arrow file, and that it has no checksums; "" if nothing is, or it has."""
    try:
        blocks = find_blocks(path)
    except (OSError, InvalidStreamError) as error:
        return f"{path.name} cannot be read: {error}", ""
    truncated = f"{path.name} is truncated after {blocks.end:,} bytes" if blocks.is_truncated else ""
    return damage_of(path, blocks) or truncated, "" if blocks.is_sealed else f"{path.name} has no checksums"


def file_damage(folder: Path, written: Mapping[str, str], document: str) -> list[str]:
    """What is damaged or missing of the files whose checksums a document lists."""
    damage = []
    for name, crc in written.items():
        if not real_path(folder / name).is_relative_to(real_path(folder)):
            damage.append(f"{document} names a file outside of its directory")
            continue
        try:
            if crc_of_file(folder / name) != crc:
                damage.append(f"{name} is damaged, or was edited: its checksum is not that in {document}")
        except OSError as error:
            damage.append(f"{name} cannot be read: {error.strerror or error}")
    return damage
