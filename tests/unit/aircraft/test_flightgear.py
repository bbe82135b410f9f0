"""What a FlightGear receives of compiled aircraft: the packets that JSBSim sends of the same flight."""

from __future__ import annotations

import socket
import struct
from contextlib import contextmanager

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.aircraft.compile import compile_aircraft
from tussle.aircraft.initial import place, run_initial
from tussle.errors import ParameterError
from tussle.plugins.stock.motion.jsbsim_compiled.flightgear import PROPERTIES, TIME, packets, send
from tussle.stock import AircraftPIDController, JSBSimCompiled, Straight

DT = 1.0 / 120.0
FIELDS = (
    "version padding longitude latitude altitude agl phi theta psi alpha beta phidot thetadot psidot vcas climb v_north v_east v_down "
    "u v w ax ay az stall slip engines state0 state1 state2 state3 rpm0 rpm1 rpm2 rpm3 flow0 flow1 flow2 flow3 px0 px1 px2 px3 "
    "egt0 egt1 egt2 egt3 cht0 cht1 cht2 cht3 map0 map1 map2 map3 tit0 tit1 tit2 tit3 oil0 oil1 oil2 oil3 oilpx0 oilpx1 oilpx2 oilpx3 "
    "tanks fuel0 fuel1 fuel2 fuel3 wheels wow0 wow1 wow2 down0 down1 down2 steer0 steer1 steer2 pressed0 pressed1 pressed2 "
    "time warp visibility elevator trim left_flap right_flap left_aileron right_aileron rudder nose brake spoilers"
)
ALL = FIELDS.split()
FORMAT = ">2I3d22fI4I36fI4fI3I9fIif10f"
UNKNOWN = ("egt0", "cht0", "oil0", "oilpx0", "steer0")
"""Temperatures of engines and angles of wheels, which are not computed."""


def decoded(data: bytes) -> dict[str, float]:
    """Field -> value of a packet."""
    assert len(data) == struct.calcsize(FORMAT) == 408
    return dict(zip(ALL, struct.unpack(FORMAT, data), strict=True))


@contextmanager
def viewer():
    """A socket on loopback, and its port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(60.0)
        yield receiver, receiver.getsockname()[1]


def received(receiver: socket.socket) -> list[dict[str, float]]:
    """All packets that have arrived."""
    receiver.setblocking(False)
    found = []
    try:
        while True:
            found.append(decoded(receiver.recv(4096)))
    except BlockingIOError:
        return found


def controls(t):
    return {"fcs/throttle-cmd-norm": 0.8, "fcs/mixture-cmd-norm": 0.9, "fcs/elevator-cmd-norm": -0.1, "fcs/aileron-cmd-norm": 0.1 * t,
            "fcs/rudder-cmd-norm": 0.05, "fcs/flap-cmd-norm": 0.3, "fcs/pitch-trim-cmd-norm": 0.02}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("height", "speed"), [(5000.0, 180.0), (4.6, 0.0)])
def test_packets_are_those_of_jsbsim(tmp_path, height, speed):
    jsbsim = pytest.importorskip("jsbsim")
    fdm = jsbsim.FGFDMExec(jsbsim.get_default_root_dir())
    fdm.set_debug_level(0)
    fdm.set_dt(DT)
    fdm.load_model("c172p")
    with viewer() as (receiver, port):
        file = tmp_path / "out.xml"
        file.write_text(
            f'<output name="127.0.0.1" type="FLIGHTGEAR" port="{port}" protocol="udp" rate="120"/>'
        )
        assert fdm.set_output_directive(str(file))
        start = {"lat-geod-deg": 33.0, "long-gc-deg": -84.0, "psi-true-deg": 30.0}
        for name, value in {**start, "h-agl-ft": height, "vt-fps": speed}.items():
            fdm[f"ic/{name}"] = value
        fdm.run_ic()
        aircraft = compile_aircraft(None, "c172p", (), PROPERTIES)
        x = aircraft.first[:, None].copy()
        angles = [
            np.array([fdm[f"position/{name}"]]) for name in ("lat-geod-rad", "long-gc-rad", "geod-alt-ft")
        ]
        place(x, *angles, *(np.array([[fdm[key]] for key in keys]) for keys in (
            ("attitude/phi-rad", "attitude/theta-rad", "attitude/psi-rad"),
            ("velocities/v-north-fps", "velocities/v-east-fps", "velocities/v-down-fps"),
            ("velocities/p-rad_sec", "velocities/q-rad_sec", "velocities/r-rad_sec"),
        )))  # fmt: skip
        run_initial(aircraft, x, DT)
        fdm["propulsion/set-running"] = -1
        aircraft.start(x, aircraft.tables, 0, 1, 1, 0.0, DT)
        for step in range(120):
            for key, value in controls(step * DT).items():
                fdm[key] = x[aircraft.slot(key)] = value
            fdm.run()
            aircraft.advance(x, aircraft.tables, 0, 1, 1, DT, DT)
        theirs = received(receiver)[-1]
    ours = decoded(packets(x, aircraft.slots, aircraft.n_engines).tobytes())
    assert ours["engines"] == ours["down2"] == 1
    assert ours["rpm0"] > 500.0
    assert ours["wow1"] == (height < 100.0)
    for name in ALL:
        if name not in UNKNOWN:
            share = 1e-3 if name == "rpm0" else 1e-4  # there, that of a step before
            assert ours[name] == pytest.approx(theirs[name], rel=share, abs=1e-4), name


def cessna(port: int) -> JSBSimCompiled:
    return JSBSimCompiled(
        aircraft="c172p",
        flightgear_output_enable=True,
        flightgear_ip="127.0.0.1",
        flightgear_port=port,
    )


@pytest.mark.slow
def test_a_flightgear_receives_the_states_thirty_times_a_second():
    pytest.importorskip("jsbsim")
    with viewer() as (receiver, port):
        block = Block(
            name="c", position=(0, 0, 1500), velocity=(50, 0, 0), autonomy=Straight(), controller=AircraftPIDController(),
            motion=cessna(port),
        )  # fmt: skip
        sim = Simulation(Mission(blocks=[block], dt=0.1, motion_multiplier=12, end=60), on_error="raise")
        sim.step(5)
        found = received(receiver)
    velocity = sim.read("c.vel")[0][0, 0]
    assert len(found) == 15
    assert found[-1]["v_east"] * 0.3048 == pytest.approx(velocity[0], rel=1e-5)
    assert found[-1]["climb"] * 0.3048 == pytest.approx(velocity[2], rel=1e-2)


def test_packets_are_due_thirty_times_a_second_and_the_address_must_be_one():
    slots = {TIME: 0, "gear/gear-pos-norm": 1}
    with viewer() as (receiver, port):
        for step in range(1, 121):
            send(np.array([[step * DT], [1.0]]), slots, 0, DT, "127.0.0.1", port)
        assert len(received(receiver)) == 30
    with pytest.raises(ParameterError, match=r"flightgear_ip = '256\.0\.0\.1', port 5600"):
        send(np.array([[0.1], [1.0]]), slots, 0, 0.1, "256.0.0.1", 5600)
