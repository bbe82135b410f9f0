"""Aircraft of JSBSim in several processes: the same flights, errors, and processes that end."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output
from tussle.errors import ParameterError, PluginError, SnapshotError
from tussle.plugins.stock.motion.jsbsim_model.flight import JSBSimFlight
from tussle.plugins.stock.motion.jsbsim_model.processes import FleetProcess, n_cores
from tussle.stock import GroundCollision, JSBSimControl

pytest.importorskip("jsbsim")


class Hands(Autonomy):
    """Holds the stick still."""

    throttle, elevator, aileron, rudder = Output(), Output(), Output(), Output()

    def step(self, g):
        """Leave the commands at 0."""


def mission(processes, **values):
    """Balls that are born in the air one after another, and end on the ground."""
    motion = JSBSimControl(**{"aircraft": "ball", "processes": processes} | values)
    block = Block(
        name="a", count=12, position=(0.0, 0.0, 22.0), half_width=(90.0, 90.0, 20.0), placement="uniform", rate=3.0, slots=3,
        velocity=(9.0, 0.0, 0.0), motion=motion, autonomy=Hands(),
    )  # fmt: skip
    return Mission(
        blocks=[block], dt=1 / 30, motion_multiplier=4, end=4.0, end_conditions=("time",), interactions=[GroundCollision()],
    )  # fmt: skip


def fleet_of(sim):
    (fleet,) = sim.state.context.shared.values()
    return fleet


def hashes(sim):
    return [sim.state_hash(world) for world in range(sim.n_worlds)]


def test_flights_do_not_depend_on_the_number_of_processes():
    found = {}
    for processes in (1, 2):
        with Simulation(mission(processes), [1, 2]) as sim:
            sim.step(40)
            there, saved = hashes(sim), sim.snapshot()
            sim.step(40)
            later, n_born = hashes(sim), sim.state.births.n_born.sum()
            n_there = sim.state.population.bodies.n
            sim.restore(saved)
            assert hashes(sim) == there
            sim.step(40)
            assert hashes(sim) == later
            sim.reset([1], seeds=[5])
            sim.step(10)
            found[processes] = there, later, hashes(sim)
            if processes == 2:
                fleet = fleet_of(sim)
                workers = [each.process for each in fleet.processes]
                assert [each.poll() for each in workers] == [None, None]
                assert sorted(len(each) for each in parts(fleet)) == [
                    fleet_size(sim) // 2,
                    -(-fleet_size(sim) // 2),
                ]
        assert n_there < n_born  # some have reached the ground
    assert found[1] == found[2]
    assert all(each.poll() is not None for each in workers)


def parts(fleet):
    return [[k for k, process in fleet.process_of.items() if process is each] for each in fleet.processes]


def fleet_size(sim):
    return sim.state.population.bodies.n


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"aircraft": "c172q"}, r"JSBSimControl, a 1, world 0, step 0: .*did you mean 'c172"),
        ({"aircraft": "c172p", "trim": "full"}, r"JSBSimControl, a 1, world 0, step 0: .*cannot trim c172p"),
    ],
)  # fmt: skip
def test_errors_name_the_entity(values, said):
    with pytest.raises(PluginError, match=said):
        Simulation(mission(2, **values)).step()


def test_an_exception_of_jsbsim_ends_the_world_of_its_aircraft(monkeypatch):
    with Simulation(mission(1), [1, 2]) as sim:
        sim.step(5)
        fleet = fleet_of(sim)
        first = fleet.flights[0]

        def fly(self, values, n_steps, there=JSBSimFlight.fly):
            if self is first:
                raise RuntimeError("it broke")
            there(self, values, n_steps)

        monkeypatch.setattr(JSBSimFlight, "fly", fly)
        sim.step(5)
        broken, sound = sim.result()
        assert "a 1, world 0, step 5: JSBSim: RuntimeError: it broke" in str(broken.error)
        assert (sound.error, sim.steps[1]) == (None, 10)


@pytest.mark.slow
def test_aircraft_of_a_process_that_dies_fail_and_a_reset_starts_another():
    with Simulation(mission(2), [1, 2]) as sim:
        sim.step(40)
        before = hashes(sim)
        for each in fleet_of(sim).processes:
            each.process.kill()
            each.process.wait()
        with pytest.raises(SnapshotError, match="the process that flew it has ended"):
            sim.snapshot()
        with pytest.raises(
            PluginError, match=r"a \d+, world \d, step 40: the process that flew it has ended"
        ):
            sim.step()
        sim.reset([0, 1])
        sim.step(40)
        assert hashes(sim) == before


@pytest.mark.slow
def test_after_an_interrupted_step_no_answer_is_taken_for_another(monkeypatch):
    with Simulation(mission(2)) as sim:
        sim.step(20)
        saved, there = sim.snapshot(), hashes(sim)
        with monkeypatch.context() as patched:
            patched.setattr(FleetProcess, "receive", interrupt)
            with pytest.raises(KeyboardInterrupt):
                sim.step()
        assert not fleet_of(sim).processes
        sim.restore(saved)
        assert hashes(sim) == there
        sim.step(20)
        with Simulation(mission(1)) as other:
            other.step(40)
            assert hashes(other) == hashes(sim)


def interrupt(process):
    raise KeyboardInterrupt


@pytest.mark.slow
def test_processes_end_when_the_simulation_is_killed(tmp_path):
    script = tmp_path / "game.py"
    # Without `if __name__ == "__main__"`: the processes must not run the script again.
    script.write_text(
        """import os, signal
from test_processes import fleet_of, mission
from tussle import Simulation
sim = Simulation(mission(2))
sim.step(10)
print(len(fleet_of(sim).processes), flush=True)
os.kill(os.getpid(), getattr(signal, "SIGKILL", signal.SIGTERM))
"""
    )
    # The processes hold standard error: its end comes when the last of them has ended.
    path = f"import sys; sys.path[:0] = {[*sys.path, __file__.rpartition('test_processes')[0]]!r}"
    script.write_text(f"{path}\n{script.read_text()}")
    ended = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False)
    assert (ended.stdout, ended.stderr) == ("2\n", "")
    assert ended.returncode != 0


def test_a_number_of_processes_is_limited():
    with pytest.raises(ParameterError, match="processes = 300"):
        JSBSimControl(aircraft="ball", processes=300)
    with Simulation(mission(0)) as sim:
        sim.step(30)
        fleet = fleet_of(sim)
        assert (fleet.n if n_cores() > 1 else 1) == n_cores()
