"""The pages that need no game: help, lists, a plugin, a mission."""

from __future__ import annotations

import pytest

import tussle as package
from tussle.cli import pages, terminal
from tussle.mission import shipped_missions
from tussle.plugins import stock


def test_the_version(tussle):
    assert tussle("--version").stdout == f"tussle {package.__version__}\n"


def test_help_names_all_commands_options_and_exit_codes(tussle):
    text = tussle("--help").stdout
    for command in ("run", "check", "describe", "plugins", "missions", "new"):
        assert f"\n  {command} " in text
    text = tussle("run", "--help").stdout
    for option in (
        "--seed", "--set", "--end", "--out", "--no-log", "--log-period", "--pace", "--start-from", "--strict",
        "--plugin-path", "--debug",
    ):  # fmt: skip
        assert f"\n  {option} " in text
    for code, meaning in terminal.EXIT_CODES.items():
        assert f"{code:>3}  {meaning}\n" in text
    assert max(map(len, text.splitlines())) <= 80


def test_plugins_are_listed_by_kind_and_own_ones_too(tussle, folder):
    (folder / "mine.py").write_text(
        'from tussle.stock import Boids\n\n\nclass Mine(Boids):\n    """Sheep. They sleep."""\n'
    )
    lines = tussle("plugins", "--plugin-path", "mine.py").stdout.splitlines()
    names = {line.split()[0] for line in lines if line.startswith("   ") and line[3] != " "}
    assert names == {*stock.manifest(), "Mine"}
    assert any(line.split() == ["Mine", "Sheep"] for line in lines)
    assert lines.index(" autonomy") < lines.index(" motion") < lines.index(" metric")
    assert max(map(len, lines)) <= 80


def test_a_broken_plugin_is_one_line_and_the_others_are_listed(tussle, folder, monkeypatch):
    info = folder / "site/broken-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
    points = "Boids = my_boids:Boids\nGone = no_such_package:Gone\nLoud = loud:Loud\nNone = math:pi\n"
    (info / "entry_points.txt").write_text(f"[tussle.plugins]\n{points}")
    (folder / "site/loud.py").write_text("raise RuntimeError('two\\nlines')")
    boids = 'from tussle.stock import Boids as Old\n\n\nclass Boids(Old):\n    """Woolly."""\n'
    (folder / "site/my_boids.py").write_text(boids)
    (folder / "wrong.py").write_text("1 / 0")
    (folder / "mine.py").write_text(boids.replace("Boids(Old)", "Predator(Old)"))
    monkeypatch.syspath_prepend(folder / "site")
    done = tussle("plugins", "--plugin-path", "wrong.py", "--plugin-path", "mine.py", code=1)
    lines = [line.split() for line in done.stdout.splitlines()]
    assert ["Boids", "Woolly"] in lines
    assert ["Predator", "Woolly"] in lines
    assert "Unicycle" in [line[0] for line in lines if line]
    mine, lacks = folder.resolve() / "mine.py", "ModuleNotFoundError: No module named 'no_such_package'"
    assert sorted(done.stderr.splitlines()) == [
        f"error: {folder.resolve()}/wrong.py:1: it cannot be imported: ZeroDivisionError: division by zero",
        f"error: plugin 'Gone' of the package broken (no_such_package:Gone) cannot be imported: {lacks}",
        "error: plugin 'Loud' of the package broken (loud:Loud) cannot be imported: RuntimeError: two lines",
        "error: plugin 'None' of the package broken (math:pi) is 3.141592653589793, which is not a plugin class",
        "note: Boids is the one of the package broken (my_boids:Boids); it hides the one that ships",
        f"note: Predator is the one of {mine}; it hides the one that ships",
    ]
    done = tussle("describe", "Boids", "--plugin-path", "mine.py")
    assert done.stderr == f"{done.stderr.splitlines()[0]}\n"
    assert "Boids is the one of the package broken" in done.stderr


def test_missions_are_listed_with_their_titles(tussle):
    text = tussle("missions").stdout
    for name, (_, title) in shipped_missions().items():
        assert any(line.split(maxsplit=1) == [name, title] for line in text.splitlines())


