"""Compiled aircraft beside JSBSim: who compiles, how far flights are apart, speed, threads, compile time, missions.

python benchmarks/aircraft.py --parts census match speed threads compile mission predator_prey --json out.json
python benchmarks/aircraft.py --parts match --aircraft c172p 737
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import jsbsim
import numpy as np

from tussle.aircraft.compile import CompiledAircraft, compile_aircraft
from tussle.aircraft.initial import place, run_initial
from tussle.aircraft.node import AircraftError

DT = 1.0 / 120.0
PARTS = ("census", "match", "speed", "threads", "compile", "mission", "predator_prey")
UNLOADABLE = ("L17", "Pterosaur", "dr1", "f104", "fokker100", "fokker50", "blank")
PLACE = {
    "ic/lat-geod-deg": 33.0,
    "ic/long-gc-deg": -84.0,
    "ic/psi-true-deg": 30.0,
    "ic/theta-deg": 2.0,
    "ic/phi-deg": 1.0,
}
STARTS = {  # altitude [ft], speed [ft/s] of those that 5,000 ft and 180 ft/s do not suit
    "737": (20000.0, 700.0), "787-8": (20000.0, 700.0), "A320": (20000.0, 700.0), "MD11": (20000.0, 700.0), "B747": (20000.0, 700.0),
    "T37": (15000.0, 450.0), "T38": (15000.0, 600.0), "XB-70": (30000.0, 1200.0), "Shuttle": (30000.0, 900.0), "A4": (15000.0, 600.0),
    "F80C": (15000.0, 500.0), "f15": (15000.0, 700.0), "F4N": (15000.0, 700.0), "f16": (15000.0, 700.0), "f22": (15000.0, 700.0),
    "Concorde": (30000.0, 1000.0), "OV10": (8000.0, 300.0), "B17": (8000.0, 280.0), "t6texan2": (8000.0, 350.0), "X15": (40000.0, 1500.0),
    "wrightFlyer1903": (2000.0, 45.0), "minisgs": (3000.0, 60.0), "J3Cub": (3000.0, 100.0), "F450": (500.0, 1.0),
}  # fmt: skip
SUBSTEPS = 12
"""Steps of 1/120 s in a step of a mission of 0.1 s, which are one call of the kernel."""
LOW = 300.0  # [ft] above ground where a comparison ends


def commands(t: float) -> dict[str, float]:
    """Scripted controls at a time [s]."""
    return {
        "fcs/throttle-cmd-norm": 0.8, "fcs/mixture-cmd-norm": 0.9, "fcs/elevator-cmd-norm": -0.03 + 0.02 * math.sin(0.5 * t),
        "fcs/aileron-cmd-norm": 0.03 * math.sin(0.3 * t), "fcs/rudder-cmd-norm": 0.02 * math.sin(0.2 * t),
    }  # fmt: skip


def loaded(name: str, start: dict[str, float]) -> Any:
    """An aircraft in JSBSim, after its initial conditions were run."""
    fdm = jsbsim.FGFDMExec(jsbsim.get_default_root_dir())
    fdm.set_debug_level(0)
    fdm.set_dt(DT)
    if not fdm.load_model(name):
        raise ValueError(f"JSBSim cannot load {name}")
    fdm.set_dt(DT)
    for key, value in start.items():
        fdm[key] = value
    fdm.run_ic()
    return fdm


def state_of(fdm: Any) -> list[np.ndarray]:
    """Arguments of `place` after the state."""
    single = [
        np.array([fdm[key]])
        for key in ("position/lat-geod-rad", "position/long-gc-rad", "position/geod-alt-ft")
    ]
    triples = (
        ("attitude/phi-rad", "attitude/theta-rad", "attitude/psi-rad"),
        ("velocities/v-north-fps", "velocities/v-east-fps", "velocities/v-down-fps"),
        ("velocities/p-rad_sec", "velocities/q-rad_sec", "velocities/r-rad_sec"),
    )
    return single + [np.array([[fdm[key]] for key in keys]) for keys in triples]


def started(aircraft: CompiledAircraft, fdm: Any, n: int = 1) -> np.ndarray:
    """States of n compiled aircraft that start as one in JSBSim did."""
    x = np.repeat(aircraft.first[:, None], n, axis=1)
    place(x, *(np.repeat(each, n, axis=-1) for each in state_of(fdm)))
    run_initial(aircraft, x, DT)
    return x


def start_of(name: str) -> dict[str, float]:
    """Initial conditions of an aircraft."""
    altitude, speed = STARTS.get(name, (5000.0, 180.0))
    return {**PLACE, "ic/h-sl-ft": altitude, "ic/vt-fps": speed}


def match(
    name: str,
    end: float = 60.0,
    controls: Any = commands,
    start: dict[str, float] | None = None,
    low: float = LOW,
) -> dict[str, Any]:
    """Fly an aircraft in JSBSim and compiled; the largest distance [m] and angle [deg] until the end, or until it is low."""
    fdm = loaded(name, start or start_of(name))
    aircraft = compile_aircraft(None, name)
    x = started(aircraft, fdm)
    if aircraft.n_engines:
        fdm["propulsion/set-running"] = -1
        aircraft.start(x, aircraft.tables, 0, 1, 1, 0.0, DT)
    distance = angle = t = 0.0
    at_30 = None
    for step in range(round(end / DT)):
        t = (step + 1) * DT
        for key, value in controls(step * DT).items():
            for name_k in [key] + [
                f"{key}[{k}]" for k in range(1, aircraft.n_engines) if "throttle" in key or "mixture" in key
            ]:
                fdm[name_k] = value
                if name_k in aircraft.slots:
                    x[aircraft.slots[name_k]] = value
        fdm.run()
        aircraft.advance(x, aircraft.tables, 0, 1, 1, DT, DT)
        there = [fdm[f"position/eci-{axis}-ft"] for axis in "xyz"]
        if fdm["position/h-agl-ft"] < low or not math.isfinite(there[0]):
            break
        distance = max(distance, 0.3048 * math.dist(there, x[7:10, 0]))
        angle = max(angle, angle_between(fdm, x[:4, 0]))
        if at_30 is None and t >= 30.0:
            at_30 = distance
    return {
        "aircraft": name,
        "until_s": round(t, 2),
        "distance_m": distance,
        "angle_deg": angle,
        "distance_at_30_s_m": at_30,
    }


def angle_between(fdm: Any, quat: np.ndarray) -> float:
    """Angle between the attitudes [deg], from roll, pitch and yaw relative to the local frame."""
    from tussle.aircraft.initial import rotation
    from tussle.numeric.quaternion import quat_conjugate, quat_multiply

    latitude, longitude, _, euler, *_ = state_of(fdm)
    turn = quat_multiply(
        rotation(2, longitude + fdm["position/epa-rad"]), rotation(1, -0.5 * np.pi - latitude)
    )
    attitude = quat_multiply(
        rotation(2, euler[2]), quat_multiply(rotation(1, euler[1]), rotation(0, euler[0]))
    )
    error = quat_multiply(quat_conjugate(quat_multiply(turn, attitude)), quat[:, None])[:, 0]
    return math.degrees(2.0 * math.asin(min(1.0, float(np.linalg.norm(error[1:])))))


def census(names: list[str]) -> dict[str, str]:
    """Aircraft -> "" if it compiles, else why not."""
    found = {}
    for name in names:
        try:
            compile_aircraft(None, name)
            found[name] = ""
        except AircraftError as error:
            found[name] = str(error)
    return found


def speed(name: str, n: int) -> dict[str, float]:
    """CPU time per step of one aircraft, JSBSim's and the kernel's in turn [us]."""
    fdm, aircraft = loaded(name, start_of(name)), compile_aircraft(None, name)
    x = started(aircraft, fdm, n)
    aircraft.start(x, aircraft.tables, 0, n, 1, 0.0, DT)
    fdm["propulsion/set-running"] = -1
    for key, value in commands(0.0).items():
        fdm[key] = value
        if key in aircraft.slots:
            x[aircraft.slots[key]] = value
    theirs, ours = [], []
    for _ in range(5):
        begin = time.process_time()
        for _ in range(4000):
            fdm.run()
        theirs.append((time.process_time() - begin) / 4000 * 1e6)
        begin = time.process_time()
        for _ in range(5):
            aircraft.advance(x, aircraft.tables, 0, n, SUBSTEPS, DT, DT)
        ours.append((time.process_time() - begin) / 5 / SUBSTEPS / n * 1e6)
    return {"n": n, "jsbsim_us": min(theirs), "compiled_us": min(ours), "ratio": min(theirs) / min(ours)}


def threads(name: str, n: int) -> float:
    """How many times as fast two threads are as one."""
    fdm, aircraft = loaded(name, start_of(name)), compile_aircraft(None, name)
    x = started(aircraft, fdm, n)
    halves = [np.ascontiguousarray(x[:, : n // 2]), np.ascontiguousarray(x[:, n // 2 :])]

    def fly(part: np.ndarray) -> None:
        aircraft.advance(part, aircraft.tables, 0, part.shape[1], 100, DT, DT)

    best = [math.inf, math.inf]
    with ThreadPoolExecutor(2) as pool:
        for _ in range(5):
            begin = time.perf_counter()
            for half in halves:
                fly(half)
            best[0] = min(best[0], time.perf_counter() - begin)
            begin = time.perf_counter()
            list(pool.map(fly, halves))
            best[1] = min(best[1], time.perf_counter() - begin)
    return best[0] / best[1]


COMPILE = """
import sys, time, numpy as np
from tussle.aircraft.compile import compile_aircraft
from tussle.aircraft.initial import run_initial
begin = time.process_time()
a = compile_aircraft(None, sys.argv[1])
x = np.repeat(a.first[:, None], 1, axis=1)
x[7], x[0] = 2.1e7, 1.0
run_initial(a, x, 1 / 120)
a.start(x, a.tables, 0, 1, 1, 0.0, 1 / 120)
print(time.process_time() - begin)
"""


def compile_times(name: str, folder: str) -> dict[str, float]:
    """CPU time [s] until an aircraft can fly, with an empty cache and with a full one."""
    found = []
    for _ in range(2):
        made = subprocess.run(
            [sys.executable, "-c", COMPILE, name], env={**os.environ, "TUSSLE_CACHE_DIR": folder}, capture_output=True, text=True,
            check=True,
        )  # fmt: skip
        found.append(float(made.stdout))
    return {"cold_s": found[0], "warm_s": found[1]}


ORIGINAL = {200: 2.63, 500: 0.66, 800: 0.227, 1100: 0.163, 1400: 0.128, 1700: 0.105, 2000: 0.090}
"""Entities -> simulated seconds per CPU second of SCRIMMAGE with JSBSim (revision of 2025-08-12, Release build, one thread, logs off) on a
2-core 2.6 GHz Xeon virtual machine: the third column of the paper's Table 1, measured again."""


