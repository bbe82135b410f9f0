"""Rules of the conformance kit for motion models: rollouts equal flights, kernels solve their equation, body states round-trip."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from tussle.api import MotionModel
from tussle.engine.group import Group
from tussle.engine.simulation import Simulation
from tussle.errors import ConformanceError
from tussle.testing.game import ConformanceGame

EPS = float(np.finfo(float).eps)
STEPS = 10
ORDER = 4.0
SLACK = 0.5
"""Tolerance of the observed order below the nominal one, at a step where higher-order terms are not yet small."""
WORST_ANGLE = 64.0 * EPS
"""Error of an attitude converted to three angles and back: a dozen functions and products, each with an error up to 2 ulp of pi."""

VELOCITY = 1e-4
"""Allowed difference between vel and the rate of pos, relative to the largest speed; a larger one must vanish with the step."""
MULTISTEP = 4
"""Steps that a multistep method remembers, at most."""
FEW = 0.1
"""Fraction of rows and steps in which vel may jump, as on the ground or at a limit."""

Integrator = Callable[..., None]


class Flight:
    """A quiet game of a motion model, with the recorded integration of each step.

    Attributes:
        sim: The simulation, after the last step.
        group: The group of the model.
        x: States before each step and after the last, (steps + 1, m, n).
        u: Inputs in each step, (steps, k, n).
        p: Parameters, (q, n).
        dt: Length of a step [s]. If a controller runs between the substeps, each substep counts as a step here.
        substeps: Substeps per step.
    """

    def __init__(self, game: ConformanceGame) -> None:
        self.sim = sim = Simulation(game.quiet, [11, 12], on_error="raise")
        sim.state.by_substep = True
        sim.state.population.on_new_group()  # the schedule is made anew
        self.group: Group = next(
            g for g in sim.state.population.groups if type(g.motion.spec) is type(game.plugin)
        )
        states, inputs = [self.group.x.copy()], []
        integrate = self.group.integrate

        def recorded(x: np.ndarray, u: np.ndarray, p: np.ndarray, dt: float, substeps: int) -> None:
            self.dt, self.substeps = dt, substeps
            inputs.append(np.array(u))
            integrate(x, u, p, dt, substeps)
            states.append(np.array(x))

        self.group.integrate = recorded
        sim.step(STEPS)
        self.group.integrate = integrate
        self.x, self.u, self.p = np.array(states), np.array(inputs), np.array(self.group.p)

    def error(self, rule: str, text: str) -> ConformanceError:
        """Return the error of a rule that the model breaks."""
        return ConformanceError(type(self.group.motion.spec).__name__, rule, text)


def check_motion(game: ConformanceGame, is_default: bool) -> None:
    """All rules for motion models.

    Args:
        game: The game around the model.
        is_default: Whether the model is the default variant of its class, which `derivative` describes.

    Raises:
        ConformanceError: The model breaks a rule.
    """
    model: Any = game.plugin
    if type(model).handles():  # its state and its dynamics are outside
        return
    flight = Flight(game)
    with flight.sim:
        _check_rollout(model, flight)
        _check_rows(model, flight)
        _check_bodies(flight)
        is_solved = type(model).advance is MotionModel.advance and not model.row_laws
        if model.derivative is not None and (is_default or is_solved):
            equation = model.solver()
            _check_order(model, flight, equation)
            _check_kernel(model, flight, equation)
        else:
            _check_convergence(model, flight)
        _check_velocity(model, flight)


def _check_rollout(model: Any, flight: Flight) -> None:
    params, place = {}, 0
    for name, column in type(model).row_params().items():
        k = len(column.fields) or 1
        params[name] = flight.p[place : place + k] if column.fields else flight.p[place]
        place += k
    path = model.rollout(flight.x[0], flight.u, flight.dt, flight.substeps, params)
    if path.tobytes() != np.ascontiguousarray(flight.x).tobytes():
        step, field, row = (int(i[0]) for i in np.nonzero(path != flight.x))
        name, planned, flown = model.state().fields[field], path[step, field, row], flight.x[step, field, row]
        text = f"{name} after step {step} is {planned!r} in the rollout and {flown!r} in flight"
        raise flight.error("rollout", text)


def _check_rows(model: Any, flight: Flight) -> None:
    """A row's path must not depend on its position, or on the number of other rows."""
    integrate = model.advance
    whole = flight.x[0].copy()
    integrate(whole, flight.u[0], flight.p, flight.dt, flight.substeps)
    n = whole.shape[1]
    for a, b in ((0, 1), (1, n), (2, 7), (n - 3, n), (5, 6)):
        part = np.ascontiguousarray(flight.x[0][:, a:b])
        u, p = np.ascontiguousarray(flight.u[0][:, a:b]), np.ascontiguousarray(flight.p[:, a:b])
        integrate(part, u, p, flight.dt, flight.substeps)
        if part.tobytes() != np.ascontiguousarray(whole[:, a:b]).tobytes():
            raise flight.error("rows", f"rows {a} to {b} of {n} take another path alone than among all rows")


