"""Gas cells and ballonets against JSBSim, open loop: both get the same air, attitude and centre of gravity in every step."""

from __future__ import annotations

import math
from typing import Any

import pytest

from tussle.aircraft.buoyancy import emit_buoyancy, read_buoyancy
from tussle.aircraft.code import Code
from tussle.aircraft.files import Files
from tussle.aircraft.node import AircraftError, read_text

jsbsim = pytest.importorskip("jsbsim")
DT = 1.0 / 120.0
ATTITUDE = "attitude/phi-rad", "attitude/theta-rad"
FORCES = {f"forces/fb{axis}-buoyancy-lbs": f"buoy_f{axis}" for axis in "xyz"}
MOMENTS = {
    f"moments/{letter}-buoyancy-lbsft": f"buoy_m{axis}" for letter, axis in zip("lmn", "xyz", strict=True)
}
PLACE = "<location unit='IN'><x>1</x><y>2</y><z>3</z></location>"
BALL = "".join(f"<{axis}_radius unit='FT'>2</{axis}_radius>" for axis in "xyz")


def flown(aircraft: str, steps: int) -> Any:
    """Yield JSBSim and the variables of the generated code after each step."""
    root = Files(None, aircraft).load()
    node = root.need("buoyant_forces")
    cells, code = read_buoyancy(node), Code()
    emit_buoyancy(code, node, cells)
    names = {name: code.variable(name) for name in code.slots()}
    body = compile("\n".join(code.body("step", 0)), "<buoyancy>", "exec")
    space: dict[str, Any] = {variable: code.initial.get(name, 0.0) for name, variable in names.items()}
    fdm = jsbsim.FGFDMExec(jsbsim.get_default_root_dir())
    fdm.set_debug_level(0)
    assert fdm.load_model(aircraft)
    fdm.set_dt(DT)
    touched = code.sections["step"].touched
    given = {
        name: variable
        for name, variable in names.items()
        if name not in touched and not name.startswith("state/")
    }

    def step(dt: float) -> None:
        roll, pitch = (fdm[name] for name in ATTITUDE)
        space.update({variable: fdm[name] for name, variable in given.items()})
        space.update({f"cg_{axis}": fdm[f"inertia/cg-{axis}-in"] for axis in "xyz"})
        space.update(
            gx=fdm["accelerations/gravity-ft_sec2"], gy=0.0, gz=0.0, dt=dt, math=math, power=math.pow
        )
        space.update(
            l13=-math.sin(pitch), l23=math.sin(roll) * math.cos(pitch), l33=math.cos(roll) * math.cos(pitch)
        )
        exec(body, space)

    fdm["ic/h-sl-ft"] = 3000.0
    fdm["ic/phi-deg"] = 5.0
    fdm["ic/theta-deg"] = 7.0
    assert fdm.run_ic()
    step(0.0)  # JSBSim too runs its models twice before the first step
    step(0.0)
    for k in range(steps):
        if k == steps // 2:
            fdm["buoyant_forces/gas-cell/valve_open"] = 1.0
        assert fdm.run()
        # an airship's own controls set the valves too
        space.update(
            {variable: fdm[name] for name, variable in names.items() if name.endswith("/valve_open")}
        )
        step(DT)
        yield (
            fdm,
            {name: space[variable] for name, variable in names.items()}
            | {name: space[local] for name, local in (FORCES | MOMENTS).items()},
        )


@pytest.mark.parametrize("aircraft", ["weather-balloon", "Submarine_Scout"])
def test_gas_equals_jsbsim(aircraft: str) -> None:
    lifts, compared = [], 0
    for fdm, ours in flown(aircraft, 100):
        lifts.append(ours["buoyant_forces/gas-cell/buoyancy-lbs"])
        for name in ours:
            if (
                name.startswith(("forces/", "moments/", "buoyant_forces/"))
                and "/dU_" not in name
                and "in-flow" not in name
            ):
                assert ours[name] == pytest.approx(fdm[name], rel=1e-9, abs=1e-6), name
                compared += 1
    assert compared >= 1100
    assert min(lifts) < 0.999 * max(lifts)


@pytest.mark.parametrize(
    ("cell", "message"),
    [
        (f"<gas_cell type='METHANE'>{PLACE}{BALL}</gas_cell>", "type 'METHANE' is not known"),
        (f"<gas_cell type='HELIUM'>{PLACE}</gas_cell>", "its shape is not supported"),
    ],
)
def test_what_it_refuses(cell: str, message: str) -> None:
    with pytest.raises(AircraftError, match=r"own\.xml:1: ") as caught:
        read_buoyancy(read_text(f"<buoyant_forces>{cell}</buoyant_forces>".encode(), "own.xml"))
    assert message in str(caught.value)
