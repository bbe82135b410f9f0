"""Equations of motion, atmosphere, winds and air data, as source text, in the order of JSBSim's models.

Body axes are forward, right, down; local ones north, east, down. Units are foot, slug, pound-force, second, radian.
"""

from __future__ import annotations

from tussle.aircraft.code import Code
from tussle.aircraft.constants import (
    AXIS_RATIO,
    AXIS_RATIO_SQUARED,
    EARTH_RATE,
    ECCENTRICITY_SQUARED,
    FPS_TO_KNOT,
    GAS,
    GM,
    J2,
    SEA_LEVEL_DENSITY,
    SEA_LEVEL_PRESSURE,
    SEMI_MAJOR,
    TEMPERATURES,
)

DEGREES = "57.29577951308232"
CORE = (
    "q0", "q1", "q2", "q3", "pi", "qi", "ri", "rx", "ry", "rz", "vx", "vy", "vz",
    "vx1", "vy1", "vz1", "vx2", "vy2", "vz2", "ax", "ay", "az", "ax1", "ay1", "az1",
    "pidot", "qidot", "ridot", "udot", "vdot", "wdot", "bx", "by", "bz", "earth_angle",
)  # fmt: skip
"""Slots of every aircraft, before all others: attitude, rates, position and velocity in inertial axes, their last derivatives, the
rate of the velocity in the body's axes, the acceleration by forces, the Earth's angle."""

