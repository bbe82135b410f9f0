"""Random processes with known probabilities, as games whose draws change where a game branches."""

from __future__ import annotations

from functools import partial

import numpy as np

from tussle.numeric.rng import normal, stream_key, uniform
from tussle.stress import Played, Verdict

STREAM = stream_key("walk")
NORMAL, UNIFORM = 0, 1  # kinds of draws
START = 2  # normal numbers of the entities at the start
ENTITIES = [("walker", i + 1) for i in range(4)]
CHUNK = 2000  # games whose arrays fit the processor's cache


def playing(path, steps):
    """A function that plays games of a process: path(draw, n) returns robustness, (n, steps + 1).

    draw(NORMAL) returns numbers, (n, steps), and draw(START) those of entities, (n, len(ENTITIES)).
    """
    at = np.tile(np.arange(steps), CHUNK)

    def draw(kind, keys, born):
        if kind == START:
            return normal(born.ravel(), STREAM + START, np.tile(np.arange(len(ENTITIES)), len(born)), 0)[
                0
            ].reshape(born.shape)
        numbers = {NORMAL: normal, UNIFORM: uniform}[kind](keys.ravel(), STREAM + kind, 0, at[: keys.size])
        return numbers[0].reshape(keys.shape)

    def play(games):
        found = []
        for first in range(0, len(games), CHUNK):
            some = games[first : first + CHUNK]
            keys = np.repeat(np.array([game.seed for game in some], np.uint64)[:, None], steps, axis=1)
            born = np.repeat(keys[:, :1], len(ENTITIES), axis=1)
            for row, own, game in zip(keys, born, some, strict=True):
                for step, key, *target in game.rekeys:
                    if target:
                        assert (step, target[0][-6:]) == (0, "/birth")
                        own[int(target[0].split("/")[1]) - 1] = key
                    else:
                        row[step:] = key
            robustness = np.minimum.accumulate(path(partial(draw, keys=keys, born=born), len(some)), axis=1)
            found += _played(steps, some, robustness)
        return found

    return play


def _played(steps, games, robustness):
    """What came of games whose robustness never rises, (n, steps + 1)."""
    is_lower = np.diff(robustness, axis=1, prepend=np.inf) < 0.0
    rows, falls = np.nonzero(is_lower)
    ends = np.cumsum(np.bincount(rows, minlength=len(games))).tolist()
    falls, levels, last = falls.tolist(), robustness[is_lower].tolist(), robustness[:, -1].tolist()
    return [
        Played(game, Verdict(least, falls[begin:end], levels[begin:end]), float(steps), 0.0, "")
        for game, least, begin, end in zip(games, last, [0, *ends], ends, strict=False)
    ]


def brownian(p):
    """First passage of Brownian motion within time 1: P = 2 (1 - Phi(b)), by the reflection principle.

    The maximum within a step is drawn from its exact law, that of a bridge.
    """
    from scipy.stats import norm

    steps, b = 60, norm.isf(p / 2)

    def path(draw, n):
        dx = draw(NORMAL) / np.sqrt(steps)
        x = np.cumsum(dx, axis=1)
        top = 0.5 * (2 * x - dx + np.sqrt(dx**2 - 2.0 / steps * np.log1p(-draw(UNIFORM))))
        return b - np.concatenate([np.zeros((n, 1)), top], axis=1)

    return playing(path, steps), p


def ornstein_uhlenbeck(p):
    """First passage of an Ornstein-Uhlenbeck process at 40 times, from its mean; the law by quadrature of its transition density."""
    from scipy.optimize import brentq
    from scipy.stats import norm

    steps, a = 40, 0.9
    s = np.sqrt(1 - a * a)

    def passage(b):
        x, w = np.polynomial.legendre.leggauss(400)
        y, w = 0.5 * (b + 9) * x + 0.5 * (b - 9), 0.5 * (b + 9) * w
        density = norm.pdf(y / s) / s
        kernel = norm.pdf((y[:, None] - a * y[None]) / s) / s
        out = norm.sf(b / s)
        for _ in range(steps - 1):
            out += (w * density) @ norm.sf((b - a * y) / s)
            density = kernel @ (w * density)
        return out

    b = brentq(lambda b: np.log(passage(b) / p), 0.5, 9.0)

    def path(draw, n):
        x, out, z = np.zeros(n), [np.full(n, b)], draw(NORMAL)
        for k in range(steps):
            x = a * x + s * z[:, k]
            out.append(b - x)
        return np.stack(out, axis=1)

    return playing(path, steps), p


def chain(p):
    """A chain of three states that reaches the last within 30 steps: a power of its matrix. Its score has only ties."""
    from scipy.optimize import brentq

    steps, back = 30, 0.3

    def reached(q):
        matrix = np.array([[1 - q, q, 0.0], [back, 1 - back - q, q], [0.0, 0.0, 1.0]])
        return np.linalg.matrix_power(matrix, steps)[0, 2]

    q = brentq(lambda q: np.log(reached(q) / p), 1e-9, 0.6)

    def path(draw, n):
        x, out, u = np.zeros(n, int), [np.full(n, 1.5)], draw(UNIFORM)
        for k in range(steps):
            up = (x < 2) & (u[:, k] < q)
            down = (x == 1) & (u[:, k] > 1 - back)
            x = x + up - down
            out.append(1.5 - x)
        return np.stack(out, axis=1)

    return playing(path, steps), p


def gap(p):
    """Two walkers on a line that meet within 32 steps: their gap is a simple walk of twice as many, by the reflection principle."""
    from scipy.stats import binom

    steps = 32

    def meets(g):
        return binom.sf((2 * steps + g) / 2 - 1, 2 * steps, 0.5) + binom.sf(
            (2 * steps + g) / 2, 2 * steps, 0.5
        )

    g = min(range(2, 2 * steps, 2), key=lambda g: abs(np.log(meets(g) / p)))

    def path(draw, n):
        u = draw(UNIFORM)
        moves = np.where(u < 0.25, -2, np.where(u < 0.5, 2, 0))
        return np.concatenate([np.full((n, 1), g), g + np.cumsum(moves, axis=1)], axis=1) - 1.0

    return playing(path, steps), float(meets(g))


def begun(p, part=0.9):
    """First passage of Brownian motion whose start, the sum of numbers of four entities, has a part of the variance: by quadrature."""
    from scipy.integrate import quad
    from scipy.optimize import brentq
    from scipy.stats import norm

    steps, s, r = 30, np.sqrt(part), np.sqrt(1.0 - part)

    def passage(b):
        below = quad(
            lambda x: norm.pdf(x / s) / s * 2.0 * norm.sf((b - x) / r),
            b - 12.0 * r,
            b,
            epsabs=0.0,
            epsrel=1e-9,
            limit=200,
        )[0]
        return below + norm.sf(b / s)

    b = brentq(lambda b: np.log(passage(b) / p), 0.5, 9.0)

    def path(draw, n):
        dx = draw(NORMAL) * r / np.sqrt(steps)
        first = s * draw(START).sum(axis=1)[:, None] / np.sqrt(len(ENTITIES))
        x = first + np.cumsum(dx, axis=1)
        top = 0.5 * (2 * x - dx + np.sqrt(dx**2 - 2.0 * r**2 / steps * np.log1p(-draw(UNIFORM))))
        return b - np.concatenate([first, top], axis=1)

    return playing(path, steps), p


PROCESSES = (brownian, ornstein_uhlenbeck, chain, gap)
