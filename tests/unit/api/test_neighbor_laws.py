"""Neighbour laws: what an author writes, what comes out, and what is refused."""

import math
import re

import numpy as np
import pytest
from law_plugins import Every, play

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Interaction, Param, State, neighbors, together
from tussle.errors import DeclarationError, PluginError
from tussle.numeric import atan2, sincos
from tussle.numeric.kernel import device, kernel
from tussle.numeric.neighbors.lane_code import lane_code
from tussle.numeric.neighbors.lanes import load, number, store
from tussle.stock import Still

LIMIT = 3


UPDATES = pytest.mark.parametrize(
    "order", [{}, {"update": "sequential", "n": 60, "steps": 1}], ids=["synchronous", "sequential"]
)


@UPDATES
def test_a_law_is_its_function_called_for_each_pair_bit_for_bit(order):
    play(Every(), **order)


@UPDATES
def test_laws_together_are_the_laws_alone(order):
    class Both(Autonomy):
        wide = Param(30.0, unit="m")
        narrow = Param(12.0, unit="m")

        @neighbors("wide", n="count", x="sum")
        @staticmethod
        def everyone(offset_x):
            return True, offset_x

        @neighbors("wide", "narrow", teams="own", x="sum", top="max")
        @staticmethod
        def mates(offset_x, other_pos_z):
            return offset_x, other_pos_z

        @neighbors(20.0, teams="other", n="count")
        @staticmethod
        def others():
            return True

        @staticmethod
        def is_ahead(offset_y, forward_x, forward_y, offset_x):
            return forward_x * offset_x + forward_y * offset_y > 0.0

        every = together(everyone, mates, others)
        ahead = together(everyone, mates, where=is_ahead)

        def step(self, g):
            found = self.every(g)
            np.testing.assert_array_equal(found.values[:2], self.everyone(g).values)
            # Narrow alone has smaller cells, and the order of a sum is that of the cells.
            np.testing.assert_allclose(found.values[2:4], self.mates(g).values, atol=1e-9)
            np.testing.assert_array_equal(found.others_n, self.others(g).n)
            near = g.near(np.minimum(self.wide, self.narrow), teams="own")
            np.testing.assert_allclose(found.mates_x, near.sum(near.offset[0]), atol=1e-9)
            np.testing.assert_array_equal(found.others_n, g.near(20.0, teams="other").count)
            near = g.near(self.wide)
            heading = g.forward[:, near.row]
            counts = heading[0] * near.offset[0] + heading[1] * near.offset[1] > 0.0
            np.testing.assert_array_equal(self.ahead(g).everyone_n, near.sum(counts))
            assert order or 0 < self.ahead(g).everyone_n.sum() < found.everyone_n.sum()

    play(Both(), motion=Still(), **order)


def test_a_law_of_the_world_takes_its_parameters_world_by_world():
    class Crowded(Interaction):
        room = Param(5.0, unit="m")
        most = State(per="world")

        @neighbors("room", n="count")
        @staticmethod
        def close(distance, room):
            return distance < 0.5 * room

        def step(self, w):
            expected = np.bincount(w.near(0.5 * self.room[w.world]).row, minlength=w.n)
            np.testing.assert_array_equal(self.close(w).n, expected)
            assert expected.any()

    still = Block(name="still", count=200, variance=(100.0, 100.0, 1.0), motion=Still())
    mission = Mission(blocks=[still], interactions=[Crowded()], end=1.0)
    sim = Simulation(mission, [1, 2], {"Crowded.room": [4.0, 8.0]}, on_error="raise")
    sim.step()


