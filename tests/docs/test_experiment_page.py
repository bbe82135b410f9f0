"""The figures of docs/experiment.md, of its people without a browser; tests/browser/test_experiment.py has them at the page."""

import re

from experiment_people import LAST, MISSION, WAYS, check_figures, games, text
from pages import ROOT

from tussle import Recorder, Simulation
from tussle.messages import Waypoint
from tussle.mission import read_mission
from tussle.record import given_by


def test_the_mission_of_the_page_is_that_of_the_examples():
    shown = re.search(r"```xml\n(.*?)```", text(), re.DOTALL)[1]
    assert (ROOT / MISSION).read_text().endswith(shown)


def test_the_figures_are_those_of_people_who_take_their_time(tmp_path):
    loaded = read_mission(ROOT / MISSION)
    commands = games()
    assert len(commands) == 6
    for command in commands:
        assert f"tussle view {MISSION} " in command
        seed, name, folder = re.search(
            r'--seed (\d) --operator "(\w+)=team 1" --record (\S+)', command
        ).groups()
        with (
            Simulation(loaded.mission, int(seed)) as game,
            Recorder(game, tmp_path / folder, mission_text=loaded.text),
            given_by(f"{name} (operate team 1)"),
        ):
            bodies = game.state.population.bodies
            places = dict(zip(bodies.id.tolist(), bodies.pos.T.tolist(), strict=True))
            for t, orders in zip((0.0, LAST - 0.5), WAYS[name](places), strict=True):
                game.run(until=t)
                for boat, whom, place in orders:
                    receivers = [boat] if whom == "one" else [1, 2, 3]
                    pos = [round(value, 1) for value in place]
                    game.publish(Waypoint, network="LocalNetwork", receivers=receivers, pos=pos)
            game.run()
    check_figures(tmp_path)
