"""Functions that the generated code of engines calls. Parameters of an engine lie in `tables`, from `at`."""

from __future__ import annotations

import math
from typing import Any

from tussle.aircraft.runtime import outlined, power, table_1
from tussle.numeric import exp
from tussle.numeric.kernel import device

PASCAL_PER_PSF = 47.88
NEWTON_METRE = 1.3558  # per foot-pound
OFF, RUN, SPIN_UP, START, STALL, SEIZE, TRIM = (float(k) for k in range(7))


@device
def approach(value, target, up, down, dt):
    """Move a value to a target, at most `up` or `down` per second; it may stay."""
    if value > target:
        return max(value - dt * down, target)
    if value < target:
        return min(value + dt * up, target)
    return value


@device
def decay(value, target, up, down, dt):
    """Move a value to a target exponentially, with the time constant `up` or `down` [s]."""
    if value > target:
        return (value - target) * exp(-dt / down) + target
    if value < target:
        return (target - value) * (1.0 - exp(-dt / up)) + value
    return value


# -- piston -----------------------------------------------------------------------------------------------------------------------


@outlined
def manifold(tables, at, dt, throttle, speed, ambient, total, pressure):
    """Pressure behind the throttle [Pa].

    Impedances of air box, throttle and engine in series, the engine's inversely proportional to the mean piston speed.

    Args:
        tables: From `at`: impedance of throttle, of air box, peak piston speed [ft/s], ram factor, lag [s].
        at: Place of the parameters.
        dt: [s]
        throttle: 0 to 1.
        speed: Mean piston speed [ft/s].
        ambient: Static pressure [lbf/ft^2].
        total: Total pressure [lbf/ft^2].
        pressure: Pressure behind the throttle at the last step [Pa].
    """
    outside = ambient * PASCAL_PER_PSF
    ram = (total * PASCAL_PER_PSF - outside) * tables[at + 3] + outside
    closed = (1.0 - throttle) * (1.0 - throttle) * tables[at]
    engine = tables[at + 2] / speed if speed > 0.0 else 999999.0
    change = pressure - ram * (engine / (engine + tables[at + 1] + closed))
    if tables[at + 4] > dt:
        change *= dt / tables[at + 4]
    return pressure - change


@outlined
def gear_of_boost(tables, at, n, outside, gear):
    """Gear of a supercharger, from 0, by the outside pressure [Pa], with a hysteresis; from `at` pressures at which it shifts up."""
    k = int(gear)
    if k < n - 1 and outside < tables[at + k] - 1000.0:
        k += 1
    if k > 0 and outside > tables[at + k - 1] + 1000.0:
        k -= 1
    return float(k)


@outlined
def boosted(tables, at, gear, is_limited, is_takeoff, rpm, pressure):
    """Pressure behind a supercharger [Pa]; from `at` for each gear: gain per rpm, rated pressure, takeoff pressure [Pa]."""
    at += 3 * int(gear)
    result = pressure * (tables[at] * rpm + 1.0)
    return min(result, tables[at + 2] if is_takeoff else tables[at + 1]) if is_limited else result


@outlined
def boost_loss(low, high, flow, factor):
    """Power [hp] that compresses a flow [m^3/s] from one pressure to another [Pa], adiabatically."""
    gamma = 1.414
    return (
        low * flow * gamma / (gamma - 1.0) * (power(high / low, (gamma - 1.0) / gamma) - 1.0) * factor / 745.7
    )


@outlined
def air_flow(ratio, efficiency, displacement, rpm, ambient, pressure):
    """Volume flow [m^3/s] of a four-stroke engine (Taylor 1985, volume 1, equation 6-10).

    Args:
        ratio: Compression ratio.
        efficiency: Volumetric efficiency.
        displacement: [m^3]
        rpm: [1/min]
        ambient: Outside pressure [Pa].
        pressure: In the manifold [Pa].
    """
    gamma = 1.3
    exhaust = min(ratio if pressure < 1.0 else ambient / pressure, ratio)
    filled = (gamma - 1.0) / gamma + (ratio - exhaust) / (gamma * (ratio - 1.0))
    return displacement * (rpm / 60.0) / 2.0 * (efficiency * filled)


@outlined
def indicated_power(
    tables, at, n, is_running, fuel, air, efficiency, friction, is_cranking, torque, top, rpm
):
    """Power [hp] before pumping losses: by fuel [kg/s] and air [kg/s], or by the starter.

    Args:
        tables: From `at` n ratios of fuel to air, then n efficiencies.
        at: Place of the table.
        n: Number of ratios.
        is_running: 1 or 0.
        fuel: [kg/s]
        air: [kg/s]
        efficiency: Factor of power; over the fuel consumption [lb/h/hp].
        friction: [hp]
        is_cranking: 1 or 0.
        torque: Of the starter [ft lbf].
        top: Speed of the starter without load [1/min].
        rpm: [1/min]
    """
    if is_running != 0.0:
        return fuel * 2.2046 * 3600.0 / efficiency * table_1(tables, at, n, fuel / air) - friction
    if is_cranking != 0.0:
        return torque * max(1.0 - rpm / top, 0.0) * max(rpm, 1.0) / 5252.0
    return -friction


