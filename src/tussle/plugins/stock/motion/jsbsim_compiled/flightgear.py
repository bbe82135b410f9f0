"""Packets of FlightGear's native flight dynamics protocol, version 24: the states of compiled aircraft for a viewer."""

from __future__ import annotations

import socket
from collections.abc import Mapping

import numpy as np

from tussle.errors import ParameterError

RATE = 30.0
"""Packets of an aircraft in a second of simulated time, at most."""
ENGINES, TANKS, WHEELS = 4, 4, 3
RUNNING, ANY_TIME, VISIBILITY = 2, 1_234_567_890, 25_000.0
"""State of an engine that runs, the time of day that JSBSim sends, which FlightGear ignores, and the visibility [m]."""
SINGLE = {
    "longitude": "position/long-gc-rad", "latitude": "position/lat-geod-rad", "altitude": "position/h-sl-meters",
    "agl": "position/h-agl-ft", "phi": "attitude/phi-rad", "theta": "attitude/theta-rad", "psi": "attitude/psi-rad",
    "alpha": "aero/alpha-rad", "beta": "aero/beta-rad", "phidot": "velocities/phidot-rad_sec", "thetadot": "velocities/thetadot-rad_sec",
    "psidot": "velocities/psidot-rad_sec", "vcas": "velocities/vc-kts", "climb_rate": "velocities/h-dot-fps",
    "v_north": "velocities/v-north-fps", "v_east": "velocities/v-east-fps", "v_down": "velocities/v-down-fps",
    "v_body_u": "velocities/u-fps", "v_body_v": "velocities/v-fps", "v_body_w": "velocities/w-fps",
    "a_x_pilot": "accelerations/a-pilot-x-ft_sec2", "a_y_pilot": "accelerations/a-pilot-y-ft_sec2",
    "a_z_pilot": "accelerations/a-pilot-z-ft_sec2", "slip_deg": "aero/beta-deg",
    "elevator": "fcs/elevator-pos-norm", "elevator_trim_tab": "fcs/pitch-trim-cmd-norm", "left_flap": "fcs/flap-pos-norm",
    "right_flap": "fcs/flap-pos-norm", "left_aileron": "fcs/left-aileron-pos-norm", "right_aileron": "fcs/right-aileron-pos-norm",
    "rudder": "fcs/rudder-pos-norm", "nose_wheel": "fcs/rudder-pos-norm", "speedbrake": "fcs/speedbrake-pos-norm",
    "spoilers": "fcs/spoiler-pos-norm",
}  # fmt: skip
"""Field -> property."""
INDEXED = {
    "eng_state": ("propulsion/engine[{}]/set-running", ENGINES), "rpm": ("propulsion/engine[{}]/engine-rpm", ENGINES),
    "fuel_flow": ("propulsion/engine[{}]/fuel-flow-rate-gph", ENGINES), "mp_osi": ("propulsion/engine[{}]/map-inhg", ENGINES),
    "fuel_quantity": ("propulsion/tank[{}]/contents-lbs", TANKS), "wow": ("gear/unit[{}]/WOW", WHEELS),
    "gear_compression": ("gear/unit[{}]/compression-ft", WHEELS),
}  # fmt: skip
FACTORS = {"agl": 0.3048, "eng_state": RUNNING}
GEAR, TIME = "gear/gear-pos-norm", "state/time"
PROPERTIES = (
    *dict.fromkeys(SINGLE.values()), GEAR, *(name.format(k) for name, n in INDEXED.values() for k in range(n)),
)  # fmt: skip
"""All properties that are sent."""


def _layout() -> np.dtype:
    whole, single, double = ">u4", ">f4", ">f8"
    engine = ("rpm", "fuel_flow", "fuel_px", "egt", "cht", "mp_osi", "tit", "oil_temp", "oil_px")
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = [("version", whole), ("padding", whole)]
    names = list(SINGLE)
    fields += [(name, double) for name in names[:3]]
    fields += [(name, single) for name in [*names[3:23], "stall_warning", "slip_deg"]]
    fields += [("num_engines", whole), ("eng_state", whole, (ENGINES,))]
    fields += [(name, single, (ENGINES,)) for name in engine]
    fields += [
        ("num_tanks", whole),
        ("fuel_quantity", single, (TANKS,)),
        ("num_wheels", whole),
        ("wow", whole, (WHEELS,)),
    ]
    fields += [(name, single, (WHEELS,)) for name in ("gear_pos", "gear_steer", "gear_compression")]
    fields += [("cur_time", whole), ("warp", ">i4"), ("visibility", single)]
    return np.dtype(fields + [(name, single) for name in names[24:]])


LAYOUT = _layout()


def packets(x: np.ndarray, slots: Mapping[str, int], n_engines: int) -> np.ndarray:
    """Return the packets of aircraft, (n,), from their slots, (k, n). Fields without a property are 0, e.g. temperatures of engines."""
    out = np.zeros(x.shape[1], LAYOUT)
    out["version"], out["cur_time"], out["visibility"] = 24, ANY_TIME, VISIBILITY
    for field, name in SINGLE.items():
        if name in slots:
            out[field] = FACTORS.get(field, 1.0) * x[slots[name]]
    counts = dict.fromkeys(INDEXED, 0)
    for field, (name, n) in INDEXED.items():
        for k in range(n):
            slot = slots.get(name.format(k).replace("[0]", ""))
            if slot is not None:
                counts[field] = k + 1
                out[field][:, k] = FACTORS.get(field, 1.0) * x[slot]
    out["num_engines"] = min(n_engines, ENGINES)
    out["num_tanks"], out["num_wheels"] = counts["fuel_quantity"], counts["wow"]
    out["gear_pos"][:, : counts["wow"]] = (x[slots[GEAR]] > 0.99)[:, None]
    return out


def send(x: np.ndarray, slots: Mapping[str, int], n_engines: int, dt: float, address: str, port: int) -> None:
    """Send the states of those aircraft, (k, n), whose packet is due in the last dt [s], to one viewer.

    Raises:
        ParameterError: The address cannot be found.
    """
    rate = min(RATE, 1.0 / dt)
    time = x[slots[TIME]]
    due = np.floor(time * rate + 1e-6) > np.floor((time - dt) * rate + 1e-6)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for packet in packets(x[:, due], slots, n_engines):
            try:
                out.sendto(packet.tobytes(), (address, port))
            except OSError as reason:
                raise ParameterError(f"flightgear_ip = {address!r}, port {port}: {reason}") from None