# -- the equation and its solvers -------------------------------------------------------------------------------------------------


def _solved(integrate: Integrator, flight: Flight, step: int, dt: float, substeps: int) -> np.ndarray:
    x: np.ndarray = flight.x[step].copy()
    integrate(x, flight.u[step], flight.p, dt, substeps)
    return x


def _rounding(flight: Flight, step: int, end: np.ndarray, substeps: int) -> np.ndarray:
    """Bound of the rounding error: a few units in the last place of all summands, per substep."""
    size = np.abs(flight.x[step]) + np.abs(end) + np.abs(end - flight.x[step])
    return np.asarray(16.0 * EPS * substeps * np.maximum(size, 1e-3).max(axis=1, keepdims=True))


def _check_order(model: Any, flight: Flight, equation: Integrator) -> None:
    """Halving the step divides the driver's error by 2^4 if the equation is smooth."""
    dt = 5.0 * flight.dt
    best = _solved(equation, flight, 0, dt, 64)
    errors = [np.abs(_solved(equation, flight, 0, dt, n) - best).max(axis=0) for n in (2, 4)]
    noise = _rounding(flight, 0, best, 64).max()
    tells = errors[1] > 64.0 * noise
    if tells.any():
        order = np.log2(errors[0][tells] / errors[1][tells])
        # A clamp or a sign function in the equation lowers the order of single rows; a wrong equation that of all rows.
        if np.median(order) < ORDER - SLACK:
            text = f"halving the step divides the error of the derivative's path by 2^{np.median(order):.2f}, not 2^4; is it smooth in x?"
            raise flight.error("order of convergence", text)


