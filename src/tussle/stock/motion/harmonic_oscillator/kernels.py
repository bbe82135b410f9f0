"""The oscillator's equation is linear, so Runge-Kutta steps too short to be made one by one can be made at once."""

from __future__ import annotations

from tussle.numeric.kernel import kernel

COARSEST = 0.25
"""Length of a step times the equation's fastest rate, up to which it is one Runge-Kutta step: its phase errs by 0.25^4 / 120 of
itself, and the method is stable up to ten times that."""


@kernel("F2w F2 F2 f8 i8")
def advance(states, inputs, params, dt, substeps):
    """Advance (z [m], z_rate [m/s]) by dt [s] under the push inputs[0] [m/s^2]; params: damping ratio, natural frequency [rad/s].

    One Runge-Kutta step of fourth order takes (z, v) under a push a to (z + v s + p (a - w^2 z), v + s (a - w^2 z) - (w^2 p + 2 d w s) v)
    where s and p are the Taylor polynomials of fourth order of the answers to a unit kick and to a unit push. Two such steps are
    one of twice the length with s' and p' as below: a substep that is too coarse is made of 2^k finer ones in k doublings.
    """
    for i in range(states.shape[1]):
        z, v, push = states[0, i], states[1, i], inputs[0, i]
        drag, spring = 2.0 * params[0, i] * params[1, i], params[1, i] * params[1, i]
        h, doublings = dt / substeps, 0
        while (drag + params[1, i]) * h > COARSEST:
            h *= 0.5
            doublings += 1
        term, before = h, 0.0  # h^k / k! of the kick's k-th derivative, and the one before
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