PROPAGATE = f"""
# Attitude and rates by Euler's method, position and velocity by those of Adams and Bashforth.
d0 = -0.5 * (q1 * pi + q2 * qi + q3 * ri)
d1 = 0.5 * (q0 * pi - q3 * qi + q2 * ri)
d2 = 0.5 * (q3 * pi + q0 * qi - q1 * ri)
d3 = 0.5 * (-q2 * pi + q1 * qi + q0 * ri)
q0 += dt * d0
q1 += dt * d1
q2 += dt * d2
q3 += dt * d3
size = math.sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
if abs(size - 1.0) >= 1e-10:
    q0 /= size
    q1 /= size
    q2 /= size
    q3 /= size
pi += dt * pidot
qi += dt * qidot
ri += dt * ridot
third = dt / 12.0
rx += third * (23.0 * vx - 16.0 * vx1 + 5.0 * vx2)
ry += third * (23.0 * vy - 16.0 * vy1 + 5.0 * vy2)
rz += third * (23.0 * vz - 16.0 * vz1 + 5.0 * vz2)
vx2 = vx1
vy2 = vy1
vz2 = vz1
vx1 = vx
vy1 = vy
vz1 = vz
vx += dt * (1.5 * ax - 0.5 * ax1)
vy += dt * (1.5 * ay - 0.5 * ay1)
vz += dt * (1.5 * az - 0.5 * az1)
ax1 = ax
ay1 = ay
az1 = az
earth_angle += dt * {EARTH_RATE!r}
# Geodetic latitude and altitude: T. Fukushima 2006, "Transformation from Cartesian to geodetic coordinates accelerated by Halley's method".
se, ce = sincos(earth_angle)
ex = ce * rx + se * ry
ey = -se * rx + ce * ry
axial = math.sqrt(ex * ex + ey * ey)
radius = math.sqrt(axial * axial + rz * rz)
sin_lon = ey / axial
cos_lon = ex / axial
sin_gc = rz / radius
cos_gc = axial / radius
s0 = abs(rz)
zc = {AXIS_RATIO!r} * s0
c0 = {AXIS_RATIO!r} * axial
a02 = c0 * c0 + s0 * s0
a0 = math.sqrt(a02)
a03 = a02 * a0
s1 = zc * a03 + {SEMI_MAJOR * ECCENTRICITY_SQUARED!r} * s0 * s0 * s0
c1 = axial * a03 - {SEMI_MAJOR * ECCENTRICITY_SQUARED!r} * c0 * c0 * c0
cs = {SEMI_MAJOR * ECCENTRICITY_SQUARED!r} * c0 * s0
b0 = 1.5 * cs * ((axial * s0 - zc * c0) * a0 - cs)
s1 = s1 * a03 - b0 * s0
cc = {AXIS_RATIO!r} * (c1 * a03 - b0 * c0)
size = math.sqrt(s1 * s1 + cc * cc)
cos_lat = cc / size
sin_lat = s1 / size if rz >= 0.0 else -s1 / size
altitude = (axial * cc + s0 * s1 - {SEMI_MAJOR!r} * math.sqrt({AXIS_RATIO_SQUARED!r} * s1 * s1 + cc * cc)) / size
sea_level = {SEMI_MAJOR * AXIS_RATIO!r} / math.sqrt(1.0 - {ECCENTRICITY_SQUARED!r} * cos_gc * cos_gc)
# From inertial to body axes, m; from local to body axes, l.
m11 = q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3
m12 = 2.0 * (q1 * q2 + q0 * q3)
m13 = 2.0 * (q1 * q3 - q0 * q2)
m21 = 2.0 * (q1 * q2 - q0 * q3)
m22 = q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3
m23 = 2.0 * (q2 * q3 + q0 * q1)
m31 = 2.0 * (q1 * q3 + q0 * q2)
m32 = 2.0 * (q2 * q3 - q0 * q1)
m33 = q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3
east_x = -sin_lon * ce - cos_lon * se
east_y = cos_lon * ce - sin_lon * se
north_x = -sin_lat * east_y
north_y = sin_lat * east_x
down_x = -cos_lat * east_y
down_y = cos_lat * east_x
l11 = m11 * north_x + m12 * north_y + m13 * cos_lat
l12 = m11 * east_x + m12 * east_y
l13 = m11 * down_x + m12 * down_y - m13 * sin_lat
l21 = m21 * north_x + m22 * north_y + m23 * cos_lat
l22 = m21 * east_x + m22 * east_y
l23 = m21 * down_x + m22 * down_y - m23 * sin_lat
l31 = m31 * north_x + m32 * north_y + m33 * cos_lat
l32 = m31 * east_x + m32 * east_y
l33 = m31 * down_x + m32 * down_y - m33 * sin_lat
wx = vx + {EARTH_RATE!r} * ry
wy = vy - {EARTH_RATE!r} * rx
u = m11 * wx + m12 * wy + m13 * vz
v = m21 * wx + m22 * wy + m23 * vz
w = m31 * wx + m32 * wy + m33 * vz
p = pi - m13 * {EARTH_RATE!r}
q = qi - m23 * {EARTH_RATE!r}
r = ri - m33 * {EARTH_RATE!r}
v_north = l11 * u + l21 * v + l31 * w
v_east = l12 * u + l22 * v + l32 * w
v_down = l13 * u + l23 * v + l33 * w
"""

GRAVITY = f"""
# Gravity with the Earth's oblateness.
oblate = {1.5 * J2!r} * ({SEMI_MAJOR!r} / radius) * ({SEMI_MAJOR!r} / radius)
pull = {-GM!r} / (radius * radius * radius)
gx = pull * (1.0 + oblate * (1.0 - 5.0 * sin_gc * sin_gc)) * rx
gy = pull * (1.0 + oblate * (1.0 - 5.0 * sin_gc * sin_gc)) * ry
gz = pull * (1.0 + oblate * (3.0 - 5.0 * sin_gc * sin_gc)) * rz
temperature, pressure = atmosphere(radius - sea_level)
density = pressure / ({GAS!r} * temperature)
sound = math.sqrt({1.4 * GAS!r} * temperature)
"""

