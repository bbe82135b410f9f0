"""RadioNetwork: range, fading, jammers, air time; counts of links and topics."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from tussle import Block, Mission, Recorder, Simulation, load_run
from tussle.api import Autonomy, Field, Message, Param, Publish, State, Subscribe
from tussle.batch import Batch
from tussle.batch.executors import InProcess
from tussle.batch.report import sections_of
from tussle.batch.report.report_data import ReportData
from tussle.cli import terminal
from tussle.cli.summary import Speed, show_summary
from tussle.errors import ParameterError, RecordError
from tussle.stock import GlobalNetwork, RadioNetwork, SphereNetwork, Still


class Report(Message):
    """Nine numbers: 100 bytes with the headers of UDP."""

    values = Field("a b c d e f g h")
    number = Field(dtype=int)


class Radio(Autonomy):
    """Sends reports in the steps [first, last), and counts what it receives."""

    grade = "portable"
    first = Param(0)
    last = Param(1_000_000)
    times = Param(1, structural=True)
    network = Param("RadioNetwork")
    n_heard = State(dtype=int)
    step_read = State(dtype=int, default=-1)
    reports = Publish(Report, network_param="network")
    heard = Subscribe(Report, network_param="network")

    def step(self, g):
        sends = np.flatnonzero((g.step_count >= self.first) & (g.step_count < self.last))
        for _ in range(self.times):
            self.reports.publish(sends, number=g.step_count[sends])
        rows, _ = self.heard.pairs()
        np.add.at(self.n_heard, rows, 1)
        self.step_read[rows] = g.step_count[rows]


def still(name, x, count=1, team=1, **radio):
    autonomy = Radio(**radio) if radio else ()
    return Block(
        name=name,
        team=team,
        count=count,
        position=(x, 0.0, 0.0),
        variance=(0.0, 0.0, 0.0),
        motion=Still(),
        autonomy=autonomy,
    )


def talks(name, x, **values):
    return still(name, x, first=0, **values)


def hears(name, x, **values):
    return still(name, x, first=10**6, **values)


def play(*blocks, seed=1, end=1.0, **radio):
    """The simulation at its end, and the result of its network."""
    mission = Mission(blocks=list(blocks), networks=[RadioNetwork(**radio)], end=end, end_conditions="time")
    sim = Simulation(mission, seed)
    return sim, sim.run()[0].metrics["RadioNetwork"]


def n_heard(sim, name):
    return int(sim.read(f"{name}.Radio.n_heard")[0].sum())


def is_near(found, share, n):
    """Whether a number of n independent events is within five standard deviations of its expectation."""
    return abs(found - share * n) <= 5.0 * np.sqrt(n * share * (1.0 - share))


def test_share_of_messages_received_decreases_with_distance_by_rayleighs_law():
    distances = {"b": 50.0, "c": 100.0, "d": 150.0, "far": 300.0}
    blocks = talks("a", 0.0, last=10), *(hears(name, x, count=100) for name, x in distances.items())
    sim, found = play(*blocks, end=1.1, fading="rayleigh")
    for name, distance in distances.items():
        assert is_near(n_heard(sim, name), np.exp(-((distance / 100.0) ** 2)) * (distance < 214.0), 1000)
    # Less than one message in a hundred is received at 300 m: out of reach, so the link is not counted.
    assert found["sent"] == 3000 == found["delivered"] + found["lost_fading"]
    _, steep = play(talks("a", 0.0), hears("b", 50.0, count=100), fading="rayleigh", path_loss_exponent=4.0)
    assert is_near(steep["delivered"], np.exp(-(0.5**4)), 1000)


def test_a_jammer_shortens_the_range_by_the_ratio_of_signal_to_noise():
    """A jammer at a third of its range adds 9 to a noise of 1: the range is divided by the root of 10."""
    jammer = still("j", -100.0 / 3.0, team=2)
    for distance, outcome in ((31.0, "delivered"), (32.0, "lost_jammed")):
        blocks = talks("t", distance), hears("r", 0.0), jammer
        assert play(*blocks, jammer_team=2)[1][outcome] == 10
        assert play(*blocks)[1]["delivered"] == 10
        assert play(*blocks, jammer_team=2, jammer_range=33.0)[1]["delivered"] == 10


def test_a_jammer_multiplies_the_exponent_of_rayleighs_law():
    blocks = talks("t", 0.0), hears("r", 40.0, count=100), still("j", 90.0, team=7)
    _, found = play(*blocks, fading="rayleigh", jammer_team=7)
    assert found["sent"] == 1000  # the jammer itself has no receiver
    assert is_near(found["delivered"], np.exp(-5.0 * 0.4**2), 1000)
    assert is_near(found["lost_fading"], 1.0 - np.exp(-(0.4**2)), 1000)


def test_messages_of_100_bytes_wait_for_the_transmitter():
    """At 4,000 bit/s a message takes 0.2 s: the first is on the air until 0.2 s, the second until 0.4 s."""
    blocks = talks("a", 0.0, last=1, times=1), hears("b", 10.0)
    assert play(*blocks, bandwidth=4000.0)[0].read("b.Radio.step_read")[0][0, 0] == 2
    blocks = talks("a", 0.0, last=1, times=2), hears("b", 10.0)
    assert play(*blocks, bandwidth=4000.0)[0].read("b.Radio.step_read")[0][0, 0] == 4
    # 7 bytes more make 0.214 s: the next step.
    assert play(*blocks, bandwidth=4000.0, overhead=35.0)[0].read("b.Radio.step_read")[0][0, 0] == 5
    blocks = talks("a", 0.0, last=1, times=5), hears("b", 10.0)
    _, found = play(*blocks, bandwidth=4000.0, queue_limit=100.0)
    assert (found["lost_queue"], found["delivered"]) == (3, 2)


def test_a_full_transmitter_sends_at_its_bandwidth():
    blocks = talks("a", 0.0, times=2), hears("b", 10.0)
    sim, found = play(*blocks, end=20.0, bandwidth=8000.0, queue_limit=450.0)
    # 10 messages a second; five wait at the end, the last one needs a step to be read.
    assert 193 <= n_heard(sim, "b") <= 200
    assert 200 <= found["delivered"] <= 206
    assert found["sent"] == 400


def test_a_signal_takes_its_time_by_the_distance():
    """Sound in water, 1,500 m/s: 1 s to 1,500 m, besides 0.2 s on the air at 4,000 bit/s."""
    blocks = talks("a", 0.0, last=1), *(hears(f"r{x}", float(x)) for x in (0, 140, 160, 1500, 3000))
    for bandwidth, steps in ((np.inf, (1, 1, 2, 10, 20)), (4000.0, (2, 3, 4, 12, 22))):
        sim, found = play(*blocks, end=3.0, range=5000.0, propagation_speed=1500.0, bandwidth=bandwidth)
        read = [sim.read(f"r{x}.Radio.step_read")[0][0, 0] for x in (0, 140, 160, 1500, 3000)]
        assert read == list(steps)
        assert found["delivered"] == 5


def test_who_sends_while_a_signal_arrives_does_not_receive_it_in_half_duplex():
    """Both send for 0.2 s in the first step. At 1,500 m the other's signal arrives a second later, when nobody sends."""
    sends = {"bandwidth": 4000.0, "half_duplex": True, "range": 5000.0}
    blocks = talks("a", 0.0, last=1), talks("b", 1500.0, last=1)
    assert play(*blocks, end=3.0, **sends)[1]["lost_half_duplex"] == 2
    assert play(*blocks, end=3.0, propagation_speed=1500.0, **sends)[1]["delivered"] == 2
    # One that has eight messages to send, for 1.6 s, does not hear the other's; its own arrive while the other listens.
    busy = talks("a", 0.0, last=1, times=8), talks("b", 1500.0, last=1)
    found = play(*busy, end=5.0, propagation_speed=1500.0, **sends)[1]
    assert (found["lost_half_duplex"], found["delivered"]) == (1, 8)


