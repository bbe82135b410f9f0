"""No test is timed: what passes on a fast machine passes on a slow one that has much else to do."""

from __future__ import annotations

import re

from hypothesis import HealthCheck, settings
from tree import python_files, relative

MIN_PATIENCE = 30.0
"""Shorter limits on a wait for another process or thread are reached by a busy machine [s]."""
LIMITED = re.compile(
    r"(?:communicate|wait|join)\((?:timeout=)?([\d.]+)\)|(?:monotonic|perf_counter)\(\) - \w+ < ([\d.]+)|"
    r"(?:monotonic|perf_counter)\(\) \+ ([\d.]+)"
)


def test_no_test_has_a_deadline():
    assert settings.default.deadline is None
    assert HealthCheck.too_slow in settings.default.suppress_health_check
    word = "dead" + "line="
    holders = [relative(path) for path in python_files("tests") if word in path.read_text()]
    assert holders == ["tests/conftest.py"]


def test_nothing_is_waited_for_impatiently():
    impatient = [
        f"{relative(path)}:{i}: {line.strip()}"
        for path in python_files("tests")
        for i, line in enumerate(path.read_text().splitlines(), 1)
        for found in LIMITED.finditer(line)
        if float(next(filter(None, found.groups()))) < MIN_PATIENCE
    ]
    assert not impatient
