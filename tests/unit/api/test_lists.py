"""Lists per row, masks and draws of pairs, and what their declarations refuse."""

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import (
    Autonomy,
    EasyAutonomy,
    Field,
    Input,
    Interaction,
    Message,
    MotionModel,
    Output,
    Param,
    Publish,
    RaggedColumn,
    Sensor,
    State,
    Subscribe,
)
from tussle.errors import DeclarationError, ParameterError, PluginError, WiringError
from tussle.stock import SphereNetwork, Still

POINTS = Field("x y", ragged=True)


# -- declarations -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: Output("range bearing", unit="m rad", ragged=True),
            r"Output: .*one channel, not 2.*fields='range bearing'",
        ),
        (lambda: Input(fields="x y"), r"Input: fields='x y' needs ragged=True"),
        (lambda: Input(ragged=True, default=1.0), r"Input: a ragged column .* takes no default"),
        (lambda: State(ragged=True, per="world"), r"State: a ragged column is per entity"),
        (lambda: State(ragged=True, default=2.0), r"it takes neither per nor default"),
        (
            lambda: type("M", (MotionModel,), {"path": Input(fields="x y", ragged=True)}),
            r"M\.path: in a motion model",
        ),
    ],
)
def test_lists_that_cannot_be_are_refused_where_they_stand(make, message):
    with pytest.raises(DeclarationError, match=message):
        make()


def test_a_list_is_one_channel_by_its_own_or_the_given_name():
    class Camera(Sensor):
        seen = Output(fields="x y", unit="m", ragged=True)
        other = Output("spotted", unit="m s", fields="x t", ragged=True)

    assert (Camera.seen.channels, Camera.seen.fields, Camera.seen.units) == (
        ("seen",),
        ("x", "y"),
        ("m", "m"),
    )
    assert (Camera.other.channels, Camera.other.units) == (("spotted",), ("m", "s"))


# -- the column -------------------------------------------------------------------------------------------------------------------


def column():
    return RaggedColumn.from_rows([[(1, 3), (2, 4)], [], [(5,), (6,)]], POINTS)


def test_lists_of_single_rows_are_replaced():
    lists = column()
    lists[1] = np.array([[7.0, 8.0, 9.0], [0.0, 0.0, 0.0]])
    lists[0] = []
    lists[..., -1] = [(1.0,), (2.0,)]
    assert lists[1].tolist() == [[7.0, 8.0, 9.0], [0.0, 0.0, 0.0]]
    assert lists[..., 0].shape == (2, 0)
    assert lists.start.tolist() == [0, 0, 3, 4]
    assert lists.data.tolist() == [[7.0, 8.0, 9.0, 1.0], [0.0, 0.0, 0.0, 2.0]]
    assert lists.row.tolist() == [1, 1, 1, 2]
    assert lists.count.tolist() == [0, 3, 1]


def test_a_list_of_another_shape_or_row_is_refused():
    with pytest.raises(ParameterError, match=r"row 1 has shape \(3, 2\); expected \(2, m\)"):
        column()[1] = np.zeros((3, 2))
    with pytest.raises(ParameterError, match=r"has shape \(1, 2\); expected \(m,\)"):
        RaggedColumn.from_rows([[(1, 2)]], Field(ragged=True))
    with pytest.raises(IndexError, match=r"row 3 .* 3 lists"):
        column()[3]


def test_what_was_set_does_not_change_with_its_source():
    lists, data = column(), np.ones((2, 3))
    lists.set([0, 1, 2, 3], data)
    data[:] = 0.0
    assert lists.data.tolist() == [[1.0] * 3] * 2


def test_lists_of_some_rows_are_put():
    lists = column()
    lists.put(np.array([2, 0]), RaggedColumn.from_rows([[], [(9,), (9,)]], POINTS))
    assert [lists[i].tolist() for i in range(3)] == [[[9.0], [9.0]], [[], []], [[], []]]


def test_a_view_for_readers_shows_what_is_written_and_cannot_be():
    lists = column()
    seen = lists.read_only()
    lists[1] = [(0.0,), (1.0,)]
    assert seen[1].tolist() == [[0.0], [1.0]]
    assert (len(seen), seen.count.tolist()) == (3, [2, 1, 1])
    for write in (lambda: seen.set(seen.start, seen.data), lambda: seen.__setitem__(0, [])):
        with pytest.raises(ValueError, match="read-only"):
            write()
    for array in (seen.data, seen[0], seen.start):
        with pytest.raises(ValueError, match="read-only"):
            array[..., 0] = 0