def _check_kernel(model: Any, flight: Flight, equation: Integrator) -> None:
    """The model's kernel agrees with the driver within the error of both (Richardson's estimate of the driver's error)."""
    angles = np.array([unit == "rad" for unit in model.state().units])
    for step in (0, STEPS // 2):
        path = _solved(model.advance, flight, step, flight.dt, flight.substeps)
        coarse = _solved(equation, flight, step, flight.dt, flight.substeps)
        fine = _solved(equation, flight, step, flight.dt, 2 * flight.substeps)
        error = np.abs(coarse - fine) * 16.0 / 15.0
        tolerance = 2.0 * error.max(axis=1, keepdims=True) + _rounding(
            flight, step, coarse, 2 * flight.substeps
        )
        gap = np.abs(path - coarse)
        turn = 2.0 * np.pi
        gap[angles] = np.abs(gap[angles] - turn * np.round(gap[angles] / turn))
        if (gap > tolerance).any():
            field, row = (int(i[0]) for i in np.nonzero(gap > tolerance))
            text = (
                f"{model.state().fields[field]} after one step is {path[field, row]!r} by advance and {coarse[field, row]!r} by "
                f"the derivative; they may differ by {np.broadcast_to(tolerance, gap.shape)[field, row]:.1e}"
            )
            raise flight.error("advance", text)


def _check_convergence(model: Any, flight: Flight) -> None:
    """A kernel without an equation to compare with must at least converge with finer substeps."""
    integrate = model.advance
    ends = [_solved(integrate, flight, 0, flight.dt, n) for n in (8, 16, 32, 64)]
    gaps = [float(np.abs(b - a).max()) for a, b in pairwise(ends)]
    noise = float(_rounding(flight, 0, ends[-1], 64).max())
    if gaps[2] > 0.75 * gaps[0] + 4.0 * noise:
        changes = ", ".join(f"{gap:.1e}" for gap in gaps)
        text = f"halving the substeps three times changes the result of a step by {changes}; it does not converge"
        raise flight.error("convergence", text)


# -- conversion to and from the body table ----------------------------------------------------------------------------------------


def _check_velocity(model: MotionModel, flight: Flight) -> None:
    """`to_body` writes vel as the rate of pos: the gap between the mean of vel and the rate of pos vanishes with the step.

    Half the step divides the gap by four on a smooth path and by two on a path with kinks; a jump in vel shows in few rows. A gap
    that does not vanish means that vel is wrong, or that the derivative moves pos differently.
    """
    if model.reads_all:
        return  # its states come from outside
    far, near = (_velocity_gap(model, flight, flight.dt / parts) for parts in (8, 512))
    fastest = max(1e-3, float(np.abs(flight.group.motion_view.vel).max()))
    stays = (near > 0.5 * far) & (near > VELOCITY * fastest)
    step, axis, row = (int(i) for i in np.unravel_index(np.argmax(np.where(stays, near, 0.0)), near.shape))
    if stays.any(axis=1).mean() > FEW:
        text = f"the rate of pos differs from vel by {near[step, axis, row]:.3g} m/s along {'xyz'[axis]}"
        raise flight.error("velocity", text)


def _velocity_gap(model: MotionModel, flight: Flight, h: float) -> np.ndarray:
    """Gap between the rate of pos over h [s] and the mean of vel, after each step of a flight with constant inputs, (steps, 3, n)."""
    group, body = flight.group, flight.group.motion_view
    bound: Any = group.motion.plugin
    columns = group.table.arrays[float]
    gaps, kept, body.dt = [], columns.copy(), h
    for x, u in zip(flight.x[1:], flight.u, strict=True):
        group.x[:], columns[group.u_rows] = x, u[: len(group.u_rows)]
        at = []
        for _ in range(MULTISTEP):  # until what a multistep method remembers belongs to steps of this length
            group.integrate(group.x, u, flight.p, h, 1)
        for _ in range(2):
            body.vel[:] = np.nan
            bound.to_body(body)
            at.append((body.pos.copy(), body.vel.copy()))
            group.integrate(group.x, u, flight.p, h, 1)
        (before, first), (after, second) = at
        if not np.isfinite(first).all():
            raise flight.error("velocity", "to_body does not write vel of all rows")
        gaps.append(np.abs((after - before) / h - 0.5 * (first + second)))
    columns[:] = kept
    bound.to_body(body)
    return np.array(gaps)


def _check_bodies(flight: Flight) -> None:
    """A model reads back unchanged what it wrote to the body table, and continues from where it is placed."""
    group, body = flight.group, flight.group.motion_view
    bound: Any = group.motion.plugin
    rows = np.arange(group.n)
    before = {k: np.array(getattr(body, k)) for k in ("pos", "quat")}
    kept = group.x.copy()
    bound.from_body(body, rows)
    bound.to_body(body)
    size = np.abs(before["pos"]).max()
    moved = np.abs(body.pos - before["pos"]).max()
    if moved > 4.0 * EPS * size:
        raise flight.error("body round trip", f"from_body and to_body move entities by {moved:.1e} m")
    steep = np.abs(np.cos(body.climb)) < 0.05  # gimbal lock: yaw and roll are not unique
    turned = np.minimum(np.abs(body.quat - before["quat"]), np.abs(body.quat + before["quat"])).max(axis=0)
    if (turned[~steep] > 20.0 * WORST_ANGLE).any():
        text = f"from_body and to_body turn entities: quat changes by {turned[~steep].max():.1e}"
        raise flight.error("body round trip", text)
    group.x[:] = kept
    bound.to_body(body)
    body.pos[:, :3] += 7.0
    wanted = body.pos.copy()
    others = group.x[:, 3:].copy()
    bound.from_body(body, rows[:3])
    if group.x[:, 3:].tobytes() != others.tobytes():
        raise flight.error("from_body", "it changes the state of rows that are not in `rows`")
    bound.to_body(body)
    if not np.allclose(body.pos[:, :3], wanted[:, :3], rtol=4.0 * EPS, atol=4.0 * EPS * size):
        text = f"an entity placed at {wanted[:, 0]} continues from {body.pos[:, 0]}"
        raise flight.error("from_body", text)
