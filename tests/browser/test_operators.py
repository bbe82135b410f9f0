"""Three people who operate a game in browsers, one of whom loses the connection; the game is killed, and played again with all they did."""

import re
import subprocess
import time
from itertools import takewhile

import numpy as np
import pytest
from cli_process import COMMAND, environment

from tussle import Simulation, load_run
from tussle.mission import read_mission
from tussle.record import load_inputs
from tussle.view import Live

SEED = 5
TEAM = """  <entity>
    <name>{name}</name> <team_id>{team}</team_id> <count>4</count> <y>{y}</y> <variance_x>400</variance_x> <variance_y>400</variance_y>
    <autonomy speed="8.0">GoTo</autonomy> <motion_model max_speed="20.0">SingleIntegrator</motion_model>
  </entity>
"""
GAME = f"""<runscript name="operated">
  <run dt="0.05" end="3600"/> <end_condition>time</end_condition> <entity_interaction>SimpleCollision</entity_interaction>
{TEAM.format(name="red", team=1, y=-100)}{TEAM.format(name="blue", team=2, y=100)}
</runscript>
"""
OPERATE = """([ids, others, n, seed]) => new Promise((done) => {
  const socket = new WebSocket(location.href.replace('http', 'ws'));
  let state = seed;
  const random = (most) => { state = (1103515245 * state + 12345) % 2147483648; return Math.floor(state / 65536) % most; };
  const order = (k) => {
    const who = ids[random(ids.length)];
    const kind = random(others ? 6 : 4);
    if (kind === 0) return { do: 'set', entities: [who], path: 'GoTo.speed', value: 1 + random(12) };
    if (kind === 1) return { do: 'drive', entities: [who], sticks: [random(9) / 4 - 1, random(9) / 4 - 1, random(9) / 4 - 1] };
    if (kind === 2) return { do: 'drive', entities: [who], sticks: null };
    if (kind === 4) return { do: 'spawn', block: k % 2 ? 'red' : 'blue', pos: [200 + 20 * k, 0, 10] };
    if (kind === 5) return { do: 'remove', entities: [9 + random(12)] };
    return { do: 'order', receivers: [who], network: 'LocalNetwork', topic: 'Waypoint', values: { pos: [random(300), random(300), 10] } };
  };
  socket.onopen = () => {
    let k = 0;
    const timer = setInterval(() => {
      socket.send(JSON.stringify(order(k)));
      if (++k >= n) { clearInterval(timer); setTimeout(() => done(k), 300); }
    }, 15);
  };
  socket.onclose = () => done(-1);
})"""


def operated(chromium, folder):
    """Play a game with 360 orders of three people, and kill it; returns the directory of its recording."""
    (folder / "game.xml").write_text(GAME)
    process = subprocess.Popen(
        [*COMMAND, "view", "game.xml", "--roles", "--seed", str(SEED), "--record", "run", "--pace", "3", "--no-browser"],
        cwd=folder, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    try:
        # Lines about kernels that are compiled may come first.
        lines = list(takewhile(lambda line: not line.startswith(" watch: "), process.stdout))
        urls = [found[0] for line in lines if (found := re.search(r"http://\S+", line))]
        assert len(urls) == 3, lines
        tabs = [chromium.new_page(viewport={"width": 300, "height": 200}) for _ in range(3)]
        for tab, url in zip(tabs, urls, strict=False):
            tab.goto(url)
        reds, blues = [1, 2, 3, 4], [5, 6, 7, 8]
        assert tabs[0].evaluate(OPERATE, [reds + blues, True, 60, 1]) == 60
        assert tabs[1].evaluate(OPERATE, [reds, False, 120, 2]) == 120
        tabs[2].evaluate(f"(given) => {{ void ({OPERATE})(given); }}", [blues, False, 500, 3])
        tabs[2].wait_for_timeout(500)
        tabs[2].close()  # in the midst, perhaps at the sticks
        again = chromium.new_page(viewport={"width": 300, "height": 200})
        again.goto(urls[2])
        assert again.evaluate(OPERATE, [blues, False, 120, 4]) == 120
        assert tabs[0].evaluate(OPERATE, [reds + blues, True, 60, 5]) == 60
        time.sleep(2.5)  # so that all has been written
        process.kill()
        for tab in (tabs[0], tabs[1], again):
            tab.close()
    finally:
        process.kill()
        process.communicate(timeout=60)
    return folder / "run"


@pytest.mark.slow
def test_a_game_of_three_operators_that_is_killed_is_played_again_bit_for_bit(chromium, tmp_path):
    path = operated(chromium, tmp_path)
    run, inputs = load_run(path), load_inputs(path)
    assert not run.is_complete
    assert {each.by for each in inputs} == {"direct", "operate team 1", "operate team 2"}
    kinds = {each.name for each in inputs}
    assert {"Waypoint", "ManualControl", "SpawnEntity", "RemoveEntity"} <= kinds
    assert {"red.GoTo.speed", "blue.GoTo.speed"} <= kinds
    assert len(inputs) >= 200, (
        "some orders change nothing, such as that an entity is given back which nobody drives"
    )
    states = run.trajectory
    last = int(states["step"].max())
    rows = states[states["step"] == last].sort_values("id")
    mission = read_mission(path / "mission.xml").mission
    hashes = set()
    for seeds in ([SEED],) * 10 + ([9, SEED, 4],):
        world = seeds.index(SEED)
        with Simulation(mission, seeds) as again:
            again.play_inputs(inputs, world)
            again.step(last)
            hashes.add(again.state_hash(world))
            bodies = again.state.population.bodies
            mine = bodies.world == world
            order = np.argsort(bodies.id[mine])
            assert bodies.id[mine][order].tolist() == rows["id"].tolist()
            for axis, name in enumerate("xyz"):
                assert (bodies.pos[axis, mine][order] == rows[name].to_numpy()).all()
    with (
        Simulation(mission, SEED) as resumed,
        Live(resumed, threaded=False, is_paused=True, inputs=inputs) as live,
    ):
        live.step(last)
        live.seek(1.0)
        live.step(last - live.step_number)
        hashes.add(resumed.state_hash())
    assert len(hashes) == 1