def cruise(n: int, model: Any, aircraft: str) -> Any:
    """A mission of aircraft that hold their course."""
    from tussle import Block, Mission
    from tussle.stock import AircraftPIDController, Straight

    block = Block(
        name="c", team=1, count=n, position=(0, 0, 1500), variance=(1e6, 1e6, 1e4), speed=55.0,
        autonomy=Straight(speed=55.0), controller=AircraftPIDController(), motion=model(aircraft=aircraft),
    )  # fmt: skip
    return Mission(blocks=[block], dt=0.1, motion_multiplier=SUBSTEPS, end=1e6)


def predator_prey(n: int, model: Any, aircraft: str) -> Any:
    """The game of the paper's Table 1: n - 10 prey that fly as aircraft, 5 + 5 predators, faster than the prey as there."""
    from tussle import Block, Mission
    from tussle.plugins import stock

    def predators(name: str, team: int, switching: bool) -> Any:
        hunter = stock.Predator(max_speed=65.0, capture_range=5.0, allow_prey_switching=switching)
        legs = stock.Unicycle(vel_max=65.0, turn_rate_max=2.0, pitch_rate_max=1.5)
        place = {"position": (1000, 0, 1500), "heading": "180 deg"}
        return Block(name=name, team=team, count=5, **place, autonomy=hunter, motion=legs)

    prey = Block(
        name="prey", team=1, count=n - 10, position=(0, 0, 1500), variance=(400_000, 400_000, 1000), speed=55.0,
        autonomy=stock.Boids(max_speed=55.0), controller=stock.AircraftPIDController(), motion=model(aircraft=aircraft),
    )  # fmt: skip
    return Mission(
        blocks=[prey, predators("keepers", 2, False), predators("switchers", 3, True)],
        dt=0.1, end=20.0, motion_multiplier=SUBSTEPS, networks=[stock.LocalNetwork()],
        interactions=[stock.SimpleCollision(startup_collisions_only=True), stock.SimpleCapture()],
        metrics=[stock.SimpleCaptureMetrics()],
    )  # fmt: skip


