"""The README shows what its first command really prints."""

import re

from pages import OUTPUT, ROOT
from rewrite import game

TEXT = (ROOT / "README.md").read_text()
MEASURED = re.compile(r"[\d.,]+")


def test_it_fits_two_screens():
    assert len(TEXT.splitlines()) < 120


def test_the_output_of_the_first_command_is_the_real_one():
    (_, shown), *others = OUTPUT.findall(TEXT)
    assert not others
    # Of the measured speed, and of the time in the directory's name, only the words can be the same.
    shown, real = (
        [MEASURED.sub("", s) if s.startswith((" speed", " run")) else s for s in text.splitlines()]
        for text in (shown, game())
    )
    assert shown == real, "if the change is meant: python tests/docs/rewrite.py"
