"""Tables on a terminal of 80 columns."""

import re

import pytest
from rich.text import Text

from tussle.cli import terminal
from tussle.cli.tables import estimate, fact_list, number_tables

METRICS = (
    "captures",
    "collisions",
    "distance",
    "energy",
    "messages_sent",
    "time_alive",
    "turns",
    "waypoints",
)


@pytest.fixture
def seen(monkeypatch, capsys):
    """Prints tables on 80 columns; the lines."""
    monkeypatch.setenv("COLUMNS", "80")
    terminal.out.cache_clear()

    def lines(*arguments):
        terminal.put(*number_tables(*arguments))
        return capsys.readouterr().out.splitlines()

    yield lines
    terminal.out.cache_clear()


def test_numbers_are_whole_however_many_columns_there_are(seen):
    teams = ("1 prey", "2 keepers", "3 switchers with a name that is longer than its column")
    rows = [
        ("", [team, *(f"{100000 * place + i:,}" for i in range(8))]) for place, team in enumerate(teams, 1)
    ]
    lines = seen(["team", *METRICS], rows)
    assert max(map(len, lines)) <= 80
    words = " ".join(lines).split()
    for _, (_, *numbers) in rows:
        assert all(words.count(number) == 1 for number in numbers)
    assert all(words.count(name) == 1 for name in METRICS)
    heads = [line for line in lines if line.startswith(" team")]
    assert len(heads) == sum(line.startswith(" 2 keepers ") for line in lines) > 1


def test_a_table_that_fits_is_one_table(seen):
    lines = seen(["team", *METRICS[:3]], [("", ["1 prey", "1", "2", "3"])])
    assert [line.split() for line in lines if "─" not in line] == [
        [],
        ["team", *METRICS[:3]],
        ["1", "prey", "1", "2", "3"],
    ]


def test_a_text_wider_than_the_terminal_is_folded(seen):
    lines = seen(["error", "runs"], [("", ["x" * 200, "7"])])
    assert max(map(len, lines)) <= 80
    assert sum(line.count("x") for line in lines) == 200


@pytest.mark.parametrize(
    ("numbers", "text"),
    [
        ((12.34, 11.9, 12.8), "12.34 (11.90–12.80)"),
        ((0.5, -1.0, 2.0), "0.5 (-1.0 to 2.0)"),
        ((3.0, 3.0, 3.0), "3"),
        ((3.25, float("nan"), float("nan")), "3.25"),
    ],
)
def test_an_estimate_has_the_digits_that_its_interval_allows(numbers, text):
    assert estimate(*numbers) == text


@pytest.mark.parametrize("columns", ["1", "40", "80"])
@pytest.mark.parametrize("is_terminal", [False, True])
def test_what_is_copied_from_facts_stays_whole(monkeypatch, capsys, columns, is_terminal):
    path, hash_ = f"runs/a folder/{'long' * 40}", "910ad8642bda15860bd1babd661511e0"
    words = "335 × real time (1.49 s, 1.00 CPU s), ready after 5.1 s"
    monkeypatch.setenv("COLUMNS", columns)
    if is_terminal:
        monkeypatch.setenv("FORCE_COLOR", "1")
    terminal.out.cache_clear()
    try:
        terminal.put(
            fact_list([("speed", words), ("none", ""), ("hash", hash_), ("run", Text(f"{path}\ntussle --from {path}:0"))])
        )  # fmt: skip
    finally:
        terminal.out.cache_clear()
    shown = re.sub(r"\x1b\[\d*m", "", capsys.readouterr().out)
    lines = shown.splitlines()
    assert lines[0] == ""
    assert [line[1:6] for line in lines[1:] if line[1] != " "] == ["speed", "hash ", "run  "]
    assert all(line.startswith(" " * 8) for line in lines[1:] if line[1] == " ")
    assert [line[8:] for line in lines[-3:]] == [hash_, path, f"tussle --from {path}:0"]
    assert " ".join(line[8:] for line in lines[1:-3]) == words
    assert max(map(len, lines[1:-3])) <= max(int(columns), 20)
