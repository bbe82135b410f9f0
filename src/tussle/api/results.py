"""Results that world plugins return, checked."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

from tussle.errors import ParameterError


def named(found: Any, where: str) -> Mapping[str, Any]:
    """Return results by name.

    Raises:
        ParameterError: They are no dict, or have a name that is no text.
    """
    if not isinstance(found, Mapping):
        raise ParameterError(f"{where} returns {found!r:.60}; it takes a dict, {{'name': value}}")
    for name in found:
        if not (isinstance(name, str) and name):
            raise ParameterError(f"{where}: {name!r:.60} is not a name; it takes a text")
    return found


def number(value: Any, where: str, allowed: str) -> bool | int | float:
    """Return a number of a result.

    Raises:
        ParameterError: It is none, or too long for tables.
    """
    found = value.item() if isinstance(value, np.generic | np.ndarray) and value.ndim == 0 else value
    if not isinstance(found, (bool, int, float)):
        raise ParameterError(f"{where} = {value!r:.60} is not allowed; it takes {allowed}")
    if isinstance(found, int) and abs(found) > sys.float_info.max:
        raise ParameterError(
            f"{where} is a whole number of {found.bit_length():,} bits; it takes up to 1,024"
        )
    return found
