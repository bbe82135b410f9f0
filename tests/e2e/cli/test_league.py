"""`tussle league` plays, continues and shows a league, and `tussle train --against` trains against a pool."""

from __future__ import annotations

import json
import re

import pytest
from cli_process import call
from needs import NEEDS

pytest.importorskip("onnx", reason="onnx is not installed: pip install 'tussle[policy]'")
pytest.importorskip("onnxruntime", reason="onnxruntime is not installed: pip install 'tussle[policy]'")

from leagues import CHASE, constant

from tussle.record import load_run


def test_a_league_has_a_table_a_page_and_replays(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    constant(tmp_path / "still.onnx", -1.0)
    constant(tmp_path / "run" / "policy.onnx", -0.9)
    command = (
        "league",
        "test/Chase-v0",
        "--plugin-path",
        CHASE,
        "--players",
        "rules,still.onnx,slow=run/policy.onnx",
        "--games",
        4,
    )
    done = call(*command, "-o", "out")
    assert done.returncode == 0, done.stderr
    assert re.search(r"rules +\+\d+ +[+-]\d+ – \+\d+ +8 +0 +0\s", done.stdout)
    assert re.search(r"rules – still +4 +0 +0 +100.0 %", done.stdout)
    page = (tmp_path / "out" / "league.html").read_text()
    replays = re.findall(r'href="(runs/\d+\.html)"', page)
    assert len(replays) == 3
    for replay in replays:
        assert (tmp_path / "out" / replay).read_text().startswith("<!doctype html>")
        assert load_run((tmp_path / "out" / replay).with_suffix("")).is_complete
    found = json.loads(call(*command, "-o", "out", "--json").stdout)
    assert found == json.loads((tmp_path / "out" / "league.json").read_text())
    assert found["ratings"][0]["name"] == "rules"
    other = json.loads(call(*command, "-o", "two", "--json", "--processes", 2, "--stack", 1).stdout)
    assert other == found
    assert (tmp_path / "two" / "league.html").read_text().replace("league two", "league out") == page
    assert "there is no file rule" in call(*command[:-3], "rule", "-o", "three").stderr


def test_self_play_trains_and_repeats(tmp_path, monkeypatch):
    pytest.importorskip("torch", reason=NEEDS["torch"].reason)
    monkeypatch.chdir(tmp_path)
    command = (
        "train",
        "test/Chase-v0",
        "--plugin-path",
        CHASE,
        "--against",
        "latest=1,past=2",
        "--worlds",
        2,
        "--minutes",
        0.0001,
    )
    policies = []
    for name in ("a", "b"):
        done = call(*command, "--out", name)
        assert done.returncode == 0, done.stderr
        policies.append((tmp_path / name / "policy.onnx").read_bytes())
        assert (tmp_path / name / "pool" / "00-latest.onnx").read_bytes() == policies[-1]
        assert len(list((tmp_path / name / "pool").iterdir())) == 3
    assert policies[0] == policies[1]
