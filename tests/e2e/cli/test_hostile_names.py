"""Names and texts of files are data to who prints them: no markup, no links, nothing that steers a terminal or turns letters round."""

from __future__ import annotations

import json
import re
import warnings

import pytest
import typer
from cli_process import call
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from rich.table import Table
from rich.text import Text
from test_terminal import seen

from tussle.cli import terminal
from tussle.errors import TussleError, visible

NAMES = {
    "closing tag": "a[/]b",
    "link": "[link=https://example.org]free[/link]",
    "style": "[bold red]x[/bold red] [blink]",
    "C1 control": "\x9b31mred\x9d0;title\x9c",
    "bidi": "\u202egnp.exe\u2066\u200f",
    "mathtext": "$\\frac$ $x_{",
    "emoji": ":skull: {task} %s {0}",
    "html": "<script>alert(1)</script>&amp;\"'",
    "tags": "a\U000e0041\ufeff\u2028b",
}
"""As they may stand in XML."""

STEERING = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\U000e0000-\U000e007f]"
)
OWN = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|\r")
"""What the program itself steers the terminal with: colours and the bar, but no links."""

PLUGIN = '''\
from tussle.api import Metric, Param, State


class Odd(Metric):
    """[bold]Odd[/] \\x9b31m [link=file:///x]doc[/link]."""

    level = Param(1.0, doc="A [/] in a doc \\u202e.")
    grade = "portable"
    one = State(per="world")
    score = State(per="team")

    def result(self, w):
        return {NAME: self.one, NAME + "2": self.score, "score": self.score}
'''


def escaped(text):
    return text.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")


ENTITY = """<entity><name>{}</name> <team_id>{}</team_id> <count>2</count> <variance_x>400</variance_x> <variance_y>400</variance_y>
<autonomy>Boids</autonomy> <motion_model>Unicycle</motion_model></entity>"""


@pytest.fixture
def hostile(folder):
    """game.xml has hostile names: of the mission, of all entities and teams, of a metric."""
    names = [escaped(name) for name in NAMES.values()]
    entities = "".join(ENTITY.format(name, team) for team, name in enumerate(names, 10))
    text = (folder / "game.xml").read_text().replace("A small game", " ".join(names))
    text = text.replace("<metrics>", "<metrics>Odd</metrics><metrics>").replace(
        "</runscript>", f"{entities}</runscript>"
    )
    (folder / "game.xml").write_text(text)
    (folder / "odd.py").write_text(PLUGIN.replace("NAME", ascii("".join(NAMES.values()))))


@pytest.fixture
def here(folder, monkeypatch):
    """Calls the command in this process: exit code and all that is printed."""
    monkeypatch.chdir(folder)

    def run(*arguments):
        done = call(*arguments)
        output = done.stdout + done.stderr
        assert not STEERING.search(output), ascii(output)
        assert "Traceback" not in output
        assert "internal error" not in output
        return done.returncode, output

    return run


def plain(name):
    """A name as it is printed, without spaces: tables fold."""
    return re.sub(r"\s", "", visible(name))


def flat(output):
    return re.sub(r"[\s│]", "", output)


PLUGINS = ("--plugin-path", "odd.py")


def test_a_run_and_its_description_show_names_as_they_are(here, hostile):
    for command in (
        ("run", "game.xml", "--no-log"),
        ("describe", "game.xml"),
        ("check", "game.xml", "--strict"),
    ):
        code, output = here(*command, *PLUGINS)
        assert code == 0
        if command[0] == "run":
            for name in NAMES.values():
                assert plain(name) in flat(output)
    for command in (("plugins",), ("describe", "Odd")):
        code, output = here(*command, *PLUGINS)
        assert code == 0
        assert "[bold]Odd[/]" in output


