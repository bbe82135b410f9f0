"""`tussle doctor`: what is installed, and a self-test."""

from __future__ import annotations

import importlib.metadata

from tussle.cli import doctor, terminal
from tussle.cli.play_options import DoctorOptions


def test_it_shows_what_is_installed_and_plays_the_self_test(process):
    text = " ".join(process("doctor").stdout.split())
    assert f"numba {importlib.metadata.version('numba')}" in text
    for extra in ("batch", "cluster", "frames", "view"):
        assert f"extra {extra} installed" in text
    assert "self-test passed" in text


def test_another_result_is_an_error(monkeypatch):
    monkeypatch.setattr(doctor, "STEPS", 20)
    assert doctor.doctor(DoctorOptions()) == terminal.WRONG_INPUT


def test_a_missing_package_is_named_with_the_extra_that_brings_it(tussle, folder, monkeypatch):
    info = folder / "site/tussle-9.dist-info"
    info.mkdir(parents=True)
    needs = ["numba>=0.61", "optuna>=4.0; extra == 'batch'", "no-such-package; extra == 'batch'"]
    lines = "".join(f"Requires-Dist: {need}\n" for need in needs)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: tussle\nVersion: 9\n{lines}")
    monkeypatch.syspath_prepend(folder / "site")
    text = " ".join(tussle("doctor").stdout.split())
    assert "extra batch not installed: no-such-package; pip install 'tussle[batch]'" in text
