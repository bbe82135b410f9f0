"""HarmonicOscillator kernel: RK4 for a linear equation. A stiff substep is split into many short steps by doubling."""

from tussle.numeric.kernel import kernel

COARSEST = 0.25
"""Largest step length times fastest rate of the equation for one RK4 step. The relative phase error is 0.25^4 / 120, and RK4 is
stable up to ten times this value."""


@kernel("F2w F2 F2 f8 i8")
def advance(states, inputs, params, dt, substeps):
    """Advance all rows, in place.

    One RK4 step maps (z, v) under an acceleration a to (z + v s + p (a - w^2 z), v + s (a - w^2 z) - (w^2 p + 2 d w s) v), where
    s and p are the fourth-order Taylor polynomials of the impulse and step responses. Two equal steps are one of twice the length
    with new s and p, so a substep that is too coarse is composed of 2^k finer ones in k doublings.

    Args:
        states: z [m], z_rate [m/s], (2, n).
        inputs: Acceleration [m/s^2], (1, n).
        params: Damping ratio d, natural frequency w [rad/s], (2, n).
        dt: Duration [s].
        substeps: Number of equal substeps in dt.
    """
    for i in range(states.shape[1]):
        z, v, push = states[0, i], states[1, i], inputs[0, i]
        drag, spring = 2.0 * params[0, i] * params[1, i], params[1, i] * params[1, i]
        h, doublings = dt / substeps, 0
        while (drag + params[1, i]) * h > COARSEST:
            h *= 0.5
            doublings += 1
        # h^k / k! times the k-th derivative of the impulse response, and the previous term
        term, before = h, 0.0
        s, p = h, 0.5 * h * h
        for k in range(2, 5):
            term, before = -h * (drag * term + spring * h * before / (k - 1)) / k, term
            s += term
            if k < 4:
                p += h * term / (k + 1)
        for _ in range(doublings):
            s, p = s * (2.0 - 2.0 * spring * p - drag * s), p * (2.0 - spring * p) + s * s
        for _ in range(substeps):
            net = push - spring * z
            z, v = z + s * v + p * net, v + s * net - (spring * p + drag * s) * v
        states[0, i], states[1, i] = z, v
