"""What each address of a page may do: everything, orders to a team, or watching."""

import re
import time

import numpy as np
import pytest
from page_client import PageClient

from tussle import Block, Mission, Simulation
from tussle.errors import ParameterError
from tussle.stock import GoTo, SingleIntegrator
from tussle.view import Live
from tussle.view.page import publisher
from tussle.view.page.access import OPERATE, WATCH, PageRole
from tussle.view.page.server import Page

ORDER = {"network": "LocalNetwork", "topic": "Waypoint", "values": {"pos": [50, 0, 0]}}
EVERYTHING = [
    ("pause", {}), ("resume", {}), ("step", {"n": 3}), ("seek", {"t": 0.0}), ("warp", {"value": 4.0}), ("faster", {}), ("slower", {}),
    ("reset", {"seed": 9}), ("point", {"pos": [1.0, 2.0, 0.0]}), ("key", {"key": ";"}), ("order", {"receivers": [1], **ORDER}),
    ("set", {"entities": [1], "path": "GoTo.speed", "value": 3.0}), ("remove", {"entities": [1]}),
    ("drive", {"entities": [1], "sticks": [1.0, 0.0, 0.0]}), ("spawn", {"block": "blue", "pos": [1.0, 2.0, 0.0]}),
]  # fmt: skip


@pytest.fixture
def page():
    blocks = [
        Block(name=name, team=team, count=2, autonomy=GoTo(), motion=SingleIntegrator(max_speed=20.0), position=(0, 50 * team, 0))
        for name, team in (("red", 1), ("blue", 2))
    ]  # fmt: skip
    with (
        Simulation(Mission(blocks=blocks, end=60.0, dt=0.1), 3) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live, has_roles=True) as page,
    ):
        live.step(2)
        assert live.settle()
        yield live, page
        assert page.error is None


def state(live):
    assert live.settle()
    return (
        live.simulation.state_hash(),
        live.step_number,
        len(live.injections),
        live.is_paused,
        live.warp,
        live.seed,
    )


def refused(client, name, fields):
    """The reason for which a command was refused; of several in a second, only the first is told."""
    del client.refusals[:]

    def told():
        client.order(name, **fields)
        return client.refusals

    return client.wait(told)[0]


def test_each_role_has_an_address_of_its_own(page):
    _, page = page
    assert [str(role) for role in page.addresses] == ["direct", "operate team 1", "operate team 2", "watch"]
    assert page.addresses[PageRole()] == page.url
    tokens = {
        re.fullmatch(r"http://127\.0\.0\.1:\d+/([0-9a-f]{32})", url)[1] for url in page.addresses.values()
    }
    assert len(tokens) == 4


@pytest.mark.parametrize("command", EVERYTHING, ids=lambda command: command[0])
@pytest.mark.parametrize("role", [PageRole(WATCH), PageRole(OPERATE, 2)], ids=str)
def test_nothing_else_is_done_from_the_other_addresses(page, role, command):
    live, page = page
    before = state(live)
    with PageClient(page.addresses[role]) as client:
        client.wait(lambda: client.status and client.n_frames)
        assert not client.status["steers"]
        assert client.status["role"] == {"kind": role.kind, "team": role.team, "name": ""}
        reason = refused(client, *command)
        is_order = bool({"receivers", "entities"} & set(command[1]))
        expected = (
            "this address is for watching" if role.kind == WATCH else "this address is for orders to team 2"
        )
        assert reason == (
            "entity 1 is not of team 2, to which this address gives orders"
            if is_order and role.team
            else expected
        )
        client.order("choose", id=3)
        client.wait(lambda: client.status["entity"])
    assert state(live) == before


def test_an_operator_gives_orders_to_the_own_team(page):
    live, page = page
    with PageClient(page.addresses[PageRole(OPERATE, 2)]) as client:
        client.wait(lambda: client.status)
        client.order("order", receivers=[3, 4], **ORDER)
        client.wait(lambda: len(live.injections) == 1)
        assert refused(client, "order", {"receivers": [3, 1], **ORDER}).startswith(
            "entity 1 is not of team 2"
        )
        assert refused(client, "order", {"receivers": [77], **ORDER}).startswith("entity 77 is not of team 2")
        client.order("set", entities=[4], path="GoTo.speed", value=3.0)
        client.wait(lambda: len(live.injections) == 2)
    live.step(3)
    assert live.settle()
    assert not live.notes
    goals, _ = live.simulation.read("blue.GoTo.goal")
    assert (goals[0] == (50, 0, 0)).all()
    assert np.array_equal(live.simulation.read("blue.GoTo.speed")[0][0], [10, 3])
    assert not live.simulation.read("red.GoTo.is_told")[0].any()


def test_an_operator_drives_an_entity_until_the_browser_goes(page, monkeypatch):
    monkeypatch.setattr(publisher, "DRIVE_LEASE", 600.0)
    live, page = page
    driven = lambda: {who for _, who in live.simulation.state.manual}  # noqa: E731

    def wait_for(expected):
        def is_so():
            live.step(1)
            return live.settle() and driven() == expected

        return is_so

    with PageClient(page.addresses[PageRole(OPERATE, 2)]) as client, PageClient(page.url) as other:
        client.wait(lambda: client.status)
        client.order("drive", entities=[3], sticks=[1.0, 0.0, 0.0])
        client.wait(wait_for({3}))
        assert (
            refused(other, "drive", {"entities": [3], "sticks": [0.0, 0.0, 0.0]})
            == "another browser drives entity 3"
        )
        assert other.n_undriven >= 1
        refused(client, "order", {"receivers": [1], **ORDER})
        client.wait(lambda: client.n_frames)
        assert (
            client.n_undriven == 0
        )  # another order that is refused says nothing of the entity that it drives
        for sticks in ([2.0, 0.0, 0.0], [1.0, 0.0], "north"):
            assert refused(client, "drive", {"entities": [3], "sticks": sticks}).startswith("sticks")
        client.order("drive", entities=[4], sticks=[1.0, 0.0, 0.0])
        client.wait(wait_for({4}))
        other.order("drive", entities=[1], sticks=[1.0, 0.0, 0.0])
        other.wait(wait_for({1, 4}))
        other.order("drive", entities=[1], sticks=None)
        other.wait(wait_for({4}))
        client.close()
        other.wait(wait_for(set()))


