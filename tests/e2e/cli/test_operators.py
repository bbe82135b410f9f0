"""People who operate teams: how they are named to tussle view, and how tussle analyze compares their games."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize(
    ("operators", "reason"),
    [
        (["Ada"], "--operator 'Ada' is not allowed; it takes a name and a team: 'Ada=team 1'"),
        (["Ada=1"], "--operator 'Ada=1' is not allowed"),
        (["x" * 9000], "xxx..."),
        (["Ada=team 1", "Ada=team 2"], "--operator: a name is given twice"),
        (["Ada=team 1", "ada=team 2"], "operator: 'ada' and 'Ada' look alike"),
        (["Ada=team 7"], "operator: 'Ada' cannot operate team 7; there are: 1, 2"),
        (["=team 1"], "operator: '' is not allowed"),
    ],
)
def test_operators_that_cannot_be_are_refused_before_anything_is_recorded(tussle, folder, operators, reason):
    options = [text for each in operators for text in ("--operator", each)]
    code = 2 if "--operator" in reason or "..." in reason else 1
    done = tussle("view", "game.xml", "--no-browser", "--record", "run", *options, code=code)
    assert reason in " ".join(done.stderr.split())
    assert len(done.stderr) < 2000
    assert not (folder / "run").exists()
