"""What the reader of propulsion takes and what it refuses, by file and line."""

from __future__ import annotations

import math

import pytest

from tussle.aircraft.code import Code
from tussle.aircraft.node import AircraftError, Element, read_text
from tussle.aircraft.propulsion import Propulsion, read_propulsion
from tussle.aircraft.propulsion.thruster import Propeller

PLACE = "<location unit='IN'><x>1</x><y>2</y><z>3</z></location>"
DIRECT = f"<thruster><direct/>{PLACE}</thruster>"
PROPELLER = (
    "<propeller><diameter unit='FT'>6</diameter>"
    "<table name='C_THRUST'><tableData>0 0.1 1 0</tableData></table>"
    "<table name='C_POWER'><tableData>0 0.05 1 0</tableData></table></propeller>"
)
ROTATING = f"<thruster>{PROPELLER}{PLACE}</thruster>"
TANK = f"<tank type='FUEL'>{PLACE}<capacity unit='LBS'>9</capacity><contents unit='LBS'>8</contents></tank>"
THRUSTS = "".join(
    f"<function name='{name}'><value>1</value></function>" for name in ("IdleThrust", "MilThrust")
)


def read(body: str) -> Propulsion:
    def find(node: Element, name: str, kind: str) -> Element:
        raise node.error(f"no file {name} of kind {kind}")

    return read_propulsion(read_text(f"<propulsion>{body}</propulsion>".encode(), "own.xml"), find)


def engine(body: str, thruster: str = DIRECT, feed: str = "") -> str:
    return f"<engine>{body}{feed}{thruster}</engine>"


def test_what_it_reads() -> None:
    found = read(
        TANK + engine("<electric_engine><power unit='WATTS'>1000</power></electric_engine>", ROTATING)
    )
    propeller = found.engines[0].thruster
    assert isinstance(propeller, Propeller)
    assert propeller.mount.location == (1.0, 2.0, 3.0)
    assert (propeller.diameter, propeller.inertia, propeller.is_variable) == (6.0, 1e-6, False)
    assert (found.tanks[0].contents, found.tanks[0].property) == (8.0, "propulsion/tank/contents-lbs")


def test_a_tank_drains_from_its_drain_and_a_sphere_has_inertia() -> None:
    drain = (
        "<drain_location unit='IN'><x>11</x><y>2</y><z>3</z></drain_location><radius unit='IN'>12</radius>"
    )
    tank = read(TANK.replace("<capacity", f"{drain}<capacity")).tanks[0]
    assert [eval(each) for each in tank.place("4.5")] == [6.0, 2.0, 3.0]
    inertia = tank.inertia("32.174049")
    assert inertia is not None
    assert [eval(each) for each in inertia] == pytest.approx([0.4] * 3)


@pytest.mark.parametrize("kind", ["CYLINDRICAL", "ENDBURNING"])
def test_inertia_of_a_full_grain_is_that_of_its_cylinder(kind: str) -> None:
    grain = f"<grain_config type='{kind}'><length unit='IN'>120</length><bore_diameter unit='IN'>24</bore_diameter></grain_config>"
    tank = read(TANK.replace("<capacity", f"<radius unit='IN'>24</radius>{grain}<capacity")).tanks[0]
    inertia = tank.inertia("8.0")
    assert inertia is not None
    mass, squares = 8.0 / 32.174049, 2.0**2 + (1.0 if kind == "CYLINDRICAL" else 0.0)
    along, across = 0.5 * mass * squares, mass * (3.0 * squares + 10.0**2) / 12.0
    assert [eval(each) for each in inertia] == pytest.approx([along, across, across])