def test_a_driver_who_falls_silent_gives_the_entity_back_and_one_who_repeats_the_sticks_does_not(
    page, monkeypatch
):
    """As a browser whose connection is lost without an end."""
    monkeypatch.setattr(publisher, "DRIVE_LEASE", 1.0)
    live, page = page
    givers = []
    live.simulation.events.inputs.append(lambda world, given: givers.append(given.by))
    with PageClient(page.addresses[PageRole(OPERATE, 2)]) as client, PageClient(page.url) as other:
        client.wait(lambda: client.status)
        for _ in range(10):
            client.order("drive", entities=[3], sticks=[1.0, 0.0, 0.0])
            live.step(1)
            time.sleep(0.2)
        assert live.settle()
        assert client.n_undriven == 0
        assert {who for _, who in live.simulation.state.manual} == {3}
        assert len(live.injections) == 1  # what is repeated is no input
        client.wait(lambda: client.n_undriven)
        assert client.refusals == ["entity 3 is given back: nothing came from this page for 1 s"]
        live.step(1)
        assert live.settle()
        assert not live.simulation.state.manual
        assert givers == ["operate team 2"] * 2
        other.order("drive", entities=[3], sticks=[0.0, 1.0, 0.0])
        other.wait(lambda: len(live.injections) == 3)


def test_one_steers_is_the_first_of_those_who_may(page):
    live, _ = page
    with (
        Page(live, has_roles=True, one_steers=True) as one,
        PageClient(one.addresses[PageRole(WATCH)]) as watcher,
        PageClient(one.url) as first,
        PageClient(one.url) as second,
    ):
        first.wait(lambda: first.status.get("steers"))
        second.wait(lambda: second.status and not second.status["steers"])
        watcher.wait(lambda: watcher.status and not watcher.status["steers"])
        assert refused(second, "step", {"n": 1}) == "another browser steers this game"


def test_without_roles_there_is_one_address(page):
    live, _ = page
    with Page(live) as plain:
        assert list(plain.addresses.values()) == [plain.url]


@pytest.fixture
def people(page):
    live, _ = page
    with Page(live, has_roles=True, operators={"Ada": 1, "Ben": 1, "operate team 1": 2}) as page:
        yield live, page
        assert page.error is None


def test_people_have_addresses_of_their_own_beside_those_of_roles(people):
    _, page = people
    named = ["Ada (operate team 1)", "Ben (operate team 1)", "operate team 1 (operate team 2)"]
    roles = ["direct", *named, "operate team 1", "operate team 2", "watch"]
    assert [str(role) for role in page.addresses] == roles
    assert len(set(page.addresses.values())) == len(roles)
    operators = [role for role in page.addresses if role.kind == OPERATE]
    assert [PageRole.of_operator(str(role)) for role in operators] == operators
    assert PageRole.of_operator("Ada") is PageRole.of_operator("operate team x") is None


def test_orders_have_the_name_of_the_address(people):
    live, page = people
    orders = [(PageRole(OPERATE, 1, "Ada"), 1), (PageRole(OPERATE, 1, "Ben"), 2), (PageRole(OPERATE, 1), 1)]
    heard = []
    listener = lambda world, given: heard.append((given.by, given.to))  # noqa: E731
    live.simulation.events.inputs.append(listener)
    for n, (role, who) in enumerate(orders, 1):
        with PageClient(page.addresses[role]) as client:
            client.wait(lambda: client.status)
            assert client.status["role"]["name"] == role.name
            client.order("order", receivers=[who], by="Ben", **ORDER)  # no command of the page
            assert refused(client, "order", {"receivers": [3], **ORDER}).startswith(
                "entity 3 is not of team 1"
            )
            client.order("order", receivers=[who], **ORDER)
            client.wait(lambda n=n: len(live.injections) == n)
    live.step(1)
    assert live.settle()
    assert heard == [(str(role), (who,)) for role, who in orders]


@pytest.mark.parametrize(
    ("operators", "reason"),
    [
        ({"": 1}, "a name has no space at its ends"),
        ({"Ada ": 1}, "a name has no space at its ends"),
        ({"Ada\n": 1}, "it takes a printable text"),
        ({"A" * 90: 1}, "it takes a printable text of at most 100"),
        ({3: 1}, "it takes a printable text"),
        ({"Ada": 3}, "'Ada' cannot operate team 3; there are: 1, 2"),
        ({"Ada": "1"}, "'Ada' cannot operate team '1'"),
        ({"Ada": 1, "ADA": 2}, "'ADA' and 'Ada' look alike"),
        ({"ﬁn": 1, "fin": 2}, "'fin' and 'ﬁn' look alike"),
    ],
)
def test_names_and_teams_of_people_are_checked(page, operators, reason):
    live, _ = page
    with pytest.raises(ParameterError, match=r"^operator: ") as caught:
        Page(live, operators=operators)
    assert reason in str(caught.value)
