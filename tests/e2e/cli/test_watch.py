"""`tussle view` and `tussle replay`, as a user starts and ends them."""

import json
import re
import signal
import socket
import subprocess
from urllib.request import urlopen

import pytest
from cli_process import COMMAND, environment
from page_client import PageClient

from tussle.view import Recording

ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+/\w{32}")


BROKEN = """\
from tussle.stock import Predator


class Broken(Predator):
    def step(self, g):
        raise ValueError("no")
"""


FAILING = """\
from tussle.stock import Predator
from tussle.view.page.publisher import FramePublisher


def broken(self):
    raise RuntimeError("shapes are broken")


FramePublisher._make_drawing = broken


class Hunter(Predator):
    pass
"""


class Watching:
    """A command that serves a page."""

    def __init__(self, folder, *arguments):
        self.process = subprocess.Popen(
            [*COMMAND, *arguments, "--no-browser"],
            cwd=folder, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        line = self.process.stdout.readline()
        found = ADDRESS.search(line)
        assert found, (line, self.process.communicate(timeout=300))
        self.url = found[0]

    def end(self, number=signal.SIGINT):
        self.process.send_signal(number)
        out, err = self.process.communicate(timeout=300)
        return self.process.returncode, out, err

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()


@pytest.fixture
def watching(folder):
    def start(*arguments):
        return Watching(folder, *arguments)

    return start


def test_a_game_is_served_steered_and_ended_with_its_summary(watching, folder):
    with (
        watching("view", "game.xml", "n=6", "--paused", "--record", "kept") as command,
        PageClient(command.url) as client,
    ):
        client.wait(lambda: client.t == 0.0)
        client.order("step", n=1)
        client.wait(lambda: client.t == pytest.approx(0.1))
        code, out, err = command.end()
    assert code == 0, "Ctrl-C is the way to end it"
    assert "A small game" in out
    assert "1 step of 0.1 s" in out
    assert "kept" in out
    assert "Traceback" not in err
    assert (folder / "kept" / "run.json").exists()


def test_what_is_watched_has_the_hash_that_it_has_alone(tussle):
    alone = re.search(r"hash\s+(\w{32})", tussle("run", "game.xml", "--no-log").stdout)[1]
    specs = ("--spec", "always (distance(team 1, team 2) > 3 m)", "--spec", "lost[1] < 3", "--margin", "4")
    seen = tussle(
        "view", "game.xml", "--no-browser", "--exit-when-over", "--pace", "max", "--roles", *specs
    ).stdout
    assert f"hash   {alone}" in seen
    assert re.findall(rf"^ (\w.*): {ADDRESS.pattern}$", seen, re.MULTILINE) == [
        "operate team 1",
        "operate team 2",
        "watch",
    ]
    assert "end time reached" in seen


def test_a_failing_plugin_is_the_exit_code(tussle, folder):
    (folder / "broken.py").write_text(BROKEN)
    done = tussle(
        "view", "game.xml", "mind=Broken", "--plugin-path", "broken.py", "--no-browser", "--exit-when-over", code=3
    )  # fmt: skip
    assert "Broken" in done.stderr
    assert "no" in done.stderr


@pytest.mark.parametrize(
    ("options", "message", "code"),
    [
        (("--spec", "always (distance(prey, hunters) > 3 s)"), "m and s cannot be compared", 1),
        (("--spec", "scores[1] > 3"), "there is no 'scores", 1),
        (("--spec", "always (nothing(prey) > 3)"), "there is no signal 'nothing'", 1),
        (("--margin", "2"), "--margin is allowed with --spec only", 2),
        (("--spec", "lost[1] < 3", "--margin", "0"), "it takes a number > 0", 2),
    ],
)
def test_a_specification_that_the_mission_does_not_have_is_refused(tussle, options, message, code):
    done = tussle("view", "game.xml", "--no-browser", *options, code=code)
    assert message in " ".join(done.stderr.split())
    assert "http" not in done.stdout


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("always (distance(prey, hunter) > 3 m)", "did you mean 'hunters'"),
        ("always (max(prey.Boids.target) < 3)", "'prey.Boids.target' was not recorded"),
        ("lost[1] < 3", "lost[1] is known at the end of a game"),
    ],
)
def test_a_specification_that_a_recording_does_not_have_is_refused(tussle, spec, message):
    tussle("run", "game.xml", "--out", "a", "--end", "1")
    done = tussle("replay", "a", "--no-browser", "--spec", spec, code=1)
    assert message in " ".join(done.stderr.split())
    assert "http" not in done.stdout