AIR_DATA = """
# Flow at the aircraft.
ua = u - (l11 * wind_n + l12 * wind_e + l13 * wind_d)
va = v - (l21 * wind_n + l22 * wind_e + l23 * wind_d)
wa = w - (l31 * wind_n + l32 * wind_e + l33 * wind_d)
uw2 = ua * ua + wa * wa
speed2 = uw2 + va * va
speed = math.sqrt(speed2)
alpha = 0.0
beta = 0.0
alpha_dot = 0.0
beta_dot = 0.0
sa = 0.0
ca = 1.0
sb = 0.0
cb = 1.0
if speed > 0.001:
    beta = atan2(va, math.sqrt(uw2))
    sb = va / speed
    cb = math.sqrt(uw2) / speed
    if uw2 >= 1e-6:
        alpha = atan2(wa, ua)
        sa = wa / math.sqrt(uw2)
        ca = ua / math.sqrt(uw2)
        speed_dot = (ua * udot + va * vdot + wa * wdot) / speed
        alpha_dot = (ua * wdot - wa * udot) / uw2
        beta_dot = (vdot * speed - va * speed_dot) / (speed * math.sqrt(uw2))
cos_pitch = max(math.sqrt(l23 * l23 + l33 * l33), 1e-30)
psi_dot = (q * l23 + r * l33) / (cos_pitch * cos_pitch)
dynamic = 0.5 * density * speed2
mach = speed / sound
total = total_pressure(pressure, mach)
"""

ACCELERATE = f"""
# Rates of the angular velocity by Euler's equations; J is the inertia with its signs.
hx = jxx * pi + jxy * qi + jxz * ri
hy = jxy * pi + jyy * qi + jyz * ri
hz = jxz * pi + jyz * qi + jzz * ri
nx = moment_x - (qi * hz - ri * hy)
ny = moment_y - (ri * hx - pi * hz)
nz = moment_z - (pi * hy - qi * hx)
k1 = jyy * jzz - jyz * jyz
k2 = jyz * jxz - jxy * jzz
k3 = jxy * jyz - jyy * jxz
scale = 1.0 / (jxx * k1 + jxy * k2 + jxz * k3)
i11 = scale * k1
i12 = scale * k2
i13 = scale * k3
i22 = scale * (jzz * jxx - jxz * jxz)
i23 = scale * (jxy * jxz - jyz * jxx)
i33 = scale * (jxx * jyy - jxy * jxy)
pidot = i11 * nx + i12 * ny + i13 * nz
qidot = i12 * nx + i22 * ny + i23 * nz
ridot = i13 * nx + i23 * ny + i33 * nz
pdot = pidot - {EARTH_RATE!r} * (qi * m33 - ri * m23)
qdot = qidot - {EARTH_RATE!r} * (ri * m13 - pi * m33)
rdot = ridot - {EARTH_RATE!r} * (pi * m23 - qi * m13)
bx = force_x / mass
by = force_y / mass
bz = force_z / mass
# Rates of the velocity without friction.
turn_x = p + {2.0 * EARTH_RATE!r} * m13
turn_y = q + {2.0 * EARTH_RATE!r} * m23
turn_z = r + {2.0 * EARTH_RATE!r} * m33
fall_x = gx + {EARTH_RATE * EARTH_RATE!r} * rx
fall_y = gy + {EARTH_RATE * EARTH_RATE!r} * ry
carry_x = -(turn_y * w - turn_z * v) + m11 * fall_x + m12 * fall_y + m13 * gz
carry_y = -(turn_z * u - turn_x * w) + m21 * fall_x + m22 * fall_y + m23 * gz
carry_z = -(turn_x * v - turn_y * u) + m31 * fall_x + m32 * fall_y + m33 * gz
udot_free = bx + carry_x
vdot_free = by + carry_y
wdot_free = bz + carry_z
"""
ACCELERATE_END = """
ax = m11 * bx + m21 * by + m31 * bz + gx
ay = m12 * bx + m22 * by + m32 * bz + gy
az = m13 * bx + m23 * by + m33 * bz + gz
udot = bx + carry_x
vdot = by + carry_y
wdot = bz + carry_z
"""

