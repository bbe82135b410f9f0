"""The reference is complete and up to date."""

import inspect

import pytest
from reference import PAGE, PARTS, public, reference

from tussle.stock import manifest


def test_the_page_is_what_the_code_says_now():
    assert PAGE.read_text() == reference(), "python tests/docs/rewrite.py"


@pytest.mark.parametrize("module", PARTS)
def test_every_public_name_has_a_docstring_and_stands_there(module):
    text = PAGE.read_text()
    for name, value in public(module).items():
        assert f"### {name}\n" in text or f"**{name}**" in text, name
        if inspect.isclass(value) or inspect.isfunction(value):
            assert (value.__doc__ or "").strip(), name


def test_what_was_hard_to_find_is_there():
    text = PAGE.read_text()
    for words in (
        "- `rows_at(", "### GlobalNetwork", "### SphereNetwork", "### EntityCaptured", "### Handle", "motion_multiplier: ",
        "first_birth: ", "- `capture_range`: Param = 5 m",
    ):  # fmt: skip
        assert words in text, words
    assert all(f"### {name}\n" in text for name in manifest())
