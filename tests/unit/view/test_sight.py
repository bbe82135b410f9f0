"""Pictures show what sensors see: the angles, the range and the mounting of the plugin."""

import math
import re

import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output, Param
from tussle.plugins import stock
from tussle.stock import (
    Boids,
    ContactBlobCamera,
    DepthCamera,
    FieldOfView,
    Predator,
    RayTrace,
    SingleIntegrator,
)
from tussle.view import Live
from tussle.view.page.document import game_document, view_data
from tussle.view.sight import field_of_view


class Watcher(Autonomy):
    """A stranger's plugin."""

    fov = Param(math.radians(120.0), unit="rad", text_unit="deg")
    sensing_range = Param(40.0, unit="m")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[:] = 0.0


@pytest.mark.parametrize(
    ("plugin", "azimuth", "elevation", "reach"),
    [
        (FieldOfView(azimuth_fov=math.radians(120.0)), 120.0, 60.0, 500.0),
        (FieldOfView(azimuth_fov=math.tau), 360.0, 60.0, 500.0),
        (ContactBlobCamera(), 45.0, 45.0, 2000.0),
        (DepthCamera(max_range=12.0), 80.0, 64.0, 12.0),
        (RayTrace(num_rays_horiz=31, angle_res_horiz=math.radians(3.0)), 90.0, 0.0, 30.0),
        (Boids(fov_az=math.radians(200.0), fov_el=math.radians(90.0)), 200.0, 90.0, 200.0),
        (Watcher(), 120.0, None, 40.0),
    ],
)  # fmt: skip
def test_a_field_of_view_is_that_of_the_plugin(plugin, azimuth, elevation, reach):
    view = view_data(field_of_view(plugin))
    assert (view["azimuth"], view["elevation"], view["range"]) == pytest.approx(
        (azimuth, elevation, reach), nan_ok=True
    )


@pytest.mark.parametrize(
    "plugin", [Boids(), Predator(), FieldOfView(azimuth_fov=math.tau, elevation_fov=math.pi)]
)
def test_who_sees_all_around_has_nofield_of_view(plugin):
    assert field_of_view(plugin) is None


def test_a_camera_is_where_it_is_mounted():
    view = field_of_view(DepthCamera(xyz=(1.0, 2.0, 3.0), rpy=(0.0, math.pi / 2, 0.0)))
    assert view.pos == (1.0, 2.0, 3.0)
    half = math.sqrt(0.5)
    assert view.quat == pytest.approx((half, 0.0, half, 0.0))


def test_every_sensor_with_an_angle_of_view_has_one():
    named = re.compile("fov|field_of_view|angle_res")
    sensors = [
        p for p in (getattr(stock, name) for name in stock.examples()) if any(map(named.search, p.params()))
    ]
    assert {"FieldOfView", "ContactBlobCamera", "DepthCamera", "RayTrace"} <= {p.__name__ for p in sensors}
    for sensor in sensors:
        assert field_of_view(sensor()) is not None or sensor is Boids, sensor


def test_the_page_has_the_fields_of_view_of_each_block():
    guard = Block(
        name="guard",
        team=1,
        autonomy=Watcher(),
        motion=SingleIntegrator(),
        sensor=FieldOfView(azimuth_fov=2.0),
    )
    prey = Block(name="prey", team=2, autonomy=Watcher(fov=math.tau), motion=SingleIntegrator())
    with Simulation(Mission(blocks=[guard, prey]), 1) as simulation, Live(simulation, threaded=False) as live:
        blocks = game_document(live)["blocks"]
    assert [[view["plugin"] for view in block["views"]] for block in blocks] == [
        ["Watcher", "FieldOfView"],
        [],
    ]
    assert blocks[0]["views"][1]["azimuth"] == pytest.approx(math.degrees(2.0))
