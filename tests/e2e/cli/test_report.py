"""tussle report: the page of a batch."""

from __future__ import annotations

import numpy as np
import pytest
from made_batches import made_batch, write_batch


@pytest.fixture
def played(folder):
    """A batch of thirty games."""
    rng = np.random.default_rng(1)
    return write_batch(
        made_batch({2: rng.poisson(9.0, (30, 1)), 3: rng.poisson(7.0, (30, 1))}), folder / "played"
    )


def test_the_report_lies_in_the_batch_and_its_path_is_printed(tussle, played):
    said = tussle("report", "played")
    page = played / "report" / "index.html"
    assert said.stdout.startswith("played/report/index.html (")
    assert "keepers won" in page.read_text()
    assert (played / "report" / "wins.svg").is_file()
    assert (played / "report" / "wins.png").is_file()
    assert said.stderr == ""


def test_it_can_lie_elsewhere_and_show_more(tussle, played, folder):
    tussle("report", "played", "--out", "page", "--quantity", "score[2]-score[3]")
    assert not (played / "report").exists()
    assert 'id="plot-distribution-score_2_score_3"' in (folder / "page" / "index.html").read_text()


def test_what_it_cannot_do_is_told(tussle, played, folder):
    assert "there is no such batch directory" in tussle("report", "nowhere", code=4).stderr
    assert "did you mean 'score[2]'?" in tussle("report", "played", "--quantity", "scor[2]", code=1).stderr
    (folder / "taken").write_text("a file")
    assert (
        "taken: the report cannot be written" in tussle("report", "played", "--out", "taken", code=4).stderr
    )