def side_by_side(make: Any, counts: list[int], aircraft: str) -> list[dict[str, float]]:
    """CPU time of a step of a mission, compiled and by JSBSim [ms], and simulated seconds per CPU second of both."""
    from tussle import Simulation
    from tussle.stock import JSBSimCompiled, JSBSimControl

    rows = []
    for n in counts:
        row: dict[str, float] = {"n": n}
        for model in (JSBSimCompiled, JSBSimControl):
            with Simulation(make(n, model, aircraft), seeds=[1]) as simulation:
                simulation.step(2)
                steps = 100 if model is JSBSimCompiled else max(2, 800 // n)
                begin = time.process_time()
                simulation.step(steps)
                row[model.__name__] = (time.process_time() - begin) / steps * 1e3
                row[f"{model.__name__}_sim_per_cpu"] = 100.0 / row[model.__name__]
        row["ratio"] = row["JSBSimControl"] / row["JSBSimCompiled"]
        if make is predator_prey and n in ORIGINAL:
            row |= {
                "original": ORIGINAL[n],
                "ratio_original": row["JSBSimCompiled_sim_per_cpu"] / ORIGINAL[n],
            }
        rows.append(row)
        print(json.dumps(row), flush=True)
    return rows


def mission_threads(n: int) -> dict[str, float]:
    """A step of `cruise` with two threads and with one: shortest times of a clock [ms], which need two idle cores, and CPU times [ms]."""
    from tussle import Simulation
    from tussle.stock import JSBSimCompiled

    best: dict[str, float] = {}
    simulations = [Simulation(cruise(n, JSBSimCompiled, "c172p"), seeds=[1], threads=k) for k in (1, 2)]
    for _ in range(60):
        for k, simulation in enumerate(simulations, 1):
            begin = time.perf_counter(), time.process_time()
            simulation.step()
            for name, taken in (
                ("wall", time.perf_counter() - begin[0]),
                ("cpu", time.process_time() - begin[1]),
            ):
                best[f"{name}_{k}"] = min(best.get(f"{name}_{k}", math.inf), taken * 1e3)
    return best | {"ratio": best["wall_1"] / best["wall_2"], "cpu_ratio": best["cpu_1"] / best["cpu_2"]}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--aircraft", nargs="+", default=[])
    parser.add_argument("--counts", nargs="+", type=int, default=[200, 2000])
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    folders = sorted(
        each.name for each in (Path(jsbsim.get_default_root_dir()) / "aircraft").iterdir() if each.is_dir()
    )
    names = options.aircraft or [name for name in folders if name not in UNLOADABLE]
    made: dict[str, Any] = {}
    if "census" in options.parts:
        made["census"] = census(names)
        for name, why in made["census"].items():
            print(f"{name:20} {why or 'compiles'}")
        print(sum(not why for why in made["census"].values()), "of", len(names), "compile")
    if "match" in options.parts:
        made["match"] = []
        for name in names:
            try:
                made["match"].append(match(name))
            except (AircraftError, jsbsim.BaseError, ValueError) as error:
                made["match"].append({"aircraft": name, "refused": str(error).strip()})
            print(json.dumps(made["match"][-1]), flush=True)
    chosen = options.aircraft or ["ball", "c172p", "737"]
    if "speed" in options.parts:
        made["speed"] = {name: speed(name, 2000) for name in chosen}
        print(json.dumps(made["speed"], indent=1))
    if "threads" in options.parts:
        made["threads"] = threads("c172p", 2000)
        made["mission_threads"] = mission_threads(2000)
        print("two threads:", made["threads"], "in a mission:", made["mission_threads"])
    if "compile" in options.parts:
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            made["compile"] = {name: compile_times(name, folder) for name in chosen}
        print(json.dumps(made["compile"], indent=1))
    for name, make in (("mission", cruise), ("predator_prey", predator_prey)):
        if name in options.parts:
            made[name] = side_by_side(make, options.counts, (options.aircraft or ["c172p"])[0])
    if options.json:
        options.json.write_text(json.dumps(made, indent=1))


if __name__ == "__main__":
    main()