# -- turbine ----------------------------------------------------------------------------------------------------------------------


@outlined
def turbine_phase(dt, phase, running, starter, cutoff, starved, stalled, seized, n2, qbar):
    """Return the phase of a turbine in this step: OFF, RUN, SPIN_UP, START, STALL, SEIZE or TRIM, the last where dt is 0."""
    if running == 0.0 and cutoff != 0.0 and starter != 0.0 and phase == OFF:
        phase = SPIN_UP
    if (starter != 0.0 or qbar > 30.0) and running == 0.0 and cutoff == 0.0 and n2 > 15.0:
        phase = START
    if cutoff != 0.0 and phase != SPIN_UP:
        phase = OFF
    if dt == 0.0:
        phase = TRIM
    if starved != 0.0:
        phase = OFF
    if stalled != 0.0:
        phase = STALL
    return SEIZE if seized != 0.0 else phase


@outlined
def spool_rate(n2norm, bypass, density_ratio):
    """Rate [%/s] at which the spools of a turbine speed up."""
    n = 1.0 - min(n2norm + 0.1, 1.0)
    return 90.0 / (bypass + 3.0) / (1.0 + 3.0 * n * n * n + (1.0 - density_ratio))


@outlined
def spool_idle(tables, at, dt, phase, qbar, n1, n2):
    """Speeds of both spools [%] of a turbine that does not run.

    Args:
        tables: From `at`: idle, ignition speed, rate of spin-up, rate of start, time of spin-down of both spools in turn, windmills.
        at: Place of the parameters.
        dt: [s]
        phase: OFF, SPIN_UP, START, STALL or SEIZE.
        qbar: Dynamic pressure [lbf/ft^2].
        n1: Speed of the first spool [%].
        n2: Speed of the second spool [%].
    """
    if phase == SPIN_UP:
        n2 = approach(n2, tables[at + 3], tables[at + 5], n2 / 2.0, dt)
        return approach(n1, tables[at + 2], tables[at + 4], n1 / 2.0, dt), n2
    if phase == START:
        if n2 > 15.0 and n2 < tables[at + 1]:
            n2 = approach(n2, tables[at + 1], tables[at + 7], n2 / 2.0, dt)
            n1 = approach(n1, tables[at], tables[at + 6], n1 / 2.0, dt)
        return n1, n2
    if phase == STALL:
        return approach(n1, qbar / 10.0, 0.0, n1 / 10.0, dt), approach(n2, qbar / 15.0, 0.0, n2 / 10.0, dt)
    if phase == SEIZE:
        return approach(n1, qbar / 20.0, 0.0, n1 / 15.0, dt), 0.0
    if tables[at + 10] == 0.0:
        return approach(n1, 0.0, n1 / 2.0, n1 / tables[at + 8], dt), approach(
            n2, 0.0, n2 / 2.0, n2 / tables[at + 9], dt
        )
    n1 = approach(n1, qbar / 10.0, n1 / 2.0 + 0.1, n1 / tables[at + 8], dt)
    return n1, approach(n2, qbar / 15.0, n2 / 2.0 + 0.1, n2 / tables[at + 9], dt)


# -- turboprop --------------------------------------------------------------------------------------------------------------------


@outlined
def turboprop_phase(dt, phase, running, starter, cutoff, starved, n1):
    """Return the phase of a turboprop in this step: OFF, RUN, SPIN_UP, START or TRIM, the last where dt is 0."""
    if running == 0.0 and starter != 0.0 and phase == OFF:
        phase = SPIN_UP
    if running == 0.0 and cutoff == 0.0 and n1 > 15.0:
        phase = START
    if cutoff != 0.0 and phase != SPIN_UP:
        phase = OFF
    if dt == 0.0:
        phase = TRIM
    return OFF if starved != 0.0 else phase


@outlined
def brushless(kv, resistance, idle, volts, rpm):
    """Power [ft lbf/s] and current [A] of a brushless motor (Drela 2007, "First-Order DC Electric Motor Model", equations 1 to 4).

    Args:
        kv: Speed constant [1/min/V].
        resistance: [ohm]
        idle: Current without load [A].
        volts: [V]
        rpm: [1/min]
    """
    current = (volts - rpm / kv) / resistance
    # friction opposes rotation; at rest it only resists
    useful = current - idle if rpm > 0.0 else max(current - idle, 0.0) + min(current + idle, 0.0)
    torque = useful / kv * (60.0 / (2.0 * math.pi * NEWTON_METRE))
    return 2.0 * math.pi * max(rpm, 0.0001) * torque / 60.0, current


RUNTIME: dict[str, Any] = {
    each.__name__: each
    for each in (
        approach, decay, manifold, gear_of_boost, boosted, boost_loss, air_flow, indicated_power,
        turbine_phase, spool_rate, spool_idle, turboprop_phase, brushless,
    )
}  # fmt: skip
