"""Mechanisms that exist once: text that runs as code, and sleeping until the wall clock has caught up."""

from __future__ import annotations

import ast
import re

import pytest
from tree import parsed, python_files, relative

ONCE = {
    ("exec",): {"src/tussle/numeric/source.py"},
    # Besides the pace: who waits for another program, or for a user at a terminal.
    ("time.sleep", "sleep"): {
        "src/tussle/batch/dask_runner.py",
        "src/tussle/cli/serve.py",
        "src/tussle/cli/view.py",
        "src/tussle/engine/schedule.py",
        "src/tussle/pacing.py",
    },
}
"""Names of a function -> the modules that call it."""


def calls(tree: ast.AST, names: tuple[str, ...]) -> bool:
    """Whether a module calls a function by one of its names."""
    last = {name.rpartition(".")[2] for name in names}
    called = (node.func for node in ast.walk(tree) if isinstance(node, ast.Call))
    named = (
        f for f in called if getattr(f, "attr", getattr(f, "id", "")) in last
    )  # to write all as text takes seconds
    return any(ast.unparse(function) in names for function in named)


@pytest.mark.parametrize("names", ONCE, ids=lambda names: names[0])
def test_it_is_called_where_it_belongs(names):
    found = {relative(path) for path in python_files("src") if calls(parsed(path), names)}
    assert found == ONCE[names]


WRITES = re.compile(r"""write_text|write_bytes|savefig|save_model|torch\.save|open\(['"][wx]""")
IN_DIRECTORIES = {
    "src/tussle/batch/report/__init__.py",  # opens all parts of a report before it writes one
    "src/tussle/batch/report/drawing.py",  # into memory
    "src/tussle/batch/store.py",  # a draft of a folder
    "src/tussle/record/parquet_blocks.py",  # until a run or batch is closed, its directory does not pass for a whole one
    "src/tussle/record/recorder.py",
    "src/tussle/record/traffic.py",
}
"""Modules whose files become whole in another way."""


def test_files_of_the_user_are_written_whole():
    """A program that is killed leaves the old file or the new one: it writes to a draft, `tussle.folders.whole_file`."""
    found = {
        f"{relative(path)}: {line.strip()}"
        for path in python_files("src")
        if relative(path) not in IN_DIRECTORIES
        for line in path.read_text(encoding="utf-8").splitlines()
        if WRITES.search(line) and not re.search(r"part\b|draft|whole_file|^\s*(?:from|import|def) ", line)
    }
    assert not found


def test_whether_a_text_is_a_number_is_asked_once():
    """Of digits such as ², which `int` does not read, `str.isdigit` is true."""
    found = {
        relative(path)
        for path in python_files("src")
        if re.search(r"\.is(digit|decimal|numeric)\b", path.read_text(encoding="utf-8"))
    }
    assert found == {"src/tussle/documents.py"}, "take tussle.documents.is_count"


def test_links_are_followed_by_one_function():
    """Of links that lead to each other, `Path.resolve` raises an error that nobody awaits, before Python 3.13."""
    found = [
        relative(path) for path in python_files("src") if ".resolve()" in path.read_text(encoding="utf-8")
    ]
    assert not found, "take tussle.folders.real_path"


def test_the_rule_sees_calls():
    assert calls(ast.parse("def f():\n    exec(text, {})"), ("exec",))
    assert not calls(ast.parse("executor.submit(exec_all)"), ("exec",))


def test_limits_have_one_prefix():
    """MAX_... and MIN_..., so that a reader finds all limits by one search; CODING.md."""
    wrong = re.compile(r"\b(?:MOST|LEAST|LARGEST|LONGEST|SHORTEST|FEWEST|FARTHEST|NAP|CATCH)_?[A-Z]*\b")
    found = {
        f"{relative(path)}: {node.id}"
        for path in python_files("src")
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and wrong.fullmatch(node.id)
    }
    assert not found
