"""Pages of Markdown and the Python in them."""

from __future__ import annotations

import contextlib
import io
import itertools
import re
import sys
import types
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]
OUTPUT = re.compile(r"^(<!-- output -->\n```text\n)(.+?)^```$", re.MULTILINE | re.DOTALL)
"""In the README: what the first command prints."""
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Example:
    """A block of Python in a page, and the output that the page shows under it.

    Attributes:
        line: Number of its first line in the page.
        code: The block.
        output: The block fenced as text that follows, None where there is none.
    """

    line: int
    code: str
    output: str | None


def examples(page: Path) -> list[Example]:
    """The blocks of Python of a page, in order."""
    text = page.read_text()
    fences = list(FENCE.finditer(text))
    found = []
    for fence, after in itertools.zip_longest(fences, fences[1:]):
        if fence[1] == "python":
            shows = after is not None and after[1] == "text" and not text[fence.end() : after.start()].strip()
            line = text[: fence.start(2)].count("\n") + 1
            found.append(Example(line, fence[2], after[2] if shows and after else None))
    return found


def namespace(page: Path) -> types.ModuleType:
    """A module in which a page's blocks run; registered, so that errors and pickles find it."""
    module = types.ModuleType(f"page_{page.stem.replace('-', '_').lower()}")
    module.__file__ = str(page)
    sys.modules[module.__name__] = module
    return module


def printed_by(example: Example, page: Path, module: types.ModuleType) -> tuple[str, Exception | None]:
    """What a block prints, with the error that it ends with as the last line, and that error.

    Line numbers are those of the page.
    """
    code = compile("\n" * (example.line - 1) + example.code, str(page), "exec", dont_inherit=True)
    printed, raised = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        try:
            exec(code, module.__dict__)
        except Exception as error:  # noqa: BLE001 - a page may show any
            raised = error
            print(f"{type(error).__name__}: {error}")
    return as_in_a_file(printed.getvalue(), page), raised


def run(example: Example, page: Path, module: types.ModuleType) -> str:
    """What a block prints.

    Raises:
        Exception: That of the block, unless the page shows it.
    """
    printed, raised = printed_by(example, page, module)
    if raised is not None and printed != example.output:
        raise raised
    return printed


def as_in_a_file(printed: str, page: Path) -> str:
    """What a reader sees who has put a block into a file of its own: places in the page become lines of the block."""

    def place(match: re.Match[str]) -> str:
        line = int(match[1])
        begin = max(example.line for example in examples(page) if example.line <= line)
        return f"your_file.py:{line - begin + 1}"

    return re.sub(rf"{re.escape(page.name)}:(\d+)", place, printed)
