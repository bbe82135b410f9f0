"""The programs of MOOS-IvP, where they are installed: its database, and its helm with behaviours that look at contacts."""

from __future__ import annotations

import subprocess
import threading
from contextlib import ExitStack, contextmanager

import needs
import numpy as np
import pytest
from moos_database import MoosDatabase
from test_moos import boat, played

from tussle import Block, Simulation
from tussle.stock import Still

WARP = 10
MISSION = f"""ServerHost = 127.0.0.1
ServerPort = PORT
Community = alpha
MOOSTimeWarp = {WARP}
LatOrigin = 43.8
LongOrigin = -70.3
ProcessConfig = pHelmIvP
{{
  AppTick = 4
  CommsTick = 4
  behaviors = alpha.bhv
  domain = course:0:359:360
  domain = speed:0:3:31
}}
"""
TRANSIT = "Waypoint speed=2 capture_radius=5 slip_radius=15 points=100,0"
KEEP_CLEAR = (
    "AvoidCollision pwt=500 contact=2 pwt_outer_dist=40 pwt_inner_dist=15 completed_dist=80 "
    "min_util_cpa_dist=12 max_util_cpa_dist=25"
)
CHASE = "CutRange contact=2 giveup_range=1000 pwt_outer_dist=20 pwt_inner_dist=5"
SHIP = np.array([50.0, 0.5])


@pytest.fixture(scope="module", autouse=True)
def _installed():
    needs.require("moos")


@contextmanager
def program(name, folder):
    """MOOSDB or pHelmIvP, which ends with the block."""
    with (
        (folder / f"{name}.log").open("w") as log,
        subprocess.Popen([name, "alpha.moos"], cwd=folder, stdout=log, stderr=log) as process,
    ):
        try:
            yield process
        finally:
            process.kill()


@pytest.fixture
def community(tmp_path):
    """A function that writes the files of a community with some behaviours, each a name and its parameters; returns its port."""

    def write(*behaviours):
        with MoosDatabase() as free:
            port = free.port
        (tmp_path / "alpha.moos").write_text(MISSION.replace("PORT", str(port)))
        text = "initialize DEPLOY = true\n"
        for name, *values in map(str.split, behaviours):
            lines = [f"name = {name}", "pwt = 100", "condition = DEPLOY = true", *values]
            text += f"Behavior = BHV_{name}\n{{\n" + "\n".join(lines) + "\n}\n"
        (tmp_path / "alpha.bhv").write_text(text)
        return port

    return write


def test_a_real_database_gives_the_bits_of_the_tests_own(community, tmp_path):
    hashes = []
    with MoosDatabase() as database:
        hashes.append(played(database)[0][0].state_hash)
    database.port = community(TRANSIT)
    with program("MOOSDB", tmp_path):
        hashes += [played(database)[0][0].state_hash for _ in range(2)]
    assert len(set(hashes)) == 1


@pytest.mark.parametrize(
    ("behaviours", "nearest", "end"),
    [
        ([TRANSIT], (0.0, 8.0), (92.0, 102.0)),
        ([TRANSIT, KEEP_CLEAR], (10.0, 40.0), (92.0, 102.0)),
        ([CHASE], (0.0, 8.0), (40.0, 60.0)),
        ([CHASE.replace("giveup_range=1000", "")], (49.0, 51.0), (-1.0, 1.0)),
        ([CHASE.replace("pwt_outer_dist=20", "")], (49.0, 51.0), (-1.0, 1.0)),
    ],
    ids=["alone", "keeps clear", "chases", "never chases", "no outer distance"],
)
def test_behaviours_of_contacts_see_the_other_vehicle(community, tmp_path, behaviours, nearest, end):
    """The other lies on the way to the point. Ranges of the least distance to it, and of how far the boat comes [m]."""
    port = community(*behaviours)
    ship = Block(name="ship", team=2, position=(*SHIP, 0.0), motion=Still())
    mission = boat(port, lockstep=False, end=70.0, blocks=[ship], moos_time_warp=float(WARP))
    with program("MOOSDB", tmp_path), program("pHelmIvP", tmp_path), Simulation(mission) as sim:
        path = []
        while not sim.is_over:
            sim.step()
            path.append(sim.read("boat.pos")[0][0, 0, :2])
    gaps = np.hypot(*(np.array(path) - SHIP).T)
    assert nearest[0] <= gaps.min() <= nearest[1]
    assert end[0] <= path[-1][0] <= end[1]


@pytest.mark.parametrize("on_loss", ["wait", "go_on"])
def test_a_boat_comes_back_to_a_database_that_was_killed(community, tmp_path, on_loss):
    """With a new helm: MOOS's own client does not try again when its MOOSDB dies during its handshake."""
    port = community(TRANSIT)
    mission = boat(port, lockstep=False, end=1e4, on_loss=on_loss, moos_time_warp=float(WARP))
    with ExitStack() as stack:
        start = lambda name: stack.enter_context(program(name, tmp_path))  # noqa: E731
        database, helm = start("MOOSDB"), start("pHelmIvP")
        sim = stack.enter_context(Simulation(mission))
        sim.step(100)
        for each in (database, helm):
            each.kill()
            each.wait()
        again = threading.Timer(0.5, lambda: [start(name) for name in ("MOOSDB", "pHelmIvP")])
        again.start()
        sim.step(100)
        again.join()
        while not sim.read("boat.MOOSAutonomy.losses")[0][0, 0]:
            sim.step()
        sim.step(500)  # to the point, where the helm stops it
        assert sim.read("boat.MOOSAutonomy.desired_speed")[0][0, 0] == 0.0
        assert np.hypot(*(sim.read("boat.pos")[0][0, 0, :2] - (100.0, 0.0))) < 12.0
        assert sim.read("boat.MOOSAutonomy.losses")[0].tolist() == [[1]]