def test_reductions_over_each_rows_items():
    lists = column()
    assert lists.sum(lists.data).tolist() == [[3.0 + 1.0, 0.0, 5.0], [2.0 + 4.0, 0.0, 6.0]]
    assert lists.mean(lists.data[0]).tolist() == [2.0, 0.0, 5.0]
    assert lists.min(lists.data[0]).tolist() == [1.0, np.inf, 5.0]
    assert lists.argmin(-lists.data[0]).tolist() == [1, -1, 2]
    with pytest.raises(ParameterError, match=r"values of items have shape \(2,\); .*length 3"):
        lists.sum(np.zeros(2))


# -- pairs ------------------------------------------------------------------------------------------------------------------------


class Probe(Autonomy):
    """Calls a function of the test."""

    look = staticmethod(lambda g: None)
    calls = []  # noqa: RUF012 - of the test

    def step(self, g):
        self.calls.append(type(self).look(g))


def looking(look, *blocks, seeds=1, cls=Probe, **values):
    """What `look` gives in each step."""
    probe = type("Probe", (cls,), {"calls": [], "look": staticmethod(look)})
    mine = Block(name="p", count=4, variance=(100.0, 100.0, 0.0), autonomy=probe(), motion=Still())
    with Simulation(Mission(blocks=[mine, *blocks], end=0.3, **values), seeds=seeds) as sim:
        sim.run()
    return probe.calls


def others(n, name="o", **values):
    return Block(
        name=name, team=2, count=n, variance=(100.0, 100.0, 0.0), autonomy=Probe(), motion=Still(), **values
    )


def test_a_mask_keeps_pairs():
    def look(g):
        near = g.near(1e3)
        kept = near[near.team == 2]
        every = list(zip(near.row.tolist(), near.id.tolist(), near.distance.tolist(), strict=True))
        assert [(r, i, d) for r, i, d in every if i > 4] == list(
            zip(kept.row.tolist(), kept.id.tolist(), kept.distance.tolist(), strict=True)
        )
        assert kept.count.tolist() == [3] * 4
        assert kept.start.tolist() == [0, 3, 6, 9, 12]
        assert len(kept) == 12
        by_row = kept.distance.reshape(4, 3)
        assert kept.sum(kept.distance).tolist() == [a + b + c for a, b, c in by_row]
        assert kept.mean(kept.offset).shape == (3, 4)
        assert kept.nearest().tolist() == [3 * i + int(row.argmin()) for i, row in enumerate(by_row)]
        nobody = near[np.zeros(len(near), bool)]
        assert nobody.nearest().tolist() == [-1] * 4
        assert nobody.mean(nobody.vel).tolist() == [[0.0] * 4] * 3
        with pytest.raises(ParameterError, match=r"near\[...\] takes a boolean mask of shape \(24,\)"):
            near[0]

    looking(look, others(3))


def test_draws_of_pairs_belong_to_the_pair_alone():
    def look(g):
        near = g.near(1e3)
        few = near[near.distance < 12.0]
        draws = [
            dict(zip(zip(g.id[p.row], p.id, strict=True), g.normal_pairs("a", p), strict=True))
            for p in (near, few)
        ]
        assert all(draws[0][pair] == value for pair, value in draws[1].items())
        assert 0 < len(draws[1]) < len(draws[0])
        two = g.uniform_pairs("a", near, k=2)
        assert two.shape == (2, len(near))
        assert ((two >= 0.0) & (two < 1.0)).all()
        return draws[0], dict(zip(zip(g.id[near.row], near.id, strict=True), two[0], strict=True))

    few, many = looking(look, others(2)), looking(look, others(3))
    for before, after in zip(few, many, strict=True):
        for a, b in zip(before, after, strict=True):
            assert len(set(a.values())) == len(a)
            assert {pair: b[pair] for pair in a} == a
    assert few[0][0] != few[1][0]  # another step, another draw


