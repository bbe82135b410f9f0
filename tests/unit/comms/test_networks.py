"""Who hears what, and when."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest
from small_worlds import (
    Delivery,
    EasyListener,
    Listener,
    Note,
    NoteMetric,
    Reaper,
    Talker,
    alone,
    block,
    mission,
)

from tussle import Simulation
from tussle.api import Autonomy, Interaction, Links, Network, Param, Publish, State, Subscribe, service
from tussle.errors import MissionError, ParameterError, PluginError, TussleError, WiringError
from tussle.stock import FailingRadio, GlobalNetwork, LocalNetwork, RadioNetwork, SphereNetwork


def still(name, *autonomies, **values):
    from small_worlds import Drift

    return block(name, autonomy=[Drift(to=(0, 0, 0)), *autonomies], **values)


def heard(sim, path, column="n_heard"):
    return sim.read(f"{path}.{column}")[0]


def test_global_network_reaches_everybody_of_the_world_and_the_sender_itself():
    game = mission(
        still("talker", Talker(last=1), Listener()),
        still("others", Listener(), count=3, position=(1e6, 0, 0)),
    )
    sim = Simulation(game, seeds=[1, 2])
    sim.run()
    assert heard(sim, "talker.Listener").tolist() == [[1], [1]]
    assert heard(sim, "others.Listener").tolist() == [[1, 1, 1], [1, 1, 1]]
    assert heard(sim, "others.Listener", "sender").tolist() == [[1, 1, 1], [1, 1, 1]]


def test_a_message_is_read_at_the_receivers_next_call():
    sim = Simulation(mission(still("a", Talker(first=3, last=4)), still("b", Listener())))
    sim.run()
    assert heard(sim, "b.Listener", "value")[0, 0] == 3
    assert heard(sim, "b.Listener", "read_in")[0, 0] == 4


def test_local_network_reaches_only_the_sender():
    local = [Talker(network="LocalNetwork"), Listener(network="LocalNetwork")]
    game = mission(
        still("pair", *local, count=2),
        still("deaf", Listener(network="LocalNetwork")),
        networks=[LocalNetwork()],
    )
    sim = alone(game, 1)
    assert heard(sim, "pair.Listener").tolist() == [[9, 9]]
    assert heard(sim, "pair.Listener", "sender").tolist() == [[1, 2]]
    assert heard(sim, "deaf.Listener").tolist() == [[0]]


@pytest.mark.parametrize(("place", "expected"), [(99.999999, 9), (100.0, 0), (100.000001, 0)])
def test_sphere_network_ends_strictly_before_its_range(place, expected):
    game = mission(
        still("a", Talker(network="SphereNetwork"), Listener(network="SphereNetwork")),
        still("b", Listener(network="SphereNetwork"), position=(0, place, 0)),
        networks=[SphereNetwork(range=100.0)],
    )
    sim = alone(game, 1)
    assert heard(sim, "b.Listener").tolist() == [[expected]]
    assert heard(sim, "a.Listener").tolist() == [[9]]


def test_range_is_a_parameter_per_world():
    game = mission(
        still("a", Talker(network="SphereNetwork")),
        still("b", Listener(network="SphereNetwork"), position=(0, 50.0, 0)),
        networks=[SphereNetwork()],
    )
    sim = Simulation(game, seeds=[1, 2], params={"SphereNetwork.range": [40.0, 60.0]})
    sim.run()
    assert heard(sim, "b.Listener").tolist() == [[0], [9]]


def test_plane_filter_keeps_words_on_their_side_of_the_surface():
    def run(z, **values):
        network = SphereNetwork(filter_comms_plane=True, **values)
        game = mission(
            still("a", Talker(network="SphereNetwork"), position=(0, 0, 5)),
            still("b", Listener(network="SphereNetwork"), position=(0, 0, z)),
            networks=[network],
        )
        return int(heard(alone(game, 1), "b.Listener")[0, 0])

    assert run(-5.0) == 0
    assert run(3.0) == 9
    assert run(-5.0, comms_boundary_epsilon=6.0) == 9
    assert run(-5.0, comms_boundary_altitude=20.0) == 9


def lossy(count=100, p=0.3, **values):
    return mission(
        still("talker", Talker(network="SphereNetwork"), position=(0, 0, 0)),
        still("crowd", Listener(network="SphereNetwork"), count=count),
        networks=[SphereNetwork(range=1e9, prob_transmit=p)],
        end=4.0,
        **values,
    )


def test_share_of_messages_that_arrive_is_prob_transmit():
    n = heard(alone(lossy(), 5), "crowd.Listener")[0]
    sent = 39 * 100
    # Binomial: five standard deviations.
    assert abs(n.sum() - 0.3 * sent) < 5.0 * np.sqrt(sent * 0.3 * 0.7)
    assert n.std() > 1.0
    assert heard(alone(lossy(p=0.0), 5), "crowd.Listener").sum() == 0
    assert heard(alone(lossy(p=1.0), 5), "crowd.Listener").sum() == sent


def test_losses_are_the_same_in_a_stack_and_whoever_else_talks():
    first = heard(alone(lossy(), 5), "crowd.Listener")[0]
    stack = Simulation(lossy(), seeds=[4, 5, 6])
    stack.run()
    assert np.array_equal(heard(stack, "crowd.Listener")[1], first)
    assert not np.array_equal(heard(stack, "crowd.Listener")[0], first)
    more = lossy()
    more = more.replace(blocks=[*more.blocks, still("other", Talker(network="SphereNetwork", topic="Other"))])
    assert np.array_equal(heard(alone(more, 5), "crowd.Listener")[0], first)


def test_messages_of_one_sender_on_two_topics_are_lost_independently():
    radio = {"network": "SphereNetwork"}
    talkers = Talker(**radio), Talker(topic="Other", name="Second", **radio)
    listeners = Listener(**radio), Listener(topic="Other", name="Second", **radio)
    networks = [SphereNetwork(prob_transmit=0.5)]
    sim = alone(mission(still("a", *talkers), still("b", *listeners, count=30), networks=networks), 5)
    assert not np.array_equal(heard(sim, "b.Listener"), heard(sim, "b.Second"))


@pytest.mark.parametrize(("delay", "read_in"), [(0.0, 3), (0.1, 4), (0.25, 6), (0.3, 6), (0.5, 8)])
def test_a_delayed_message_arrives_on_time_though_nobody_talks_any_more(delay, read_in):
    """Said in step 2; handed over at the end of the first step at or after t + delay, read in the next."""
    game = mission(
        still("a", Talker(first=2, last=3, network="slow")),
        still("b", Listener(network="slow")),
        networks=[GlobalNetwork(name="slow", comm_delay=delay)],
    )
    sim = alone(game, 1)
    assert heard(sim, "b.Listener", "read_in").tolist() == [[read_in]]
    assert heard(sim, "b.Listener", "value").tolist() == [[2]]
    assert heard(sim, "b.Listener").tolist() == [[1]]


def test_a_message_on_its_way_when_the_sender_is_gone_still_arrives():
    game = mission(
        still("a", Talker(first=2, last=3, network="slow"), team=1),
        still("b", Listener(network="slow"), team=2),
        networks=[GlobalNetwork(name="slow", comm_delay=0.4)],
        interactions=[Reaper(team=1, at=0.4)],
    )
    assert heard(alone(game, 1), "b.Listener", "read_in").tolist() == [[7]]


def test_delay_is_a_parameter_per_world():
    game = mission(
        still("a", Talker(first=2, last=3, network="slow")),
        still("b", Listener(network="slow")),
        networks=[GlobalNetwork(name="slow")],
    )
    sim = Simulation(game, seeds=[1, 2], params={"slow.comm_delay": [0.1, 0.4]})
    sim.run()
    assert heard(sim, "b.Listener", "read_in").tolist() == [[4], [7]]


def test_world_plugins_read_in_the_same_step_the_last_one_included():
    sim = alone(mission(still("a", Talker()), metrics=[NoteMetric()]), 1)
    assert sim.result()[0].metrics["NoteMetric"] == {"n_notes": 10, "total": 45}


def test_what_only_the_world_says_is_counted_once():
    """No plugin of any entity has a topic here; the first one appears when the world speaks."""

    class Herald(Interaction):
        def step(self, w):
            w.publish(Note, np.flatnonzero(w.step_count == 2), value=7)

    sim = alone(mission(block(), interactions=[Herald()], metrics=[NoteMetric()]), 1)
    assert sim.result()[0].metrics["NoteMetric"] == {"n_notes": 1, "total": 7}


def test_what_the_world_says_reaches_subscribers_with_sender_0():
    class Herald(Interaction):
        def step(self, w):
            w.publish(Note, np.flatnonzero(w.step_count == 2), value=7)

    sim = alone(mission(still("b", Listener()), interactions=[Herald()]), 1)
    assert heard(sim, "b.Listener", "value").tolist() == [[7]]
    assert heard(sim, "b.Listener", "sender").tolist() == [[0]]
    assert heard(sim, "b.Listener", "read_in").tolist() == [[3]]


def test_easy_mode_hears_what_vector_mode_hears():
    sim = alone(mission(still("a", Talker(), count=3), still("b", EasyListener(), Listener())), 1)
    for column in ("n_heard", "value", "sender"):
        assert heard(sim, "b.EasyListener", column).tolist() == heard(sim, "b.Listener", column).tolist()
    assert heard(sim, "b.EasyListener")[0, 0] == 27
    assert heard(sim, "b.EasyListener", "sender")[0, 0] == 3


def test_a_receiver_with_a_rate_hears_all_since_its_last_call():
    sim = Simulation(mission(still("a", Talker()), still("b", Listener(rate=2.5))))
    counts = []
    while not sim.is_over:
        sim.step()
        counts.append(int(heard(sim, "b.Listener")[0, 0]))
    # Called in steps 0, 4 and 8, where the messages of the steps before have arrived.
    assert counts == [0, 0, 0, 0, 4, 4, 4, 4, 8, 8]
    assert heard(sim, "b.Listener", "total")[0, 0] == sum(range(8))


def test_an_entity_hears_nothing_said_before_it_came_whatever_happens_in_other_worlds():
    """In one world of the stack the group is empty until 0.5 s; alone, the whole group is."""
    late = still("b", Listener(), rate=0.01, first_birth=0.5)
    early = still("c", Listener(), rate=0.01, first_birth=0.0)
    sim = alone(mission(still("a", Talker()), late), 1)
    assert heard(sim, "b.Listener", "n_heard")[0, 0] == 4  # those of steps 5 to 8
    both = alone(mission(still("a", Talker()), late, early), 1)
    assert heard(both, "b.Listener", "n_heard")[0, 0] == 4


def test_topic_and_network_can_be_parameters():
    quiet = Talker(topic="Quiet", name="Quiet")
    game = mission(
        still("a", Talker(topic="Loud"), quiet, Talker(network="other", topic="Loud", name="Far")),
        still("b", Listener(topic="Loud"), Listener(topic="Quiet", network="other", name="Nothing")),
        networks=[GlobalNetwork(name="other")],
    )
    with pytest.warns(
        RuntimeWarning,
        match="'Quiet' is published on network 'GlobalNetwork' and subscribed to on network 'other'",
    ):
        sim = alone(game, 1)
    assert heard(sim, "b.Listener").tolist() == [[9]]
    assert heard(sim, "b.Nothing").tolist() == [[0]]


def test_a_network_that_is_not_there_is_refused():
    with pytest.raises(
        WiringError, match=r"block 'a'.*network 'LocalNetwrk' \(did you mean 'LocalNetwork'\?\)"
    ):
        Simulation(mission(still("a", Talker(network="LocalNetwrk")), networks=[LocalNetwork()]))


def test_one_topic_carries_one_type():
    class Shout(Autonomy):
        shouts = Publish(Delivery, topic="Note")

        def step(self, g):
            pass

    with pytest.raises(WiringError, match="topic 'Note' on GlobalNetwork carries Note, not Delivery"):
        Simulation(mission(still("a", Talker(), Shout())))


def test_a_network_that_answers_nonsense_is_told_so_and_named():
    class Odd(Network):
        def route(self, w, messages):
            return "everybody"

    game = mission(still("a", Talker(network="Odd")), still("b", Listener(network="Odd")), networks=[Odd()])
    with pytest.raises((WiringError, PluginError), match=r"Odd.*'everybody'.*EVERYONE, SAME_ENTITY"):
        Simulation(game).step()


def test_a_network_that_raises_is_named():
    class Jammed(Network):
        def route(self, w, messages):
            raise OSError("jammed")

    game = mission(
        still("a", Talker(network="Jammed")), still("b", Listener(network="Jammed")), networks=[Jammed()]
    )
    with pytest.raises(PluginError, match=r"test_networks.py:\d+: OSError: jammed") as caught:
        Simulation(game, seeds=[1, 2]).run()
    assert caught.value.plugin == "Jammed"


def test_messages_to_everyone_are_not_expanded():
    """2,000 senders and as many receivers would make four million pairs, 64 MB."""

    class Crowd(Autonomy):
        x = State(unit="m")
        said, told = Publish(Note), Subscribe(Note)

        def step(self, g):
            rows, notes = self.told.latest()
            self.x[rows] = notes.value
            self.said.publish(np.arange(g.n), value=g.id)

    sim = Simulation(mission(still("a", Crowd(), count=2000)))
    sim.step(2)
    tracemalloc.start()
    sim.step()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 4e6
    assert (sim.read("a.Crowd.x")[0] == 2000).all()


@pytest.mark.parametrize("network", ["GlobalNetwork", "LocalNetwork", "SphereNetwork"])
def test_the_last_of_all_pairs_is_the_latest(network):
    class Check(Autonomy):
        n = State(dtype=int)
        told = Subscribe(Note, network_param="network")
        network = Param("GlobalNetwork")

        def step(self, g):
            rows, notes = self.told.pairs()
            last = np.flatnonzero(np.append(rows[1:] != rows[:-1], True)) if len(rows) else rows
            latest_rows, latest = self.told.latest()
            assert latest_rows.tolist() == rows[last].tolist()
            assert latest.value.tolist() == notes.value[last].tolist()
            by_row = self.told.by_row()
            one_by_one = [batch.value[i] for row in range(g.n) for batch, i in by_row(row)]
            assert one_by_one == notes.value.tolist()
            self.n[:] += len(rows)

    talkers = still(
        "a", Talker(network=network), Check(network=network, rate=4.0), count=5, variance=(900.0, 900.0, 0.0)
    )
    late = still(
        "b", Talker(network=network), Check(network=network), count=3, rate=5.0, variance=(400.0, 400.0, 0.0)
    )
    networks = [SphereNetwork(range=30.0)] if network == "SphereNetwork" else []
    sim = Simulation(mission(talkers, late, networks=networks), seeds=[1, 2, 3])
    sim.run()
    assert (sim.read("a.Check.n")[0] > 0).all()


def test_a_network_without_a_route_is_told_so():
    class Dumb(Network):
        pass

    game = mission(
        still("a", Talker(network="Dumb")), still("b", Listener(network="Dumb")), networks=[Dumb()]
    )
    with pytest.raises(PluginError, match="Dumb has no route"):
        Simulation(game).step()


@pytest.mark.parametrize(
    ("route", "text"),
    [
        ((0, 6), r"Own.route: rows = 6 is not allowed; it takes whole numbers from 0 to 5"),
        ((0, -1), r"Own.route: rows = -1, as of a removed entity, is not allowed"),
        ((0, 0.5), r"Own.route: rows = an array of float64, \(1,\) is not allowed"),
        ((4, 0), r"Own.route: message numbers = 4 is not allowed; it takes whole numbers from 0 to 3"),
        (([0, 1], [2]), r"Own.route: 2 message numbers and 1 rows; it returns one row per message number"),
        (
            (0, 5),
            r"Own.route: message 0, of world 0, goes to row 5, of world 1; messages stay in their world",
        ),
        (([0, 3], [1, 0]), r"Own.route: message 3, of world 1, goes to row 0, of world 0"),
        ("none", r"Own.route returned 'none'; it must return EVERYONE"),
    ],
)
def test_a_route_that_cannot_be_is_told_of_the_network(route, text):
    class Own(Network):
        def route(self, w, messages):
            return route

    game = mission(
        still("a", Talker(network="Own"), count=2), still("b", Listener(network="Own")), networks=[Own()]
    )
    with pytest.raises(PluginError, match=f"^Own, step 0: {text}"):
        Simulation(game, seeds=[1, 2]).run()


class Sender(Autonomy):
    deliveries = Publish(Delivery)

    def step(self, g):
        rows = np.flatnonzero(g.step_count == 1)
        points = [np.repeat([[1.0], [2.0]], i % 3, axis=1) for i in g.id[rows]]
        self.deliveries.publish(
            rows, value=g.id[rows] * 10, points=points, thing=[{"id": int(i)} for i in g.id[rows]]
        )


class Receiver(Autonomy):
    deliveries = Subscribe(Delivery)
    n_points = State(dtype=int)
    sum_y = State()
    ids = State(dtype=int)

    def step(self, g):
        rows, heard_ = self.deliveries.pairs()
        for i, row in enumerate(rows):
            self.n_points[row] += heard_.points[i].shape[1]
            self.sum_y[row] += heard_.points[i][1].sum()
            self.ids[row] += heard_.thing[i]["id"]


@pytest.mark.parametrize("delay", [0.0, 0.3])
def test_messages_carry_lists_and_objects(delay):
    game = mission(
        still("a", Sender(), count=5),
        still("b", Receiver(), count=2),
        networks=[GlobalNetwork(comm_delay=delay)],
    )
    sim = alone(game, 1)
    assert sim.read("b.Receiver.n_points")[0].tolist() == [[6, 6]]  # 1 + 2 + 0 + 1 + 2
    assert sim.read("b.Receiver.sum_y")[0].tolist() == [[12.0, 12.0]]
    assert sim.read("b.Receiver.ids")[0].tolist() == [[15, 15]]


def test_services_are_called_by_name():
    class Lamp(Autonomy):
        level = State(default=2.0)

        @service
        def brightness(self, g):
            return 3.0 * self.level

        def step(self, g):
            pass

    class Weather(Interaction):
        wind = Param(4.0)

        @service
        def wind_speed(self, world):
            return self.wind[world]

    class Asker(Autonomy):
        seen = State()
        wind = State()

        def step(self, g):
            self.seen[:] = g.call("brightness")
            self.wind[:] = g.call("wind_speed", g.world)

    sim = Simulation(
        mission(still("a", Lamp(), Asker(), count=2), interactions=[Weather()]),
        seeds=[1, 2],
        params={"Weather.wind": [5.0, 6.0]},
    )
    sim.run()
    assert sim.read("a.Asker.seen")[0].tolist() == [[6.0, 6.0], [6.0, 6.0]]
    assert sim.read("a.Asker.wind")[0].tolist() == [[5.0, 5.0], [6.0, 6.0]]

    class Lost(Autonomy):
        def step(self, g):
            g.call("brightnes")

    with pytest.raises(
        PluginError, match=r"no plugin offers a service 'brightnes' \(did you mean 'brightness'\?\)"
    ):
        Simulation(mission(still("a", Lamp(), Lost()))).step()


def test_a_world_plugin_does_not_subscribe():
    class Spy(Interaction):
        notes = Subscribe(Note)

    with pytest.raises(WiringError, match=r"Spy.notes.*w.inbox\(Note\)"):
        Simulation(mission(still("a"), interactions=[Spy()]))


def test_a_service_that_is_nowhere_is_an_error_for_world_plugins_too():
    class Caller(Interaction):
        def step(self, w):
            w.call("nothing")

    with pytest.raises(TussleError, match="no plugin offers a service 'nothing'; there are none"):
        Simulation(mission(still("a"), interactions=[Caller()])).step()


def test_capture_of_names_that_are_not_there():
    class Misspelt(Autonomy):
        notes = Publish(Note)

        def step(self, g):
            self.notes.publish([0], valu=3)

    with pytest.raises(PluginError, match=r"Note has no field 'valu' \(did you mean 'value'\?\)"):
        Simulation(mission(still("a", Misspelt()))).step()


def test_publishing_to_a_network_that_is_not_there():
    class Herald(Interaction):
        def step(self, w):
            w.publish(Note, [0], network="Nowhere", value=7)

    with pytest.raises(TussleError, match=r"network 'Nowhere'.*there are: GlobalNetwork"):
        Simulation(mission(still("a"), interactions=[Herald()])).step()


def test_two_networks_of_one_name_are_refused():
    with pytest.raises(MissionError, match="two plugins are called 'SphereNetwork'"):
        mission(still("a"), networks=[SphereNetwork(), SphereNetwork(range=5.0)])


def test_prob_transmit_is_a_probability():
    with pytest.raises(ParameterError, match=r"SphereNetwork.prob_transmit = 1.5 is not allowed"):
        SphereNetwork(prob_transmit=1.5)


class Own(Network):
    """A network of one's own, which `changes` its links."""

    changes = staticmethod(lambda links: links)

    def transmit(self, w, outboxes):
        return self.changes(Links(w, outboxes, np.inf))