STATE_PROPERTIES = {
    "simulation/sim-time-sec": "s_time",
    "attitude/phi-rad": "atan2(l23, l33)", "attitude/theta-rad": "asin(-l13)", "attitude/psi-rad": "heading(l12, l11)",
    "velocities/eci-x-fps": "vx", "velocities/eci-y-fps": "vy", "velocities/eci-z-fps": "vz",
    "velocities/eci-velocity-mag-fps": "math.sqrt(vx * vx + vy * vy + vz * vz)",
    "velocities/pi-rad_sec": "pi", "velocities/qi-rad_sec": "qi", "velocities/ri-rad_sec": "ri",
    "velocities/u-fps": "u", "velocities/v-fps": "v", "velocities/w-fps": "w",
    "velocities/p-rad_sec": "p", "velocities/q-rad_sec": "q", "velocities/r-rad_sec": "r",
    "velocities/v-north-fps": "v_north", "velocities/v-east-fps": "v_east", "velocities/v-down-fps": "v_down",
    "velocities/h-dot-fps": "-v_down", "position/h-sl-ft": "radius - sea_level", "position/geod-alt-ft": "altitude",
    "position/h-sl-meters": "(radius - sea_level) * 0.3048", "position/geod-alt-km": "altitude * 0.0003048",
    "position/lat-geod-rad": "atan2(sin_lat, cos_lat)", "position/lat-gc-rad": "atan2(sin_gc, cos_gc)",
    "position/long-gc-rad": "atan2(sin_lon, cos_lon)", "position/lat-geod-deg": f"atan2(sin_lat, cos_lat) * {DEGREES}",
    "position/lat-gc-deg": f"atan2(sin_gc, cos_gc) * {DEGREES}", "position/long-gc-deg": f"atan2(sin_lon, cos_lon) * {DEGREES}",
    "position/radius-to-vehicle-ft": "radius", "position/epa-rad": "earth_angle",
    "attitude/roll-rad": "atan2(l23, l33)", "attitude/pitch-rad": "asin(-l13)", "attitude/heading-true-rad": "heading(l12, l11)",
    "attitude/phi-deg": f"atan2(l23, l33) * {DEGREES}", "attitude/theta-deg": f"asin(-l13) * {DEGREES}",
    "attitude/psi-deg": f"heading(l12, l11) * {DEGREES}", "inertial/sea-level-radius_ft": "sea_level",
}  # fmt: skip

AIR_PROPERTIES = {
    "atmosphere/rho-slugs_ft3": "density", "atmosphere/P-psf": "pressure", "atmosphere/T-R": "temperature", "atmosphere/a-fps": "sound",
    "atmosphere/density-ratio": f"density / {SEA_LEVEL_DENSITY!r}", "atmosphere/sigma": f"density / {SEA_LEVEL_DENSITY!r}",
    "atmosphere/rho-ratio": f"density / {SEA_LEVEL_DENSITY!r}",
    "atmosphere/delta": f"pressure / {SEA_LEVEL_PRESSURE!r}", "atmosphere/pressure-ratio": f"pressure / {SEA_LEVEL_PRESSURE!r}",
    "atmosphere/theta": f"temperature / {TEMPERATURES[0]!r}", "atmosphere/T-ratio": f"temperature / {TEMPERATURES[0]!r}",
    "atmosphere/density-altitude": "density_altitude(density)", "atmosphere/pressure-altitude": "pressure_altitude(pressure)",
    "atmosphere/total-wind-north-fps": "wind_n", "atmosphere/total-wind-east-fps": "wind_e", "atmosphere/total-wind-down-fps": "wind_d",
}  # fmt: skip

