"""Nothing that a page sends ends a game, and an error of the page is told on it: seen by one who speaks its protocol."""

import json
import math
import time

import pytest
from page_client import browsed
from recorded_games import hunt
from watched_plugins import clickable

from tussle.errors import ParameterError

NAN, INF = math.nan, math.inf
NO_NUMBERS = (NAN, INF, -INF, 1e308, -1e308, 2**63, None, True, "5", "x" * 9000, [], [1.0], {}, 10**400)


@pytest.fixture(scope="module")
def shared():
    """A page on a game that goes on."""
    with browsed(hunt(end=1e5, end_conditions="time"), 3, pace=1.0) as (live, page, client):
        client.wait(lambda: client.n_frames and client.status)
        yield live, page, client


@pytest.fixture
def game(shared):
    """The page; after each test its game goes on and is seen."""
    yield shared
    live, page, client = shared
    live.resume()
    step, frames = live.step_number, client.n_frames
    client.wait(lambda: live.step_number > step and client.n_frames > frames + 2)
    assert (page.error, live.error) == (None, None)


def is_refused(client, reason, order):
    """Wait until it is: of many refused values in a row, only the first is told."""

    def is_told():
        order()
        time.sleep(0.2)
        return any(reason in text for text in client.refusals)

    client.refusals.clear()
    client.wait(is_told)


@pytest.mark.parametrize(
    ("command", "field", "bad"),
    [
        ("seek", "t", NO_NUMBERS),
        ("step", "n", (*NO_NUMBERS, 1.5, 1001)),
        ("warp", "value", [v for v in NO_NUMBERS if v is not None] + [0, -1.0]),
        ("reset", "seed", (*NO_NUMBERS, 1.5, -1, 2**31)),
        ("choose", "id", (*NO_NUMBERS, 1.5, -1, 2**31)),
        ("history", "seconds", (*NO_NUMBERS, -1.0)),
        ("key", "key", (NAN, 0, None, True, "", "a", ";;", [";"], {})),
        (
            "point",
            "pos",
            (None, 1.0, [], [1.0, 2.0], [1.0, 2.0, NAN], [1.0, 2.0, "3"], "abc", [True, 1.0, 1.0]),
        ),
    ],
)
def test_values_that_a_command_does_not_take_are_refused_and_said(game, command, field, bad):
    live, page, client = game
    epoch, seed, warp, n = live.epoch, live.seed, live.warp, len(live.injections)
    for value in bad:
        client.order(command, **{field: value})
    is_refused(client, f"{field} = ", lambda: client.order(command, **{field: bad[0]}))
    assert "is not allowed; it takes" in client.refusals[-1]
    assert (live.epoch, live.seed, live.warp, len(live.injections)) == (epoch, seed, warp, n)
    assert page.publisher.readers[0].chosen == 0


@pytest.mark.parametrize(
    "text",
    [
        "", "x", "[]", "null", "5", '"pause"', "{}", '{"do": null}', '{"do": 5}', '{"do": ["pause"]}', '{"do": "nosuch"}',
        '{"do": "__class__"}', '{"do": "stop"}', '{"do": "pause", "more": 1}', '{"do": "seek"}', '{"do": "seek", "t": 1, "x": 2}',
        "[" * 5000, b'{"do": "pause"}', b"\x81", '{"do": "pause"',
    ],
)  # fmt: skip
def test_what_is_no_command_is_ignored(game, text):
    live, page, client = game
    epoch = live.epoch
    client.send(text)
    client.order("choose", id=1)
    client.wait(lambda: page.publisher.readers[0].chosen == 1)
    client.order("choose", id=0)
    client.wait(lambda: page.publisher.readers[0].chosen == 0)
    assert not live.is_paused
    assert live.epoch == epoch


def test_nothing_is_set_by_name(game):
    """Whatever attributes a game, a page and a reader have, a command's name is none of them."""
    live, page, client = game
    reader = page.publisher.readers[0]
    before = (live.is_paused, live.warp, page.host, reader.chosen, reader.frame_sent >= 0)
    for thing in (live, page, page.publisher, reader):
        for name in dir(thing):
            if name not in ("pause", "resume", "step", "seek", "reset", "faster", "slower", "choose", "warp"):
                client.send(json.dumps({"do": name}))
                client.send(json.dumps({"do": name, "value": 1}))
    client.order("choose", id=2)
    client.wait(lambda: reader.chosen == 2)
    client.order("choose", id=0)
    client.wait(lambda: reader.chosen == 0)
    assert (live.is_paused, live.warp, page.host, reader.chosen, reader.frame_sent >= 0) == before


