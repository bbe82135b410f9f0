"""The people of docs/experiment.md, and what the page prints."""

import re
import shlex
import subprocess

from cli_process import COMMAND, environment
from pages import ROOT

from tussle import Recorder, Simulation
from tussle.messages import Waypoint
from tussle.mission import read_mission
from tussle.record import given_by

MISSION = "examples/experiment/buoys.xml"
BOATS = [1, 2, 3]
FIRST, LAST = 14.0, 27.0
"""Between these times the second orders are given [s]: the boats have come to the first place, and can still come to the next."""


def one_by_one(places):
    """Ada's way: each boat gets a third of the buoys, from west to east, and goes to their ends, from south to north.

    Args:
        places: Id -> place [m], of boats and buoys.

    Returns:
        For the first and the second time the orders: boat, for whom, and where to [m].
    """
    buoys = sorted((place for who, place in places.items() if who not in BOATS), key=lambda place: place[0])
    thirds = [sorted(buoys[4 * k : 4 * k + 4], key=lambda place: place[1]) for k in range(3)]
    boats = sorted(BOATS, key=lambda who: places[who][0])
    return [[(boat, "one", third[end]) for boat, third in zip(boats, thirds, strict=True)] for end in (0, -1)]


def all_together(places):
    """Ben's way: all boats go to the middle of the buoys in the east, then in the west; as `one_by_one`."""
    buoys = [place for who, place in places.items() if who not in BOATS]
    sides = [[b for b in buoys if b[0] > 0], [b for b in buoys if b[0] <= 0]]
    return [[(1, "block", [sum(each) / len(side) for each in zip(*side, strict=True)])] for side in sides]


WAYS = {"Ada": one_by_one, "Ben": all_together}
N_ORDERS = {"Ada": 6, "Ben": 2}


def text():
    """The page."""
    return (ROOT / "docs" / "experiment.md").read_text()


def games():
    """The commands of the page that play a game, in its order."""
    return re.findall(r"^(?:\$ )?(tussle view .+--record games/.+)$", text(), re.MULTILINE)


def printed(command):
    """What the page prints below a command."""
    return re.search(rf"```console\n\$ {re.escape(command)}\n(.*?)\n```", text(), re.DOTALL)[1]


def play_without_page(command, folder):
    """Record the game of a command, in which the person of it gives the orders in time, without a page."""
    loaded = read_mission(ROOT / MISSION)
    assert f"tussle view {MISSION} " in command
    seed, name, run = re.search(r'--seed (\d) --operator "(\w+)=team 1" --record (\S+)', command).groups()
    with (
        Simulation(loaded.mission, int(seed)) as game,
        Recorder(game, folder / run, mission_text=loaded.text),
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


def said(command, folder):
    """What a command prints in a folder."""
    done = subprocess.run(
        [*COMMAND, *shlex.split(command)[1:]],
        cwd=folder, env=environment(), check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    return done.stdout.strip("\n")


def check_figures(folder):
    """Check what is said of recorded games against what the page prints. The time of the last order is that of a person."""
    assert said("tussle analyze games", folder) == printed("tussle analyze games")
    last = re.compile(r"(?<=Ada \(operate team 1\)) ( +6 +3 +0 +)([\d.]+)$", re.MULTILINE)
    both = [said("tussle analyze games/ada-1", folder), printed("tussle analyze games/ada-1")]
    assert all(FIRST <= float(last.search(each)[2]) <= LAST for each in both)
    # The width of a table is that of its numbers.
    narrow = [re.sub(r"([ ─])\1+", r"\1", last.sub(r"\1", each)) for each in both]
    narrow = [re.sub(r"hash [0-9a-f]{32}\n", "hash\n", each) for each in narrow]  # depends on that time, too
    assert narrow[0] == narrow[1]
    assert "the same state hash" in said("tussle run --from games/ada-1 --no-log", folder)
