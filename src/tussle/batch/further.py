"""Names the runs that would narrow the answer of a batch, as commands that can be copied."""

from __future__ import annotations

import math
import shlex
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from tussle.batch.target import Answers, ChoiceAnswer
from tussle.batch.variables import Range, Variable
from tussle.mission.codecs import written

RUNS = 1000
"""Seeds of a point after which a command with a target ends, unless it says otherwise."""
MAX_BETWEEN = 4
"""Values between two that were played."""
COUNTS = ("--runs", "-n", "--until", "--target", "--over", "--out", "--record-runs")
SAMPLING = ("--sample", "--samples", "--sample-seed", "--sweep")


def further_runs(answers: Answers, info: Mapping[str, Any], path: Path | None) -> list[tuple[str, str]]:
    """What further runs would narrow the answers, and the command that plays them; none for a batch that no command line has played.

    Args:
        answers: The answers.
        info: What `batch.json` says.
        path: The batch directory.
    """
    command = list(info["command"])
    if path is None or len(command) < 3 or command[1] != "batch":
        return []
    asked = ["--target", str(answers.target)]
    if answers.over is not None and (info.get("over") or len(answers.notes)):
        asked += ["--over", answers.over.name]
    found = []
    if wanted := answers.wanted():
        n = RUNS if info["n_seeds"] < RUNS else 2 * int(info["n_seeds"])
        words = [
            *without(command[2:], COUNTS),
            "--out",
            str(path),
            *asked,
            *(["-n", str(n)] if n > RUNS else []),
        ]
        points = "1 point" if len(wanted) == 1 else f"{len(wanted)} points"
        found.append(
            (f"more games of {points}, until the answer is known", shlex.join(["tussle", "batch", *words]))
        )
    for answer in answers.answers:
        if answers.over is None or not (between := values_between(answer, answers.over)):
            continue
        words = without(command[2:], (*COUNTS, *SAMPLING), [answers.over.name, *answer.values])
        words += ["--vary", f"{answers.over.name}={','.join(between)}"]
        words += [w for name, value in answer.values.items() for w in ("--set", f"{name}={written(value)}")]
        whose = f" with {answer.label}" if answer.label else ""
        found.append((f"values between{whose}", shlex.join(["tussle", "batch", *words, *asked])))
    return found


def values_between(answer: ChoiceAnswer, over: Variable) -> list[str]:
    """Values that were not played, between the smallest that reaches the target and the one below, as a mission file has them."""
    if answer.gap is None:
        return []
    low, high = answer.gap
    is_whole = over.is_int if isinstance(over, Range) else all(isinstance(v, int) for v in over.values)
    n = min(MAX_BETWEEN, int(high - low) - 1) if is_whole else MAX_BETWEEN
    values = [low + (high - low) * (i + 1) / (n + 1) for i in range(n)]
    found = [math.floor(v + 0.5) if is_whole else float(f"{v:.4g}") for v in values]
    return [over.text(v) for v in dict.fromkeys(found) if low < v < high]


def without(words: Sequence[str], options: Collection[str], varied: Collection[str] = ()) -> list[str]:
    """The words of a command line without some options and their values, nor what varies or sets some names.

    Args:
        words: The words.
        options: Options with a value.
        varied: Names of which `--vary` and `--set` are left out, too.
    """
    kept: list[str] = []
    rest = list(words)
    while rest:
        word = rest.pop(0)
        name, equals, value = word.partition("=") if word.startswith("--") else (word, "", "")
        if word.startswith("-n") and not word.startswith("--") and "-n" in options:
            if word == "-n":
                del rest[:1]
        elif name in options:
            del rest[: 0 if equals else 1]
        elif name in ("--vary", "--set") and (equals or rest):
            text = value if equals else rest.pop(0)
            if text.partition("=")[0].strip() not in varied:
                kept += [name, text]
        else:
            kept.append(word)
    return kept
