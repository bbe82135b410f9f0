"""The README shows what its first command really prints."""

import re

from pages import OUTPUT, ROOT
from rewrite import game

TEXT = (ROOT / "README.md").read_text()
NUMBER = re.compile(r"[\d.]+")


def test_it_fits_two_screens():
    assert len(TEXT.splitlines()) < 120


def test_the_output_of_the_first_command_is_the_real_one():
    (_, shown), *others = OUTPUT.findall(TEXT)
    assert not others
    shown, real = shown.splitlines(), game().splitlines()
    assert shown[:-1] == real[:-1], "if the change is meant: python tests/docs/rewrite.py"
    # The last line is a measurement: only its words can be the same.
    assert NUMBER.sub("", shown[-1]) == NUMBER.sub("", real[-1])