@pytest.mark.parametrize("threads", [1, 3])
def test_a_law_lists_its_pairs(threads):
    class Meeting(Autonomy):
        sight = State(unit="m")

        @neighbors("sight", gap="each", mate="each", high="each")
        @staticmethod
        def meet(distance, id, other_id, team, other_team, other_pos_z):  # noqa: A002 - a column
            if id > other_id:
                return None
            return distance, team == other_team, other_pos_z

        @neighbors(0.0, none="each")
        @staticmethod
        def touch(offset_x):
            return offset_x

        def spawn(self, g, rows):
            self.sight[rows] = (12.0 * g.uniform("sight"))[rows]

        def step(self, g):
            near, met = g.near(self.sight), self.meet(g)
            counts = g.id[near.row] < near.id
            assert 0 < len(met) == counts.sum() < len(near)
            np.testing.assert_array_equal(met.row, near.row[counts])
            np.testing.assert_array_equal(met.other, near.other[counts])
            np.testing.assert_array_equal(met.gap, near.distance[counts])
            np.testing.assert_array_equal(met.mate, (g.team[near.row] == near.team)[counts])
            np.testing.assert_array_equal(met.values[2], near.pos[2][counts])
            assert len(self.touch(g)) == self.touch(g).none.size == 0

    play(Meeting(), n=2000, spread=60.0, motion=Still(), threads=threads)


# What a function may hold -------------------------------------------------------------------------------------------------


def halves(a, b):
    if a > b:
        return 0.5 * a, b
    return a, 0.5 * b


@device
def cubed(a):
    return a * a * a


def everything(a, b, c):
    """One of each that the lanes know."""
    low: float = min(a, b, 0.25)
    x, y = halves(a, b)
    x += LIMIT
    flag = a < b <= 2.0 or not c
    if flag and c > 0.0:
        x = -x
        inner = abs(a) if b > 0.0 else math.sqrt(abs(b))
    elif c == 0.0 and (a or b):
        pass
    else:
        inner = +cubed(b)
        y = a**2 / (b * b + 1)
    sine, cosine = sincos(a)
    if c > 1.5:
        return low, x, y, True, inner, sine
    return low or 1.0, x - low, flag, flag, atan2(a, b) if flag else cosine, bool(c) and a


def test_lanes_of_everything_that_a_law_may_hold():
    code = lane_code(everything)
    assert not code.can_skip
    function, masks = code.function, code.masks
    assert masks == (False, False, False, True, False, False)

    @kernel("F F F F2w")
    def run(a, b, c, out):
        one, two, three, four, five, six = function(load(a, 0), load(b, 0), load(c, 0))
        store(out[0], 0, one)
        store(out[1], 0, two)
        store(out[2], 0, three)
        store(out[3], 0, number(four))
        store(out[4], 0, five)
        store(out[5], 0, six)

    rng = np.random.default_rng(0)
    for _ in range(50):
        a, b, c = rng.integers(-8, 9, (3, 8)) / 4.0
        c = np.where(c == 0.0, 2.0, c)
        out = np.empty((6, 8))
        run(a, b, c, out)
        for k in range(8):
            expected = [float(value) for value in everything(float(a[k]), float(b[k]), float(c[k]))]
            np.testing.assert_array_equal(out[:, k], expected)


def loops(a):
    for _ in range(3):
        a = a + 1.0
    return a


def recursive(a):
    return recursive(a - 1.0) if a > 0.0 else a


def nothing(a):
    b = a  # noqa: F841


def uneven(a):
    if a > 0.0:
        return a, a
    return a


def sometimes(a):
    return a if a > 0.0 else sometimes_none(a)


def sometimes_none(a):
    if a > 1.0:
        return None
    return a


def with_default(a, b=1.0):
    return a + b


def names(a):
    return a + undefined  # noqa: F821


def texts(a):
    return a + "b"


def powers(a):
    return a**0.5


def remainders(a):
    return a % 2.0


def members(a):
    return a in (1.0, 2.0)


def named(a):
    return halves(a, b=a)


def unpacks(a):
    b, c, d = halves(a, a)
    return b + c + d


def pairs_as_one(a):
    return 1.0 + halves(a, a)


def calls(a):
    return str(a)


def items(a):
    return a[0]