@pytest.mark.parametrize("who", [999, 2**31 - 1])
def test_an_id_that_nobody_has_is_nobody(game, who):
    _, page, client = game
    client.order("choose", id=who)
    client.wait(lambda: page.publisher.readers[0].chosen == who)
    time.sleep(0.5)
    assert client.status["entity"] is None
    client.order("choose", id=0)
    client.wait(lambda: page.publisher.readers[0].chosen == 0)


def test_every_command_at_any_moment(game):
    live, page, client = game
    for is_paused in (True, False):
        (live.pause if is_paused else live.resume)()
        for command, fields in (
            ("pause", {}), ("resume", {}), ("step", {"n": 1}), ("step", {"n": -3}), ("seek", {"t": 0}), ("seek", {"t": -1e9}),
            ("faster", {}), ("slower", {}), ("warp", {"value": None}), ("warp", {"value": 1}), ("reset", {"seed": 5}),
            ("key", {"key": ";"}), ("point", {"pos": [1, 2, 0]}), ("choose", {"id": 1}), ("history", {"seconds": 0}),
            ("history", {"seconds": 1e9}), ("choose", {"id": 0}),
        ):  # fmt: skip
            client.order(command, **fields)
    client.order("warp", value=1)
    client.order("choose", id=3)
    client.wait(lambda: page.publisher.readers[0].chosen == 3)
    client.order("choose", id=0)
    live.settle()


def test_a_point_too_far_away_is_no_point():
    with browsed(clickable(), 1, is_paused=True) as (live, page, client):
        is_refused(client, "there is no ground there", lambda: client.order("point", pos=[1e9, 0, 0]))
        assert not live.injections
        assert page.error is None


# -- errors of the page -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def fragile():
    """A page that will fail, on a game that goes on."""
    with browsed(hunt(end=1e5, end_conditions="time"), 3, pace=1.0) as (live, page, client):
        client.wait(lambda: client.n_frames and live.step_number > 3)
        yield live, page, client


def fail(*_, **__):
    raise RuntimeError("<b>no</b> such thing")


def is_told_and_goes_on(live, page, client):
    client.wait(lambda: client.says("RuntimeError: <b>no</b> such thing"))
    assert len(page.errors) == 1, "each is told once"
    assert isinstance(page.error, RuntimeError)
    step = live.step_number
    client.wait(lambda: live.step_number > step + 3)
    assert live.error is None


@pytest.mark.parametrize(
    ("method", "fields"), [("seek", {"t": 0.0}), ("pause", {}), ("faster", {}), ("reset", {"seed": 1})]
)
def test_a_command_that_fails_is_told_and_the_game_goes_on(fragile, monkeypatch, method, fields):
    _, page, client = fragile
    command = page.publisher._commands[method]
    monkeypatch.setitem(page.publisher._commands, method, type(command)(fail, command.fields))
    client.order(method, **fields)
    is_told_and_goes_on(*fragile)


@pytest.mark.parametrize("part", ["_make_frame", "_make_drawing", "_entity"])
def test_a_part_that_cannot_be_made_is_told_and_the_others_are_sent(fragile, monkeypatch, part):
    live, page, client = fragile
    if part == "_entity":
        monkeypatch.setattr("tussle.view.page.publisher.entity_sections", fail)
        client.order("choose", id=int(live.frame().id[0]))
        client.wait(lambda: page.errors)
        client.order("choose", id=0)
    else:
        monkeypatch.setattr(page.publisher, part, fail)
    is_told_and_goes_on(*fragile)
    if part != "_make_frame":
        seen = client.n_frames
        client.wait(lambda: client.n_frames > seen + 3)


def test_what_is_told_has_an_end(fragile, monkeypatch):
    from tussle.view.page.failures import MAX_FAILURES

    _, page, client = fragile
    numbers = iter(range(1000))

    def fail_anew(*_):
        raise RuntimeError(f"number {next(numbers)} {'x' * 9000}")

    monkeypatch.setattr(page.publisher, "_make_drawing", fail_anew)
    client.wait(lambda: len(page.errors) > MAX_FAILURES)
    time.sleep(0.3)
    assert len(page.errors) == MAX_FAILURES + 1
    assert page.errors[-1] == "further errors of the page are not listed"
    assert max(map(len, page.errors)) < 500


def test_a_state_that_cannot_be_made_is_a_note_and_the_game_goes_on(fragile, monkeypatch):
    live, _, client = fragile
    monkeypatch.setattr("tussle.view.live.entity_state", fail)
    client.order("choose", id=int(live.frame().id[0]))
    client.wait(lambda: client.says("RuntimeError"))
    step = live.step_number
    client.wait(lambda: live.step_number > step + 3)


@pytest.mark.parametrize("t", [1e308, -1e308, 10**400])
def test_a_time_that_no_step_has_is_refused(fragile, t):
    with pytest.raises(ParameterError, match="it takes a time in s"):
        fragile[0].seek(t)
