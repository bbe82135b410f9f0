"""Each law of SCRIMMAGE plays as it did."""

from __future__ import annotations

import pytest
from historic_runs import folder_of, folders, kept, play

from tussle.plugins import historic


def test_all_laws_are_kept():
    assert sorted(kept()) == folders()
    assert len({*kept().values()}) == len(kept())


@pytest.mark.parametrize("folder", folders())
def test_an_example_plays_as_kept(folder):
    number, played = play(folder)
    own = {path for name, path in historic.manifest().items() if folder_of(name) == folder}
    assert own & played, "the example does not play the law"
    assert number == pytest.approx(kept()[folder], abs=1e-7)
