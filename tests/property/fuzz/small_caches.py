"""Plays random missions where every cache that evicts has room for one thing: `python small_caches.py FIRST LAST` prints their hashes.

These caches are `functools.lru_cache` in tussle's modules, and those whose room is a constant named `KEPT_...`.
"""

from __future__ import annotations

import functools
import json
import sys
from typing import Any

ROOM = 1
shrunk: list[str] = []


def shrink_lru_caches() -> None:
    """Give each `lru_cache` that tussle's modules make from now on the least room."""
    shipped = functools.lru_cache

    def lru_cache(maxsize: Any = 128, typed: bool = False) -> Any:
        module = sys._getframe(1).f_globals["__name__"]
        is_own = module.startswith("tussle.") and maxsize is not None
        if is_own:
            shrunk.append(module)
        return shipped(ROOM if is_own else maxsize, typed)

    functools.lru_cache = lru_cache


def shrink_constants() -> None:
    """Set each KEPT_... of the imported modules to the least room."""
    for name, module in list(sys.modules.items()):
        for constant in [
            each for each in vars(module) if name.startswith("tussle.") and each.startswith("KEPT_")
        ]:
            setattr(module, constant, ROOM)
            shrunk.append(f"{name}.{constant}")


def main() -> None:
    """Print what differs between alone and stacks, and the hashes after each step of each mission that can be built, as JSON."""
    shrink_lru_caches()
    import histories

    from tussle.errors import TussleError

    shrink_constants()
    hashes: dict[int, tuple[str, ...]] = {}
    wrong = []
    for number in range(*map(int, sys.argv[1:])):
        try:
            hashes[number] = histories.played_alone(number, 1).hashes
        except TussleError:
            continue
        wrong += [text] if (text := histories.difference(number)) else []
    print(json.dumps({"shrunk": shrunk, "wrong": wrong, "hashes": hashes}))


if __name__ == "__main__":
    main()
