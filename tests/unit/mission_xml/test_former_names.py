"""Names of plugins in former versions of SCRIMMAGE."""

from __future__ import annotations

import pytest

from tussle.errors import MissionError
from tussle.mission.catalogue import historic
from tussle.plugins import stock


def test_a_former_name_of_the_same_law_is_read_with_a_note(files):
    loaded = files.world("<network range='50'>UnitDisk</network>")
    assert any("UnitDisk is the former name of SphereNetwork" in note for note in loaded.notes)
    (network,) = (n for n in loaded.mission.networks if isinstance(n, stock.load("SphereNetwork")))
    assert network.values["range"] == 50.0
    inside = "<controller>Unicycle3DControllerDirect</controller><motion_model>Unicycle3D</motion_model>"
    (controller,) = files.entity(inside).controller
    assert type(controller) is stock.load("DirectController")


@pytest.mark.parametrize("name", historic()["replaced"])
def test_other_former_names_are_errors_with_the_nearest_plugin(files, name):
    now = historic()["replaced"][name]
    with pytest.raises(
        MissionError, match=f"{name} is a plugin of former versions of SCRIMMAGE; {now} is the nearest"
    ):
        files.entity(f"<autonomy>{name}</autonomy>")


@pytest.mark.parametrize("name", historic()["nowhere"]["names"])
def test_plugins_that_scrimmage_lacks_too_are_told_as_such(files, name):
    with pytest.raises(MissionError, match=f"{name} is nowhere: SCRIMMAGE does not have it either"):
        files.entity(f"<autonomy>{name}</autonomy>")


def test_the_plugins_that_stand_for_former_ones_exist():
    names = {*historic()["former"].values(), *historic()["replaced"].values()}
    assert names <= set(stock.manifest())
    assert not {*historic()["former"], *historic()["replaced"], *historic()["nowhere"]["names"]} & set(
        stock.manifest()
    )
