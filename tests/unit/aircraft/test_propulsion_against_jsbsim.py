"""Engines, thrusters and tanks against JSBSim, open loop: both get the same air, motion and levers in every step."""

from __future__ import annotations

import math
import re
import types
from typing import Any

import numpy as np
import pytest

from tussle import numeric
from tussle.aircraft import air, runtime
from tussle.aircraft.code import Code, normal
from tussle.aircraft.files import Files
from tussle.aircraft.propulsion import RUNTIME, read_propulsion
from tussle.numeric.kernel import Device

jsbsim = pytest.importorskip("jsbsim")
DT = 1.0 / 120.0
FORCES = {
    **{f"forces/fb{axis}-prop-lbs": f"prop_f{axis}" for axis in "xyz"},
    **{f"moments/{letter}-prop-lbsft": f"prop_m{axis}" for letter, axis in zip("lmn", "xyz", strict=True)},
}
WRITTEN = re.compile(r"<output>\s*(propulsion/(?:engine|tank)[^<]*?)\s*</output>")
COMMANDS = ("propulsion/magneto_cmd", "propulsion/starter_cmd", "propulsion/cutoff_cmd")


def interpreted(found: Device, known: dict[int, Any]) -> Any:
    """A device and all that it calls as plain Python: nothing is compiled, so that the test is cheap."""
    if id(found) not in known:
        function = found.py_func
        names = {**function.__globals__}
        known[id(found)] = types.FunctionType(
            function.__code__, names, function.__name__, function.__defaults__
        )
        for name in function.__code__.co_names:
            if isinstance(names.get(name), Device):
                names[name] = interpreted(names[name], known)
    return known[id(found)]


def scope() -> dict[str, Any]:
    devices = {
        name: each
        for module in (runtime, air, numeric)
        for name, each in vars(module).items()
        if isinstance(each, Device)
    }
    known: dict[int, Any] = {}
    return {name: interpreted(each, known) for name, each in (devices | RUNTIME).items()} | {"math": math}


class Bench:
    """The generated code of an aircraft's propulsion, and the same aircraft in JSBSim."""

    def __init__(self, aircraft: str, altitude: float, knots: float) -> None:
        files = Files(None, aircraft)
        self.code = Code()
        texts = [path.read_text("utf-8", "replace") for path in sorted(files.folder.rglob("*.xml"))]
        self.written = {normal(name) for text in texts for name in WRITTEN.findall(text)}
        self.code.inputs |= self.written
        propulsion = read_propulsion(files.load().need("propulsion"), files.find)
        propulsion.emit(self.code)
        for name, local in FORCES.items():
            self.code.write(name, local)
            self.code.keep(name)
        self.code.keep("propulsion/total-fuel-lbs")
        self.code.begin("start")
        propulsion.emit_start(self.code)
        self.names = self.code.slots()
        self.values = {name: self.code.initial.get(name, 0.0) for name in self.names}
        self.functions = self.compile()
        self.fdm = jsbsim.FGFDMExec(jsbsim.get_default_root_dir())
        self.fdm.set_debug_level(0)
        assert self.fdm.load_model(aircraft)
        self.fdm.set_dt(DT)
        for name, value in {"ic/h-sl-ft": altitude, "ic/vc-kts": knots, "ic/psi-true-deg": 90.0}.items():
            self.fdm[name] = value
        assert self.fdm.run_ic()
        manager = self.fdm.get_property_manager().get_node()
        self.shared = [name for name in self.names if manager.get_node(name, False) is not None]
        touched = self.code.sections["step"].touched
        levers = {name for name in self.written if "contents" not in name}
        self.given = [
            name for name in self.shared if (name not in touched or name in levers) and name not in COMMANDS
        ]
        self.compared = [name for name in self.shared if name in touched and name not in self.given]
        self.compared = [
            name for name in self.compared if not name.endswith("/engtemp-c")
        ]  # JSBSim starts it from garbage
        self.worst = 0.0
        self.call("step", 0.0)

    def compile(self) -> dict[str, Any]:
        lines = []
        for name in self.code.sections:
            lines += [f"def {name}(values, tables, dt):"]
            lines += [f"    {self.code.variable(each)} = values[{each!r}]" for each in self.names]
            lines += self.code.body(name, 1)
            lines += [f"    values[{each!r}] = {self.code.variable(each)}" for each in self.names]
        space = scope()
        exec("\n".join(lines), space)
        return space

    def call(self, section: str, dt: float) -> None:
        self.values |= {name: self.fdm[name] for name in self.given}
        self.functions[section](self.values, [*map(float, self.code.tables)], dt)

    def start(self) -> None:
        self.fdm["propulsion/set-running"] = -1
        self.call("start", 0.0)

    def command(self, commands: dict[str, float]) -> None:
        for name, value in commands.items():
            self.fdm[name] = value
            if name in COMMANDS:
                self.values[name] = value

    def step(self) -> None:
        assert self.fdm.run()
        self.call("step", DT)
        for name in self.compared:
            ours, theirs = self.values[name], self.fdm[name]
            error = abs(ours - theirs) / max(abs(theirs), 1e-3)
            assert error <= 1e-9, f"{name} at {self.fdm.get_sim_time():.3f} s: {ours} instead of {theirs}"


