"""Loads and inertia of the REMUS underwater vehicle, in its axes: x forward, y right, z down.

Prestero 2001, "Verification of a six-degree of freedom simulation model for the REMUS autonomous underwater vehicle", MIT:
equations of motion in section 4.5, coefficients in appendix C. Units are those of force or moment over the products of velocities
[m/s] and rates [rad/s].
"""

from tussle.numeric.kernel import device
from tussle.numeric.rigid_body import add, cross, scale, solve, times

X_U_DOT, X_WQ, X_QQ, X_VR, X_RR = -0.93, -35.5, -1.93, 35.5, -1.93
Y_V_DOT, Y_R_DOT, Y_UR, Y_WP, Y_PQ, Y_UV, Y_UUDR = -35.5, 1.93, 5.22, 35.5, 1.93, -28.6, 9.64
Z_W_DOT, Z_Q_DOT, Z_QQ, Z_UQ, Z_VP, Z_RP, Z_UW, Z_UUDS = (
    -35.5,
    -1.93,
    -0.632,
    -5.22,
    -35.5,
    1.93,
    -28.6,
    -9.64,
)
K_P_DOT, K_PP = -0.0704, -0.13
M_W_DOT, M_Q_DOT, M_UQ, M_VP, M_RP, M_UW, M_UUDS = -1.93, -4.88, -2.0, -1.93, 4.86, 24.0, -6.15
N_V_DOT, N_R_DOT, N_VV, N_RR, N_UR, N_WP, N_PQ, N_UV, N_UUDR = (
    1.93,
    -4.88,
    -3.18,
    -94.0,
    -2.0,
    -1.93,
    -4.86,
    -24.0,
    -6.15,
)


@device
def hydrodynamic_loads(velocity, omega, fins, drag):
    """Force [N] and moment [N m] of damping, lift, fins and added mass, without the terms of the accelerations.

    Args:
        velocity: u, v, w [m/s].
        omega: p, q, r [rad/s].
        fins: Angles of the stern planes and of the rudder [rad].
        drag: X_u|u|, Y_v|v|, Z_w|w|, M_w|w|, Y_r|r|, M_q|q|.
    """
    u, v, w = velocity
    p, q, r = omega
    planes, rudder = fins
    x_uu, y_vv, z_ww, m_ww, y_rr, m_qq = drag
    force = (
        x_uu * u * abs(u) + X_WQ * w * q + X_QQ * q * q + X_VR * v * r + X_RR * r * r,
        y_vv * v * abs(v)
        + y_rr * r * abs(r)
        + Y_UR * u * r
        + Y_WP * w * p
        + Y_PQ * p * q
        + Y_UV * u * v
        + Y_UUDR * u * u * rudder,
        z_ww * w * abs(w)
        + Z_QQ * q * abs(q)
        + Z_UQ * u * q
        + Z_VP * v * p
        + Z_RP * r * p
        + Z_UW * u * w
        + Z_UUDS * u * u * planes,
    )
    moment = (
        K_PP * p * abs(p),
        m_ww * w * abs(w)
        + m_qq * q * abs(q)
        + M_UQ * u * q
        + M_VP * v * p
        + M_RP * r * p
        + M_UW * u * w
        + M_UUDS * u * u * planes,
        N_VV * v * abs(v)
        + N_RR * r * abs(r)
        + N_UR * u * r
        + N_WP * w * p
        + N_PQ * p * q
        + N_UV * u * v
        + N_UUDR * u * u * rudder,
    )
    return force, moment


@device
def accelerations(force, moment, mass, center, inertia):
    """Rates of velocity and angular velocity under a force at the origin and a moment about it, with added mass.

    The mass matrix (section 4.5) is [A, B; C, D] with a diagonal A; a' = A^-1 (F - B w'), (D - C A^-1 B) w' = M - C A^-1 F.

    Args:
        force: Force [N].
        moment: Moment [N m].
        mass: Mass [kg].
        center: Center of gravity [m].
        inertia: Inertia tensor about the origin [kg m^2], nine elements.
    """
    xg, yg, zg = center
    a, b, c = 1.0 / (mass - X_U_DOT), 1.0 / (mass - Y_V_DOT), 1.0 / (mass - Z_W_DOT)
    mx, my, mz = mass * xg, mass * yg, mass * zg
    side, lift, nose, tail = mx - Y_R_DOT, -mx - Z_Q_DOT, -mx - M_W_DOT, mx - N_V_DOT
    fx, fy, fz = a * force[0], b * force[1], c * force[2]
    matrix = (
        inertia[0] - K_P_DOT - b * mz * mz - c * my * my, inertia[1] - c * my * lift, inertia[2] + b * mz * side,
        inertia[3] - c * nose * my, inertia[4] - M_Q_DOT - a * mz * mz - c * nose * lift, inertia[5] + a * mz * my,
        inertia[6] + b * tail * mz, inertia[7] + a * my * mz, inertia[8] - N_R_DOT - a * my * my - b * tail * side,
    )  # fmt: skip
    p, q, r = solve(
        matrix,
        (moment[0] + mz * fy - my * fz, moment[1] - mz * fx - nose * fz, moment[2] + my * fx - tail * fy),
    )
    return (fx - a * (mz * q - my * r), fy - b * (side * r - mz * p), fz - c * (my * p + lift * q)), (p, q, r)


@device
def inertial_loads(velocity, omega, mass, center, inertia):
    """Force and moment about the origin of a rigid body's inertia, without the terms of the accelerations.

    -m (w x v + w x (w x r)) and -w x I w - m r x (w x v); arguments as in `accelerations`.
    """
    turning = cross(omega, velocity)
    force = scale(-mass, add(turning, cross(omega, cross(omega, center))))
    return force, add(cross(times(inertia, omega), omega), scale(-mass, cross(center, turning)))
