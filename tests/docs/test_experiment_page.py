"""The figures of docs/experiment.md, of its people without a browser; tests/browser/test_experiment.py has them at the page."""

import re

from experiment_people import MISSION, check_figures, games, play_without_page, text
from pages import ROOT


def test_the_mission_of_the_page_is_that_of_the_examples():
    shown = re.search(r"```xml\n(.*?)```", text(), re.DOTALL)[1]
    assert (ROOT / MISSION).read_text().endswith(shown)


def test_the_figures_are_those_of_people_who_take_their_time(tmp_path):
    commands = games()
    assert len(commands) == 6
    for command in commands:
        play_without_page(command, tmp_path)
    check_figures(tmp_path)