def levers(t: float, n: int) -> dict[str, float]:
    """Commands of n engines at a time [s], none alike, with the throttles above 1 at times."""
    found = {"fcs/elevator-cmd-norm": -0.05 * math.sin(t), "fcs/aileron-cmd-norm": 0.1 * math.cos(t)}
    for k in range(n):
        at = f"[{k}]" if k else ""
        found[f"fcs/throttle-cmd-norm{at}"] = 0.8 + 0.4 * math.sin(4.0 * t + k)
        found[f"fcs/mixture-cmd-norm{at}"] = 0.8
        found[f"fcs/advance-cmd-norm{at}"] = 0.5 + 0.3 * math.sin(5.0 * t)
    return found


@pytest.mark.parametrize(
    ("aircraft", "altitude", "knots", "n"),
    [
        pytest.param("c172p", 3000.0, 100.0, 1, id="piston with a propeller of fixed pitch"),
        pytest.param("c182", 5000.0, 100.0, 1, id="governor"),
        pytest.param("Boeing314", 9000.0, 140.0, 4, id="superchargers"),
        pytest.param("737", 10000.0, 250.0, 2, id="turbines"),
        pytest.param("T38", 20000.0, 300.0, 2, id="augmentation by full throttle"),
        pytest.param("f22", 30000.0, 300.0, 2, id="augmentation by a throttle above 1"),
        pytest.param("pc7", 6000.0, 150.0, 1, id="turboprop"),
        pytest.param("F450", 100.0, 5.0, 4, id="brushless motors"),
        pytest.param("x24b", 30000.0, 250.0, 1, id="liquid rocket"),
        pytest.param("J246", 1000.0, 10.0, 4, id="solid rockets that swivel"),
    ],
)  # fmt: skip
def test_running_engines_equal_jsbsim(aircraft: str, altitude: float, knots: float, n: int) -> None:
    bench = Bench(aircraft, altitude, knots)
    bench.start()
    for k in range(150):
        bench.command(levers(k * DT, n))
        bench.step()
    assert len(bench.compared) >= 9
    assert any(abs(bench.values[name]) > 0.05 for name in FORCES)


def test_a_piston_engine_starts_by_its_starter() -> None:
    bench = Bench("c172p", 3000.0, 100.0)
    name = "propulsion/engine/set-running"
    bench.command({"fcs/throttle-cmd-norm": 0.3, "fcs/mixture-cmd-norm": 0.9})
    bench.command({"propulsion/magneto_cmd": 3.0, "propulsion/starter_cmd": 1.0})
    for _ in range(400):
        bench.step()
        if bench.values[name]:
            bench.command({"propulsion/starter_cmd": 0.0})
    assert bench.values[name] == bench.fdm[name] == 1.0
    assert bench.values["propulsion/engine/propeller-rpm"] > 600.0
    bench.command({"propulsion/magneto_cmd": 0.0})
    bench.step()
    assert bench.values[name] == bench.fdm[name] == 0.0


def test_a_turbine_spins_up_and_lights() -> None:
    bench = Bench("737", 5000.0, 250.0)
    bench.command({"propulsion/starter_cmd": 1.0, "propulsion/cutoff_cmd": 1.0})
    for k in range(3600):
        if k == 800:
            bench.command({"propulsion/cutoff_cmd": 0.0})
        bench.step()
    assert bench.values["propulsion/engine/set-running"] == 1.0
    assert bench.values["propulsion/engine/n2"] >= 60.0


def test_an_engine_without_fuel_stops() -> None:
    bench = Bench("c172p", 3000.0, 100.0)
    bench.start()
    for k in (0, 1):
        name = normal(f"propulsion/tank[{k}]/contents-lbs")
        bench.fdm[name] = bench.values[name] = 0.001
    for _ in range(60):
        bench.step()
    assert bench.values["propulsion/total-fuel-lbs"] == 0.0
    assert bench.values["propulsion/engine/fuel-flow-rate-pps"] == 0.0
    assert np.isfinite(list(bench.values.values())).all()