def with_network(network, **values):
    name = type(network).__name__
    return mission(
        still(
            "a",
            Talker(network=name),
            Listener(network=name),
            count=3,
            placement="uniform",
            half_width=(20.0, 20.0, 20.0),
        ),
        still("b", Listener(network=name), position=(30.0, 0.0, 0.0)),
        networks=[network],
        **values,
    )


@pytest.mark.parametrize(
    ("change", "losses", "text"),
    [
        (lambda links: None, (), "transmit returned None; it must return Links, or a list"),
        (lambda links: links.lose(0, links.distance > 1), (), "reason number 0; in losses there are none"),
        (lambda links: links.lose(2, links.distance > 1), ("far",), r"reason number 2; in losses there are: 0 \(far\)"),
        (lambda links: links.lose(0, [True]), ("far",), r"lose: where is bool of shape \(1,\); it takes truth values, \(\d+,\)"),
        (lambda links: links.keep(links.distance), (), "keep: where is float64 of shape .*; it takes truth values"),
        (lambda links: setattr(links, "delay", 0.1), (), r"delay = 0.1; it takes numbers \[s\], \(\d+,\), one per link"),
        (lambda links: setattr(links, "delay", links.distance * np.nan), (), "delay = array.*; it takes numbers"),
        (lambda links: setattr(links, "delay", ["x"] * len(links.distance)), (), "delay = .*; it takes numbers"),
    ],
)  # fmt: skip
def test_what_a_network_returns_is_checked(change, losses, text):
    def changes(self, links):
        return None if change(links) is None and text.startswith("transmit returned None") else links

    own = type("Own", (Own,), {"changes": changes, "losses": losses})()
    with Simulation(with_network(own)) as simulation, pytest.raises(PluginError, match=text):
        simulation.step(3)


def test_a_network_without_losses_needs_no_counts():
    with Simulation(with_network(Own())) as simulation:
        simulation.run()
        assert heard(simulation, "b.Listener").tolist() == [[27]]


@pytest.mark.parametrize("network", [SphereNetwork, RadioNetwork, FailingRadio])
def test_no_bound_of_a_parameter_makes_a_network_compute_nonsense(network):
    """Warnings of NumPy, as of inf - inf, are errors."""
    for name, column in network.params().items():
        if column.dtype is not float or column.is_text:
            continue
        for bound in {column.ge, column.le, column.gt and 2 * column.gt, 1e-30, 1e30, math.inf, -math.inf} - {
            None
        }:
            if column.is_within(bound):
                with Simulation(with_network(network(**{name: bound}), end=0.3)) as simulation:
                    simulation.run()