def test_tanks_of_a_lower_priority_drain_later() -> None:
    second = TANK.replace("<capacity", "<priority>2</priority><capacity")
    rocket = "<rocket_engine><isp>200</isp><slfuelflowmax>8</slfuelflowmax></rocket_engine>"
    found = read(TANK + second + engine(rocket, feed="<feed>0</feed><feed>1</feed>"))
    code = Code()
    found.emit(code)
    space: dict[str, float] = {code.variable(name): code.initial.get(name, 0.0) for name in code.slots()}
    tanks = [code.variable(tank.property) for tank in found.tanks]
    space |= {code.variable("fcs/throttle-pos-norm"): 1.0, "dt": 0.5}
    left = []
    for _ in range(4):
        exec("\n".join(code.body("step", 0)), {"math": math}, space)
        left.append([space[name] for name in tanks])
    assert left == [[4.0, 8.0], [0.0, 8.0], [0.0, 4.0], [0.0, 0.0]]


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("<tank type='WATER'/>", "type 'WATER' is not known"),
        (TANK.replace("<capacity", "<unusable-volume>1</unusable-volume><capacity"), "<unusable-volume> is not supported"),
        (TANK.replace("<capacity", "<grain_config type='STAR'/><capacity"), "type 'STAR' is not supported"),
        (TANK.replace("<capacity", "<grain_config type='ENDBURNING'/><capacity"), "has no volume"),
        (engine("<steam_engine/>"), "it needs a file, or one of: piston_engine"),
        (engine("<piston_engine/>"), "needs a propeller"),
        (engine("<electric_engine/>", f"<thruster>{PLACE}<rotor/></thruster>"), "this thruster is not supported"),
        (engine("<electric_engine/>", ROTATING.replace("<location", "<pointing/><location")), "<pointing> is not supported"),
        (engine("<electric_engine/>", ROTATING.replace("<location", "<p_factor>-1</p_factor><location")), "p_factor is negative"),
        (engine("<electric_engine/>", ROTATING.replace("C_POWER", "C_OTHER")), "it needs a table 'C_POWER'"),
        (engine("<turbine_engine/>"), "it needs a function 'IdleThrust'"),
        (engine(f"<turbine_engine>{THRUSTS}<augmethod>2</augmethod></turbine_engine>"), "it needs a function 'AugThrust'"),
        (engine(f"<turbine_engine>{THRUSTS}<maxn2>60</maxn2></turbine_engine>"), "must exceed idlen1"),
        (engine("<turboprop_engine/>", ROTATING), "it needs a table 'EnginePowerVC'"),
        (engine("<rocket_engine><isp>1</isp><propflowmax>1</propflowmax></rocket_engine>"), "<propflowmax> is not supported"),
        (engine("<piston_engine><stroke>0</stroke></piston_engine>", ROTATING), "<stroke> must be positive"),
        (engine("<piston_engine><numboostspeeds>4</numboostspeeds></piston_engine>", ROTATING), "numboostspeeds is 0 to 3"),
        (
            engine("<piston_engine><table name='MIXTURE'><tableData>0 x</tableData></table></piston_engine>", ROTATING),
            "could not convert",
        ),
        (
            engine("<piston_engine><table name='MIXTURE'><tableData>0 inf</tableData></table></piston_engine>", ROTATING),
            "a number is not finite",
        ),
        (
            engine(
                "<brushless_dc_motor><velocityconstant>0</velocityconstant><coilresistance>1</coilresistance>"
                "<noloadcurrent>1</noloadcurrent><maxvolts>1</maxvolts></brushless_dc_motor>",
                ROTATING,
            ),
            "must be positive",
        ),
        (engine("<electric_engine/>", ROTATING, "<feed>1</feed>"), "there is no tank 1"),
        (engine("<electric_engine/>").replace("<engine>", "<engine file='none'>"), "no file none of kind engine"),
    ],
)  # fmt: skip
def test_what_it_refuses(body: str, message: str) -> None:
    with pytest.raises(AircraftError, match=r"own\.xml:1: ") as caught:
        read(body)
    assert message in str(caught.value)


def test_a_function_of_an_unknown_type_is_refused() -> None:
    body = "<electric_engine><function name='f' type='template'><value>1</value></function></electric_engine>"
    with pytest.raises(AircraftError, match="type 'template' is not supported"):
        read(engine(body, ROTATING)).emit(Code())


def test_an_engine_of_an_unknown_kind_in_a_file_is_refused() -> None:
    text = f"<propulsion><engine file='steam'>{DIRECT}</engine></propulsion>"
    with pytest.raises(AircraftError, match="this engine is not supported"):
        read_propulsion(
            read_text(text.encode(), "own.xml"), lambda *_: Element("steam_engine", "steam.xml:1", {})
        )
