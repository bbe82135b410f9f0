"""One step of a PID law with an integral band, for the kernels of controllers."""

from __future__ import annotations

from tussle.numeric.kernel import device


@device
def pid(error, change, dt, kp, ki, kd, band, integral):
    """Command and new integral of one PID step.

    u = kp e + ki I + kd de/dt; the integral is emptied while |e| > band, which keeps it from winding up far from the
    goal.

    Args:
        error: Wanted value minus measured value e; of an angle, wrapped to (-pi, pi].
        change: Change of the error since the last call (of an angle, wrapped too); 0 at the first call, so that the
            wanted value itself is not differentiated (no kick).
        dt: Time since the last call [s], > 0.
        kp: Gain on the error.
        ki: Gain on the integral.
        kd: Gain on the derivative.
        band: Largest |e| at which the integral grows.
        integral: I of the last call [unit of e times s].

    Returns:
        (u, I) with the integral of this call.
    """
    grown = integral + error * dt
    integral = grown if abs(error) <= band else 0.0
    return kp * error + ki * integral + kd * (change / dt), integral