@pytest.mark.parametrize("half_duplex", [False, True])
def test_senders_that_share_the_bandwidth_use_it_in_turn(half_duplex):
    """Five senders and two messages each: 100 bytes take 0.1 s at 8,000 bit/s, so the last one is received after 1 s."""
    blocks = talks("a", 0.0, count=5, last=1, times=2), hears("b", 10.0)
    options = {"bandwidth": 8000.0, "half_duplex": half_duplex}
    sim, found = play(*blocks, end=3.0, shared_bandwidth=True, **options)
    assert sim.read("b.Radio.step_read")[0][0, 0] == 10
    assert n_heard(sim, "b") == 10
    assert found["lost_half_duplex"] == 0
    alone = play(*blocks, end=3.0, **options)[0]
    assert alone.read("b.Radio.step_read")[0][0, 0] in (2, 3)
    # Together they send no more than the channel takes: 10 messages a second.
    many = talks("a", 0.0, count=5), hears("b", 10.0)
    sim, _ = play(*many, end=10.0, shared_bandwidth=True, **options)
    assert 97 <= n_heard(sim, "b") <= 100
    assert n_heard(play(*many, end=10.0, bandwidth=8000.0)[0], "b") > 400


def test_worlds_of_a_stack_do_not_share_a_channel():
    blocks = [talks("a", 0.0, count=5, last=1, times=2), hears("b", 10.0)]
    mission = Mission(
        blocks=blocks, networks=[RadioNetwork(bandwidth=8000.0, shared_bandwidth=True)], end=3.0, end_conditions="time"
    )  # fmt: skip
    with Simulation(mission, seeds=[1, 2, 3]) as stack:
        hashes = [result.state_hash for result in stack.run()]
        assert stack.read("b.Radio.step_read")[0][:, 0].tolist() == [10, 10, 10]
    alone = [Simulation(mission, seed).run()[0].state_hash for seed in (1, 2, 3)]
    assert hashes == alone