GEES = "32.17404855643045"
FLOW_PROPERTIES = {
    "aero/alpha-rad": "alpha", "aero/beta-rad": "beta", "aero/mag-beta-rad": "abs(beta)", "aero/alpha-deg": f"alpha * {DEGREES}",
    "aero/beta-deg": f"beta * {DEGREES}", "aero/mag-beta-deg": f"abs(beta) * {DEGREES}", "aero/qbar-psf": "dynamic",
    "aero/qbarUW-psf": "0.5 * density * uw2", "aero/qbarUV-psf": "0.5 * density * (ua * ua + va * va)",
    "aero/alphadot-rad_sec": "alpha_dot", "aero/betadot-rad_sec": "beta_dot",
    "aero/alphadot-deg_sec": f"alpha_dot * {DEGREES}", "aero/betadot-deg_sec": f"beta_dot * {DEGREES}",
    "velocities/mach": "mach", "velocities/machU": "ua / sound",
    "velocities/p-aero-rad_sec": "p", "velocities/q-aero-rad_sec": "q", "velocities/r-aero-rad_sec": "r",
    "velocities/u-aero-fps": "ua", "velocities/v-aero-fps": "va", "velocities/w-aero-fps": "wa", "velocities/vt-fps": "speed",
    "velocities/vtrue-fps": "speed", "velocities/vtrue-kts": f"speed * {FPS_TO_KNOT!r}",
    "velocities/vg-fps": "math.sqrt(v_north * v_north + v_east * v_east)", "velocities/pt-lbs_sqft": "total",
    "velocities/ve-fps": f"math.sqrt(2.0 * dynamic / {SEA_LEVEL_DENSITY!r})",
    "velocities/ve-kts": f"math.sqrt(2.0 * dynamic / {SEA_LEVEL_DENSITY!r}) * {FPS_TO_KNOT!r}",
    "velocities/vc-fps": "calibrated_airspeed(total, pressure)",
    "velocities/vc-kts": f"calibrated_airspeed(total, pressure) * {FPS_TO_KNOT!r}",
    "velocities/tat-r": "temperature * (1.0 + 0.2 * mach * mach)",
    "velocities/tat-c": "(temperature * (1.0 + 0.2 * mach * mach) - 491.67) / 1.8",
    "propulsion/tat-r": "temperature * (1.0 + 0.2 * mach * mach)", "propulsion/pt-lbs_sqft": "total",
    "propulsion/tat-c": "(temperature * (1.0 + 0.2 * mach * mach) - 491.67) / 1.8",
    "flight-path/gamma-rad": "atan2(-v_down, math.sqrt(v_north * v_north + v_east * v_east))",
    "flight-path/gamma-deg": f"atan2(-v_down, math.sqrt(v_north * v_north + v_east * v_east)) * {DEGREES}",
    "flight-path/psi-gt-rad": "0.0 if v_north == 0.0 and v_east == 0.0 else heading(v_east, v_north)",
    "velocities/phidot-rad_sec": "p - l13 * psi_dot", "velocities/psidot-rad_sec": "psi_dot",
    "velocities/thetadot-rad_sec": "(q * l33 - r * l23) / cos_pitch",
    "accelerations/Nx": f"bx / {GEES}", "accelerations/Ny": f"by / {GEES}", "accelerations/Nz": f"-bz / {GEES}",
    "accelerations/n-pilot-x-norm":
        f"(bx + qidot * eye_z - ridot * eye_y + qi * (pi * eye_y - qi * eye_x) - ri * (ri * eye_x - pi * eye_z)) / {GEES}",
    "accelerations/n-pilot-y-norm":
        f"(by + ridot * eye_x - pidot * eye_z + ri * (qi * eye_z - ri * eye_y) - pi * (pi * eye_y - qi * eye_x)) / {GEES}",
    "accelerations/n-pilot-z-norm":
        f"(bz + pidot * eye_y - qidot * eye_x + pi * (ri * eye_x - pi * eye_z) - qi * (qi * eye_z - ri * eye_y)) / {GEES}",
    "accelerations/a-pilot-x-ft_sec2":
        "bx + qidot * eye_z - ridot * eye_y + qi * (pi * eye_y - qi * eye_x) - ri * (ri * eye_x - pi * eye_z)",
    "accelerations/a-pilot-y-ft_sec2":
        "by + ridot * eye_x - pidot * eye_z + ri * (qi * eye_z - ri * eye_y) - pi * (pi * eye_y - qi * eye_x)",
    "accelerations/a-pilot-z-ft_sec2":
        "bz + pidot * eye_y - qidot * eye_x + pi * (ri * eye_x - pi * eye_z) - qi * (qi * eye_z - ri * eye_y)",
}  # fmt: skip