def test_a_batch_and_all_that_is_made_of_it_show_names_as_they_are(here, folder, hostile):
    command = (
        "batch",
        "game.xml",
        "--runs",
        2,
        "--vary",
        "n=3,4",
        "--processes",
        1,
        "--out",
        "out",
        *PLUGINS,
    )
    assert here(*command)[0] == 0
    for again in (
        command,
        ("analyze", "out"),
        ("analyze", "out", "--json"),
        ("run", "--from", "out:1", "--no-log"),
    ):
        assert here(*again)[0] == 0
    assert here("report", "out")[0] == 0
    page = (folder / "out" / "report" / "index.html").read_text()
    assert "<script" not in page
    assert not re.search(r"[\x80-\x9f\u202a-\u202e\u2066-\u2069]", page)


@pytest.mark.needs("renderer")
def test_plots_films_and_pages_take_any_name(here, folder, hostile):
    assert here("run", "game.xml", "--out", "played", *PLUGINS)[0] == 0
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")
        for form in ("svg", "png"):
            assert here("plot", "played", "--format", form, *PLUGINS)[0] == 0
        assert here("export", "played", "--html", "--png", "--size", "160x120", *PLUGINS)[0] == 0
    assert "<script>alert" not in (folder / "played" / "replay.html").read_text()


def test_what_a_directory_says_of_itself_is_data(here, folder):
    evil = "\x1b]0;owned\x07\x1b[2J[/]\x9b"
    assert here("batch", "game.xml", "--runs", 2, "--processes", 1, "--out", "out")[0] == 0
    file = folder / "out" / "batch.json"
    info = json.loads(file.read_text())
    del info["checksum"]  # else it is damaged
    info["name"], info["teams"] = evil, dict.fromkeys(info["teams"], evil)
    file.write_text(json.dumps(info))
    assert here("analyze", "out")[0] == 0
    assert here("report", "out")[0] == 0
    info["format"] = evil
    file.write_text(json.dumps(info))
    code, output = here("analyze", "out")
    assert code == 4
    assert output.startswith("error: out/batch.json")


def test_errors_show_what_a_file_says_as_it_is(here, folder):
    (folder / "bad\x1b[2J[b].xml").write_text("<runscript>")
    code, output = here("run", "bad\x1b[2J[b].xml")
    assert code == 1
    assert "bad\\x1b[2J[b].xml:1" in output
    (folder / "odd.py").write_text("raise ValueError('\\x1b[2J[/red] \\x9b')")
    for more in ((), ("--debug",)):
        done = call("run", "game.xml", "--plugin-path", "odd.py", *more)
        assert done.returncode == 1
        assert "odd.py:1: it cannot be imported: ValueError: \\x1b[2J[/red] \\x9b" in done.stderr
        assert not STEERING.search(done.stderr)


def test_on_a_terminal_nothing_but_the_program_steers(folder, hostile):
    """The bar, the notes and the tables of a terminal, in its own process."""
    for command in (
        ("run", "game.xml", "--no-log"),
        ("describe", "game.xml"),
        ("batch", "game.xml", "-n", "2", "--processes", "1"),
    ):
        text, code = seen(folder, *command, *PLUGINS)
        assert code == 0, text
        assert not STEERING.search(OWN.sub("", text)), ascii(text)
        assert "\x1b]" not in text


@given(st.text(min_size=1, max_size=20))
@example("[/]")
@example("\\[")
@example("[link=x]\x1b]8;;y\x1b\\")
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_is_printed_steers_nothing(text):
    """Any text, in any thing that is printed."""
    console = terminal.PlainConsole(stderr=False)
    table = Table(title=text, caption=text)
    table.add_column(text)
    table.add_column(Text(text))
    table.add_row(text, Text(text))
    with console.capture() as captured:
        console.print(text, Text.assemble((text, "bold"), text), table)
    assert not STEERING.search(captured.get())
    with pytest.raises(typer.Exit) as caught, terminal.reported(False):
        raise TussleError(text)
    assert caught.value.exit_code == terminal.WRONG_INPUT
