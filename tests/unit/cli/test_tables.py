"""Tables on a terminal of 80 columns."""

import pytest

from tussle.cli import terminal
from tussle.cli.tables import estimate, number_tables

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
