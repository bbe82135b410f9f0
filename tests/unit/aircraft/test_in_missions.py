"""Compiled aircraft in missions: one kernel with their controllers, in any number of threads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.plugins.stock.motion.jsbsim_compiled.plugin import ROWS_PER_THREAD
from tussle.stock import (
    AircraftPIDController,
    JSBSimCompiled,
    JSBSimModelControllerHeadingPID,
    Straight,
    examples,
)

HAWK = str(examples()["JSBSimModel"].with_name("hawk"))
CONTROL = {
    "surfaces": (AircraftPIDController(), {"aircraft": "hawk"}),
    "gusts": (AircraftPIDController(), {"aircraft": "hawk", "gusts": "dryden"}),
    "autopilot": (JSBSimModelControllerHeadingPID(), {"script_name": "patrol.xml", "commands": "autopilot"}),
}


def swarm(kind: str, n: int) -> Mission:
    controller, own = CONTROL[kind]
    block = Block(
        name="hawk", count=n, position=(0, 0, 1500), variance=(1e4, 1e4, 1e3), heading_variance=0.1, speed=23.0,
        autonomy=Straight(speed=24.0), controller=controller, motion=JSBSimCompiled(jsbsim_root=HAWK, **own),
    )  # fmt: skip
    return Mission(blocks=[block], dt=0.1, motion_multiplier=12, end=60.0)


def flown(mission: Mission, steps: int = 5, by_substep: bool = False, **options) -> Simulation:
    sim = Simulation(mission, seeds=3, on_error="raise", **options)
    if by_substep:
        sim.state.by_substep = True
        sim.state.population.on_new_group()
    sim.step(steps)
    return sim


def everything(sim: Simulation) -> bytes:
    (group,) = sim.state.population.groups
    return group.x.tobytes() + sim.state.population.bodies.floats.tobytes()


@pytest.mark.parametrize("kind", CONTROL)
def test_controllers_and_aircraft_are_one_kernel_with_the_bits_of_the_substeps(kind):
    one, many = flown(swarm(kind, 9)), flown(swarm(kind, 9), by_substep=True)
    control = [call.label for call in one.schedule if "substeps in one" in call.label]
    if kind != "autopilot":
        assert control == ["control, move hawk: AircraftPIDController, JSBSimCompiled, 12 substeps in one"]
    assert len(many.schedule) > len(one.schedule) or not control
    assert everything(one) == everything(many)
    assert np.ptp(one.read("hawk.pos")[0][0], axis=0).min() > 10.0


@pytest.mark.parametrize(("kind", "by_substep"), [("surfaces", False), ("surfaces", True), ("gusts", False)])
def test_threads_share_the_aircraft_and_do_not_change_a_bit(kind, by_substep, monkeypatch):
    n = 4 * ROWS_PER_THREAD + 7
    plain = everything(flown(swarm(kind, n), 3, by_substep))
    for threads in (2, 3):
        sim = Simulation(swarm(kind, n), seeds=3, threads=threads, on_error="raise")
        parts = []
        split = sim.state.context.split
        monkeypatch.setattr(
            sim.state.context,
            "split",
            lambda n, run, least=64, s=split, p=parts: s(n, _noted(run, p), least),
        )
        sim.state.by_substep = by_substep
        sim.state.population.on_new_group()
        sim.step(3)
        assert everything(sim) == plain
        assert any(first > 0 and last - first <= n // 2 for first, last in parts)


def _noted(run, parts):
    def noted(first, last):
        parts.append((first, last))
        run(first, last)

    return noted


def test_the_generated_source_can_be_read():
    path = JSBSimCompiled(jsbsim_root=HAWK, aircraft="hawk").source()
    assert "def step(x, tables, begin, end" in Path(path).read_text(encoding="utf-8")