def test_senders_that_talk_at_the_same_time_do_not_hear_each_other_in_half_duplex():
    """Two starts, uniform over 0.08 s, are less than 0.02 s apart with probability 1 - (1 - 1/4)^2."""
    pair = talks("a", 0.0), talks("b", 10.0)
    _, found = play(*pair, end=50.0, bandwidth=40_000.0, half_duplex=True)
    assert found["sent"] == 1000
    assert found["lost_half_duplex"] % 2 == 0
    assert is_near(found["lost_half_duplex"] / 2, 1.0 - 0.75**2, 500)
    assert play(*pair, bandwidth=40_000.0)[1]["delivered"] == 20
    # A queue that is never empty is always on the air.
    assert play(*pair, end=3.0, bandwidth=8000.0, half_duplex=True)[1]["delivered"] == 0


def test_delays_are_uniform_around_the_mean():
    blocks = talks("a", 0.0, last=1), hears("b", 10.0, count=600)
    sim, _ = play(*blocks, comm_delay=0.5, is_stochastic_delay=True, delay_jitter=0.3, range=1e6)
    steps, n = np.unique(sim.read("b.Radio.step_read")[0], return_counts=True)
    assert steps.tolist() == [4, 5, 6, 7, 8, 9]  # sent in step 0, 3 to 8 steps on their way
    assert all(is_near(k, 1.0 / 6.0, 600) for k in n)


def test_plane_and_chance():
    below = Block(name="u", position=(5.0, 0.0, -5.0), motion=Still(), autonomy=Radio(first=10**6))
    blocks = talks("t", 0.0, last=10**6), hears("r", 10.0), below
    _, found = play(
        *blocks, end=50.0, filter_comms_plane=True, comms_boundary_altitude=-1.0, prob_transmit=0.3
    )
    assert found["lost_plane"] == 500
    assert is_near(found["delivered"], 0.3, 500)
    assert found["lost_chance"] == 500 - found["delivered"]


# Counts in the run directory -------------------------------------------------------------------------------------


def recorded(folder, networks, *blocks, seeds=(1,)):
    sim = Simulation(
        Mission(blocks=list(blocks), networks=networks, end=1.0, end_conditions="time"), seeds=seeds
    )
    with Recorder(sim, folder):
        sim.run()
    return load_run(folder), sim


def test_links_are_counted_by_sender_receiver_and_outcome(tmp_path, monkeypatch):
    blocks = talks("a", 0.0), talks("b", 60.0, last=4), hears("c", 150.0), still("deaf", 10.0)
    networks = [RadioNetwork(prob_transmit=0.5)]
    run, sim = recorded(tmp_path / "run", networks, *blocks, seeds=(1, 2))
    links = run.links
    totals = [result.metrics["RadioNetwork"] for result in sim.result()]
    for world, total in enumerate(totals):
        mine = links[links.world == world]
        pairs = mine.groupby(["sender", "receiver"]).messages.sum()
        assert pairs.to_dict() == {(1, 2): 10, (2, 1): 4, (2, 3): 4}
        assert mine.groupby("outcome").messages.sum().to_dict() == {
            "delivered": total["delivered"],
            "chance": total["lost_chance"],
        }
    assert set(links.network) == {"RadioNetwork"}
    assert run.is_complete
    monkeypatch.setattr("tussle.record.traffic.MAX_LINKS", 5)
    again, _ = recorded(tmp_path / "often", networks, *blocks, seeds=(1, 2))
    assert again.links_table.equals(run.links_table)


def test_a_run_without_a_lossy_network_has_no_links(tmp_path):
    run, _ = recorded(tmp_path / "run", [], talks("a", 0.0, network="GlobalNetwork"))
    assert not (tmp_path / "run" / "links.arrow").exists()
    assert run.links_table.num_rows == 0