def test_other_hosts_are_warned_of(watching):
    with watching("view", "game.xml", "--paused", "--host", "0.0.0.0") as command:
        code, _, err = command.end()
    assert code == 0
    assert "warning: the page is served at 0.0.0.0: whoever reaches this machine" in err


def test_a_run_is_replayed_and_two_are_compared(tussle, watching):
    tussle("run", "game.xml", "--out", "a")
    tussle("run", "game.xml", "--seed", "8", "--out", "b")
    with watching("replay", "a", "--paused") as command:
        assert '"isPlaying":false' in page_of(command)
        assert command.end()[0] == 0
    told = ("--spec", "always (distance(prey, hunters) > 1 m)", "--margin", "500", "--mark", "0.5=half")
    with watching("replay", "a", "b", "--over", "--pace", "3", *told) as command:
        page = page_of(command)
        assert [each["near"] for each in document_of(page)["alarms"]] == [0.0, 0.0]
        with urlopen(f"{command.url}/events", timeout=60) as answer:
            events = json.loads(answer.read())
        assert [0.5, "mark", 0, 0, "half"] in events
        assert {text[:2] for _, kind, _, _, text in events if kind == "alarm"} == {"A:", "B:"}
        assert "they differ first at t = 0 s" in page
        assert '"warp":3.0' in page
        code, _, err = command.end()
    assert code == 0
    assert "note: they differ first" in err


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (("view", "game.xml", "--pace", "fast"), 2, "--pace fast is not allowed"),
        (("view", "game.xml", "--pace", "0"), 2, "--pace 0 is not allowed"),
        (("view", "nosuch.xml"), 1, "nosuch.xml"),
        (("view", "game.xml", "--host", "192.0.2.1"), 1, "cannot be served at 192.0.2.1"),
        (("replay", "nowhere"), 4, "nowhere"),
        (("replay", "nowhere", "--over"), 2, "a second run is required"),
        (("replay", "nowhere", "--margin", "2"), 2, "--margin is allowed with --spec only"),
        (("replay", ".", "--mark", "soon"), 2, "--mark 'soon' is not allowed; it takes a time and a text"),
        (("replay", ".", "--mark", "1="), 2, "--mark '1=' is not allowed"),
        (("replay", ".", "--mark", "noon=lost"), 2, "--mark: 'noon'"),
    ],
)
def test_what_cannot_be_watched_is_told(tussle, arguments, code, told):
    done = tussle(*arguments, code=code)
    assert told in " ".join((done.stdout + done.stderr).split())


def recorded(folder):
    """What the run file in a directory says, which is there only when its recording was closed."""
    return json.loads((folder / "run.json").read_text())


def document_of(page):
    """What a page is told at once."""
    return json.loads(re.search(r'id="document">(.*?)</script>', page)[1])


def page_of(command):
    """The text of the page that is served."""
    with urlopen(command.url, timeout=60) as answer:
        return answer.read().decode()


def test_a_signal_closes_the_recording(watching, folder):
    with watching("view", "game.xml", "--record", "kept") as command, PageClient(command.url) as client:
        client.wait(lambda: client.t > 0.55)
        code, out, _ = command.end(signal.SIGTERM)
    assert code == 143
    assert "A small game" in out
    assert recorded(folder / "kept")
    assert Recording(folder / "kept").n_frames > 5


def test_what_fails_before_the_game_begins_closes_the_recording(tussle, folder):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = str(other.getsockname()[1])
        done = tussle("view", "game.xml", "--record", "kept", "--port", port, "--no-browser", code=1)
    assert "cannot be served" in done.stderr
    assert "cannot be served" in str(recorded(folder / "kept"))


def test_an_error_of_the_page_is_said_in_the_terminal_and_the_game_goes_on(watching, folder):
    (folder / "failing.py").write_text(FAILING)
    with (
        watching("view", "game.xml", "--plugin-path", "failing.py", "--record", "kept") as command,
        PageClient(command.url) as client,
    ):
        client.wait(lambda: client.says("shapes are broken"))
        client.wait(lambda: client.t > 2.0)
        code, _, err = command.end()
    assert code == 0
    assert err.count("RuntimeError: shapes are broken") == 1
    assert recorded(folder / "kept")