def test_world_plugins_draw_for_pairs_too():
    class Dice(Interaction):
        """Rolls for each pair."""

        rolled = State(per="world")

        def step(self, w):
            near = w.near(1e3)
            np.add.at(self.rolled, w.world[near.row], w.uniform_pairs("dice", near))

    def rolled(seeds):
        with Simulation(Mission(blocks=[others(3)], interactions=[Dice()], end=0.3), seeds=seeds) as sim:
            sim.run()
            return sim.read("Dice.rolled")[0].tolist()

    stack = rolled([1, 2, 3])
    assert stack == [rolled(seed)[0] for seed in (1, 2, 3)]
    assert len(set(stack)) == 3


# -- the same form everywhere -------------------------------------------------------------------------------------------------------


class Route(Message):
    """Points."""

    places = Field("x y", unit="m", ragged=True)
    marks = Field()


class Speaker(EasyAutonomy):
    """Keeps, says and hears lists in easy mode."""

    corners = Param(((1.0, 2.0), (3.0, 4.0), (5.0, 6.0)), fields="x y", unit="m", ragged=True)
    kept = State("x y", unit="m", ragged=True)
    sizes = State("corners heard", dtype=int)
    said = Publish(Route)
    heard = Subscribe(Route)

    def step_one(self, me):
        me.kept = me.corners[:, : me.id]
        me.publish("said", places=me.kept, marks=me.id)
        me.sizes = me.corners.shape[1], sum(note.places.shape[1] for note in me.heard)


class Fence(Interaction):
    """Reads a list of its own."""

    corners = Param(((1.0, 2.0), (3.0, 4.0), (5.0, 6.0)), fields="x y", unit="m", ragged=True)
    east = State(per="world")

    def step(self, w):
        self.east[:] = [self.corners[world][0].sum() for world in range(w.n_worlds)]


def test_a_list_has_one_shape_in_group_world_and_easy_plugins_and_in_messages():
    block = Block(name="s", count=3, autonomy=Speaker(), motion=Still())
    with Simulation(Mission(blocks=[block], interactions=[Fence()], end=1.0), seeds=[1, 2]) as sim:
        sim.step(2)
        lists, _ = sim.read("s.Speaker.kept")
        assert [lists[1, i].tolist() for i in range(3)] == [
            [[1.0], [2.0]],
            [[1.0, 3.0], [2.0, 4.0]],
            [[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]],
        ]
        assert sim.read("s.Speaker.sizes")[0][0].tolist() == [[3, 6]] * 3
        assert sim.read("Fence.east")[0].tolist() == [9.0, 9.0]


def test_lists_of_easy_mode_that_are_not_ones_own_are_read_only():
    class Cheat(Speaker):
        def step_one(self, me):
            me.corners = [(0.0,), (0.0,)]

    block = Block(name="s", autonomy=Cheat(), motion=Still())
    with pytest.raises(PluginError, match=r"me.corners is read-only: it is a Param of Cheat"):
        Simulation(Mission(blocks=[block])).step()


def test_a_message_keeps_the_lists_that_were_sent():
    class Sender(Autonomy):
        kept = State("x y", unit="m", ragged=True)
        said = Publish(Route, network="late")

        def step(self, g):
            self.kept[0] = np.full((2, int(g.step_count[0]) + 1), float(g.step_count[0]))
            self.said.publish(np.arange(g.n), places=self.kept)

    class Hearer(Autonomy):
        heard = Subscribe(Route, network="late")
        log = []  # noqa: RUF012 - of the test

        def step(self, g):
            _, notes = self.heard.pairs()
            self.log.extend(notes.places[i].tolist() for i in range(notes.n))

    block = Block(name="s", autonomy=[Sender(), Hearer()], motion=Still())
    Simulation(Mission(blocks=[block], networks=[SphereNetwork(name="late", comm_delay=0.2)], end=0.7)).run()
    assert Hearer.log[:2] == [[[0.0], [0.0]], [[1.0, 1.0], [1.0, 1.0]]]


def test_a_world_plugin_keeps_no_lists():
    class Keeper(Interaction):
        kept = State("x", ragged=True)

        def step(self, w):
            pass

    with pytest.raises(DeclarationError, match=r"Keeper.kept: a world plugin has no ragged State columns"):
        Simulation(Mission(blocks=[others(1)], interactions=[Keeper()]))


def test_a_belief_is_no_list():
    class Dreamer(Sensor):
        belief_pos = Output(fields="x y z", unit="m", ragged=True)

        def step(self, g):
            pass

    with pytest.raises(WiringError, match=r"Dreamer.belief_pos is a list.* 3 channels"):
        Simulation(Mission(blocks=[others(1, sensor=Dreamer())]))
