"""The reference is complete and up to date."""

import inspect

import pytest
from plugin_pages import FOLDER, plugin_pages
from reference import PAGE, PARTS, public, reference

from tussle.stock import manifest


def test_the_page_is_what_the_code_says_now():
    assert PAGE.read_text() == reference(), "python tests/docs/rewrite.py"


def test_the_pages_of_the_plugins_are_what_the_code_says_now():
    pages = plugin_pages()
    assert {page: page.read_text() for page in FOLDER.iterdir()} == pages, "python tests/docs/rewrite.py"
    assert {page.stem for page in pages} == {"index", *manifest()}


@pytest.mark.parametrize("module", PARTS)
def test_every_public_name_has_a_docstring_and_stands_there(module):
    text = PAGE.read_text()
    for name, value in public(module).items():
        is_plugin = module == "tussle.stock" and (FOLDER / f"{name}.md").exists()
        assert is_plugin or f"### {name}\n" in text or f"**{name}**" in text, name
        if inspect.isclass(value) or inspect.isfunction(value):
            assert (value.__doc__ or "").strip(), name


def test_what_was_hard_to_find_is_there():
    text = PAGE.read_text()
    for words in ("- `rows_at(", "### EntityCaptured", "### Handle", "motion_multiplier: ", "first_birth: "):
        assert words in text, words
    page = (FOLDER / "MultirotorControllerPID.md").read_text()
    for words in (
        "`yaw_pid`: Param `kp ki kd band` = kp 0.2 1/s",
        "service `airframe`",
        "Raises:",
        "Output `motor_0",
    ):
        assert words in page, words
    assert "- The defended boundary." in (FOLDER / "BoundaryDefense.md").read_text()