def test_monitored_topics_are_counted_step_by_step(tmp_path):
    networks = [
        SphereNetwork(
            monitor_publisher_topics="Report, *", monitor_subscriber_topics="Report", csv_filename="radio.csv"
        ),
        GlobalNetwork(monitor_subscriber_topics="*", csv_filename="all.csv"),
    ]
    radio = {"network": "SphereNetwork"}
    blocks = (
        talks("a", 0.0, last=2, **radio),
        hears("b", 50.0, count=2, **radio),
        hears("far", 500.0, **radio),
        talks("loud", 0.0, last=1, network="GlobalNetwork"),
        hears("all", 0.0, network="GlobalNetwork"),
    )
    recorded(tmp_path / "run", networks, *blocks)
    with (tmp_path / "run" / "radio.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert list(lines[0]) == ["t", "world", "*_Pub_Count", "Report_Pub_Count", "Report_Sub_Count"]
    # The sender receives its own message, too.
    assert [line["Report_Sub_Count"] for line in lines] == ["3"] * 2 + ["0"] * 8
    assert [line["*_Pub_Count"] for line in lines] == ["1"] * 2 + ["0"] * 8
    assert [float(line["t"]) for line in lines] == pytest.approx(np.arange(10) * 0.1)
    with (tmp_path / "run" / "all.csv").open() as file:
        assert [line["*_Sub_Count"] for line in csv.DictReader(file)] == ["2"] + ["0"] * 9


@pytest.mark.parametrize("name", ["../radio.csv", "run.json", ".hidden", "a/b.csv"])
def test_the_file_of_counts_is_a_plain_name(tmp_path, name):
    with pytest.raises(
        ParameterError, match=r"GlobalNetwork.csv_filename = .* is not allowed; it takes a plain file name"
    ):
        recorded(
            tmp_path / "run", [GlobalNetwork(csv_filename=name)], talks("a", 0.0, network="GlobalNetwork")
        )


def test_a_topic_that_is_not_there_is_not_counted_silently(tmp_path):
    networks = [SphereNetwork(monitor_publisher_topics="Reprt, *", csv_filename="radio.csv")]
    with pytest.warns(
        RuntimeWarning, match=r"SphereNetwork had no topic 'Reprt' to count \(did you mean 'Report'\?\)"
    ):
        recorded(tmp_path / "run", networks, talks("a", 0.0, network="SphereNetwork"))


def test_two_networks_do_not_write_one_file_nor_over_another(tmp_path):
    networks = [SphereNetwork(csv_filename="counts.csv"), GlobalNetwork(csv_filename="counts.csv")]
    block = talks("a", 0.0, network="SphereNetwork")
    with pytest.raises(ParameterError, match=r"GlobalNetwork.csv_filename = 'counts.csv' .* counts.csv"):
        recorded(tmp_path / "run", networks, block)
    (tmp_path / "counts.csv").touch()
    with pytest.raises(
        RecordError, match=r"counts.csv: SphereNetwork.csv_filename cannot be written: File exists"
    ):
        recorded(tmp_path, networks[:1], block)


# Where runs are summarised ---------------------------------------------------------------------------------------


def test_the_report_of_a_batch_says_what_became_of_the_messages():
    blocks = [talks("a", 0.0), hears("b", 60.0, count=10), still("j", 90.0, team=7)]
    radio = RadioNetwork(fading="rayleigh", jammer_team=7, name="radio")
    mission = Mission(
        blocks=[b.replace(autonomy=[a.replace(network="radio") for a in b.autonomy]) for b in blocks],
        networks=[radio], end=1.0, end_conditions="time",
    )  # fmt: skip
    results = Batch(mission, runs=4).play(executor=InProcess(4))
    data = ReportData(results, ())
    (section,) = [section for section in sections_of(data) if section.name == "networks"]
    (table,) = section.tables
    assert [name for name, _ in table.columns] == [
        "network",
        "messages",
        "delivered",
        "lost: fading",
        "lost: jammed",
    ]
    (row,) = table.rows
    assert row[:2] == ["radio", "100"]
    assert sum(float(cell.split("\xa0")[0]) for cell in row[2:]) == pytest.approx(100.0, abs=0.2)
    means = {m.name: m.value for m in results.means(["radio.sent", "radio.delivered"])}
    assert row[2].split("\xa0")[0] == f"{100.0 * means['radio.delivered'] / means['radio.sent']:.1f}"
    assert not any(
        "radio" in cell
        for s in sections_of(data)
        if s.name == "scores"
        for t in s.tables
        for r in t.rows
        for cell in r
    )


def test_the_summary_of_a_run_shows_what_became_of_the_messages(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    terminal.out.cache_clear()
    sim, _ = play(talks("t", 32.0), hears("r", 0.0), still("j", -100.0 / 3.0, team=2), jammer_team=2)
    show_summary(sim, "radio", Speed(0.0), None)
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    terminal.out.cache_clear()
    assert ["network", "sent", "delivered", "lost", "jammed"] in lines
    assert ["RadioNetwork", "10", "0", "10"] in lines
    assert not any("lost_jammed" in line for line in lines)