def test_a_plugin_page_has_parameters_channels_and_units(tussle):
    lines = [line.split() for line in tussle("describe", "Predator").stdout.splitlines()]
    for name, column in stock.load("Predator").params().items():
        (line,) = (line for line in lines if line[:1] == [name] and len(line) > 2)
        assert not isinstance(column.default, float) or line[1] == f"{column.default:g}"
    assert ["turn_rate", "rad/s"] in [line[:2] for line in lines]


def test_the_example_of_a_plugin_is_printed_and_played_by_its_name(tussle, folder):
    assert "example: tussle run Straight plays it, tussle describe" in tussle("describe", "Straight").stdout
    text = tussle("describe", "Straight", "--example").stdout
    assert text == stock.examples()["Straight"].read_text()
    (folder / "copy.xml").write_text(text)
    played, copied = (tussle("run", name, "--no-log", "--end", "1") for name in ("Straight", "copy.xml"))
    for line in (" Straight: planes fly straight on", " hash "):
        (shown,) = (each for each in played.stdout.splitlines() if each.startswith(line))
        assert shown in copied.stdout
    (folder / "mine.py").write_text(
        'from tussle.stock import Boids\n\n\nclass Mine(Boids):\n    """Sheep."""\n'
    )
    assert "example:" not in tussle("describe", "Mine", "--plugin-path", "mine.py").stdout
    done = tussle("describe", "Mine", "--plugin-path", "mine.py", "--example", code=1)
    assert done.stderr == "error: Mine has no example; the plugins that ship have one each\n"


def test_a_plugin_page_has_the_fields_of_lists(tussle):
    lines = [line.split() for line in tussle("describe", "NoisyContacts").stdout.splitlines()]
    first = next(i for i, line in enumerate(lines) if line[:2] == ["contacts", "list"])
    fields = " ".join(line[0] for line in lines[first + 1 : first + 13])
    assert fields == "id team x y z vx vy vz qw qx qy qz"
    assert [lines[first + 3], lines[first + 6]] == [["x", "m"], ["vx", "m/s"]]


@pytest.mark.parametrize("name", stock.manifest())
def test_the_page_of_each_plugin_fits_80_columns(name, capsys):
    terminal.out.cache_clear()
    pages.show_plugin(name, stock.load(name))
    lines = capsys.readouterr().out.splitlines()
    place = 3  # the path of the file, as long as it is
    assert lines[1] == f" {name}"
    assert max(len(line) for i, line in enumerate(lines) if i != place) <= 80
    terminal.out.cache_clear()


def test_a_mission_page_has_blocks_plugins_and_the_step(tussle):
    text = tussle("describe", "game.xml", "--set", "n=4").stdout
    for words in (
        "prey 1 4 Boids",
        "hunters 2 2 Predator(max_speed=35.0)",
        "2 autonomy prey: Boids",
        "grade: portable",
    ):
        assert any(line.split() == words.split() for line in text.splitlines()), words


def test_check_says_that_a_mission_can_be_played(tussle, folder):
    done = tussle("check", "game.xml")
    assert done.stdout == "game.xml can be played: 12 entities, grade portable\n"
    assert [p.name for p in folder.iterdir()] == ["game.xml"]
    one = "<entity><team_id>1</team_id><color>1 2 3</color><motion_model>Still</motion_model></entity>"
    (folder / "one.xml").write_text(f"<runscript><run end='1' dt='0.1'/>{one}</runscript>")
    done = tussle("check", "one.xml")
    assert done.stdout == "one.xml can be played: 1 entity, grade portable, 1 note\n"
    assert done.stderr == "note: one.xml:1: kept for the viewer: entity color\n"


def test_the_schema_has_own_plugins_and_tells_of_those_it_lacks(tussle, folder):
    (folder / "mine.py").write_text(
        'from tussle.stock import Boids\n\n\nclass Mine(Boids):\n    """Sheep. They sleep."""\n'
    )
    (folder / "wrong.py").write_text("import no_such_module\n")
    done = tussle(
        "schema", "--plugin-path", "mine.py", "--plugin-path", "wrong.py", code=terminal.WRONG_INPUT
    )
    assert '<xs:enumeration value="Mine">' in done.stdout
    assert done.stdout.rstrip().endswith("</xs:schema>")
    assert "no_such_module" in done.stderr