PROPULSION_PROPERTIES = {
    "forces/fbx-prop-lbs": "prop_fx", "forces/fby-prop-lbs": "prop_fy", "forces/fbz-prop-lbs": "prop_fz",
    "moments/l-prop-lbsft": "prop_mx", "moments/m-prop-lbsft": "prop_my", "moments/n-prop-lbsft": "prop_mz",
}  # fmt: skip

RATE_PROPERTIES = {
    "accelerations/pdot-rad_sec2": "pdot", "accelerations/qdot-rad_sec2": "qdot", "accelerations/rdot-rad_sec2": "rdot",
    "accelerations/pidot-rad_sec2": "pidot", "accelerations/qidot-rad_sec2": "qidot", "accelerations/ridot-rad_sec2": "ridot",
    "accelerations/udot-ft_sec2": "udot", "accelerations/vdot-ft_sec2": "vdot", "accelerations/wdot-ft_sec2": "wdot",
    "accelerations/uidot-ft_sec2": "ax", "accelerations/vidot-ft_sec2": "ay", "accelerations/widot-ft_sec2": "az",
    "forces/fbx-total-lbs": "force_x", "forces/fby-total-lbs": "force_y", "forces/fbz-total-lbs": "force_z",
    "moments/l-total-lbsft": "moment_x", "moments/m-total-lbsft": "moment_y", "moments/n-total-lbsft": "moment_z",
    "forces/fbx-gear-lbs": "gear_fx", "forces/fby-gear-lbs": "gear_fy", "forces/fbz-gear-lbs": "gear_fz",
    "moments/l-gear-lbsft": "gear_mx", "moments/m-gear-lbsft": "gear_my", "moments/n-gear-lbsft": "gear_mz",
}  # fmt: skip


def flow_by_lengths(span: float, chord: float) -> dict[str, str]:
    """Properties of the flow that depend on the wing's span and chord [ft]; the viscosity is Sutherland's."""
    return {
        "aero/h_b-cg-ft": f"above_ground / {span!r}",
        "aero/h_b-mac-ft": f"(above_ground - (l13 * ref_x + l23 * ref_y + l33 * ref_z)) / {span!r}",
        "aero/Re": f"speed * {chord!r} * density * (198.72 + temperature) / (2.26969e-08 * temperature * math.sqrt(temperature))",
    }


def offer(code: Code, properties: dict[str, str]) -> None:
    """Write properties, those that somebody reads."""
    for name, text in properties.items():
        code.write(name, text)


def emit_propagate(code: Code) -> None:
    """Emit time, integration, gravity, atmosphere and wind."""
    time = code.state("time")
    assert time == "s_time"
    code.line(f"{time} += dt")
    code.lines(PROPAGATE)
    offer(code, STATE_PROPERTIES)
    ground = code.read("position/terrain-elevation-asl-ft")
    code.line(f"above_ground = altitude - {ground}")
    offer(code, {"position/h-agl-ft": "above_ground", "position/h-agl-km": "above_ground * 0.0003048"})
    code.lines(GRAVITY)
    for axis in ("north", "east", "down"):
        parts = [code.read(f"atmosphere/wind-{axis}-fps"), code.read(f"atmosphere/gust-{axis}-fps")]
        code.line(f"wind_{axis[0]} = {' + '.join(parts)}")
    offer(code, AIR_PROPERTIES)


def lever(code: Code, name: str, x: float, y: float, z: float) -> None:
    """Emit the vector from the centre of gravity to a place of the aircraft's structural frame [in], body axes [ft]."""
    code.line(f"{name}_x = (cg_x - {x!r}) / 12.0".replace("- -", "+ "))
    code.line(f"{name}_y = ({y!r} - cg_y) / 12.0")
    code.line(f"{name}_z = (cg_z - {z!r}) / 12.0".replace("- -", "+ "))


def emit_accelerations(code: Code, friction: str = "") -> None:
    """Emit the sums of forces and moments and the rates; `friction` is text between the rates and the accelerations."""
    code.lines(ACCELERATE)
    code.lines(friction)
    code.lines(ACCELERATE_END)
    offer(code, RATE_PROPERTIES)