def attributes(a):
    return np.random.default_rng.missing + a


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (loops, "`for`"), (recursive, "`recursive` calls itself"), (nothing, "nothing: it returns no value"),
        (uneven, "2 values in one branch and 1 in another"), (sometimes, "`sometimes_none` does not always return"),
        (with_default, "takes plain arguments"), (names, "`undefined` is not defined"), (texts, "`'b'` is not a number"),
        (powers, r"`a \*\* 0\.5`"), (remainders, "`a % 2.0`"), (members, r"`a in \(1\.0, 2\.0\)`"),
        (named, r"`halves\(a, b=a\)`"), (unpacks, r"2 values .*`\(?b, c, d\)?`"), (pairs_as_one, r"`halves\(a, a\)` .*2 values"),
        (calls, "`str`"), (items, r"`a\[0\]`"), (attributes, "`np.random.default_rng.missing`"),
        (eval("lambda a: a"), "(source not found|must be defined with `def`)"),
    ],
)  # fmt: skip
def test_what_lanes_cannot_do_is_refused_with_its_line(function, message):
    with pytest.raises(DeclarationError, match=r"(test_neighbor_laws\.py|<string>):\d+: .*" + message):
        lane_code(function)


# What a declaration may say -------------------------------------------------------------------------------------------------


def plugin(function, *radius, teams=None, where=None, **reductions):
    law = neighbors(*radius, teams=teams, **reductions)(function)
    content = {"sight": Param(5.0, unit="m"), "goal": Param((0.0, 0.0), fields="x y"), "law": law}
    return type("Wrong", (Autonomy,), content | ({"both": together(law, where=where)} if where else {}))


def test_a_misspelled_argument_is_refused_with_the_nearest_name():
    with pytest.raises(DeclarationError, match=r"Wrong\.law: 'ofset_x' .*did you mean 'offset_x'.*goal_y"):
        plugin(lambda ofset_x: ofset_x, "sight", x="sum")
    with pytest.raises(DeclarationError, match=r"'other_sped'"):
        plugin(lambda other_sped: other_sped, "sight", x="sum")
    with pytest.raises(DeclarationError, match=r"Wrong\.law: 'sigth' .*did you mean 'sight'"):
        plugin(lambda offset_x: offset_x, "sigth", x="sum")
    with pytest.raises(DeclarationError, match=r"Wrong\.both: 'goal_z' .*did you mean 'goal_y'"):
        plugin(lambda offset_x: offset_x, "sight", x="sum", where=lambda goal_z: goal_z > 0.0)


def test_wrong_reductions_and_teams_are_refused():
    with pytest.raises(DeclarationError, match=r"x='summ' .*did you mean 'sum'.*: sum, mean"):
        plugin(halves, "sight", x="summ")
    with pytest.raises(DeclarationError, match="radius"):
        plugin(halves, "sight")
    with pytest.raises(DeclarationError, match=r"teams='mine'.*'own' or 'other'"):
        plugin(halves, "sight", teams="mine", x="sum")
    with pytest.raises(DeclarationError, match="radius"):
        plugin(halves, x="sum")
    with pytest.raises(DeclarationError, match="'each' for all contributions or for none"):
        plugin(halves, "sight", x="sum", pair="each")
    with pytest.raises(DeclarationError, match="'each'"):
        plugin(halves, "sight", x="each", y="each", where=halves)


def test_another_number_of_contributions_is_refused():
    class Short(Autonomy):
        @neighbors(5.0, x="sum", n="count")
        @staticmethod
        def law(offset_x):
            return offset_x

        def step(self, g):
            self.law(g)

    with pytest.raises(PluginError, match=r"DeclarationError.*law: .* 1 contributions.* 2 are declared: x"):
        play(Short(), motion=Still())


def test_a_misspelled_contribution_is_an_error_with_the_nearest_name():
    class Reader(Autonomy):
        @neighbors(5.0, speed="sum")
        @staticmethod
        def law(offset_x):
            return offset_x

        def step(self, g):
            assert [len(row) for row in self.law(g)] == [g.n]
            assert "sum" not in repr(type(self).law.__doc__)
            with pytest.raises(
                AttributeError, match=re.escape("no contribution 'sped' (did you mean 'speed'?)")
            ):
                self.law(g).sped  # noqa: B018

    play(Reader(), motion=Still())
