"""Limits that are set per world are checked together, as those of a mission are."""

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.engine.params import Overrides
from tussle.errors import ParameterError
from tussle.mission.catalogue import KINDS
from tussle.plugins import stock
from tussle.stock import GoTo, Multirotor, RayTrace, SingleIntegrator

SLOTS = {
    "entity_interaction": "interactions",
    "metrics": "metrics",
    "network": "networks",
    "motion_model": "motion",
}


def pairs():
    """Class, lower and upper limit, and values that no plugin of the class takes together, of all stock plugins that compare some."""
    for cls in map(stock.load, stock.manifest()):
        declared = cls.params()
        for low in declared:
            high = low.replace("min", "max")
            if high == low or high not in declared or declared[low].structural or declared[high].structural:
                continue
            for least, most in ((declared[high].default, declared[low].default), (2.0, 1.0), (-1.0, -2.0)):
                try:
                    cls(**{low: least, high: most})
                except ParameterError as error:
                    if "must not be larger" in str(error) or "must be smaller" in str(error):
                        yield cls, low, high, least, most
                        break


PAIRS = list(pairs())


def mission_of(cls):
    """A mission with a plugin, and the path of the plugin."""
    tag = next(tag for tag, kind in KINDS.items() if issubclass(cls, kind))
    slot = SLOTS.get(tag, tag)
    is_inside = slot in ("autonomy", "controller", "sensor", "motion")
    block = Block(name="a", **{"motion": Multirotor(), **({slot: cls()} if is_inside else {})})
    mission = Mission(blocks=[block], **({} if is_inside else {slot: cls()}))
    return mission, f"{'a.' * is_inside}{cls.__name__}"


def test_most_limits_are_compared():
    assert len({(cls, low) for cls, low, *_ in PAIRS}) >= 12


@pytest.mark.parametrize("case", PAIRS, ids=lambda case: f"{case[0].__name__}.{case[1]}")
def test_limits_of_a_world_in_the_wrong_order_are_refused_and_nothing_is_set(case):
    cls, low, high, least, most = case
    mission, path = mission_of(cls)
    params = cls.params()
    fine = {f"{path}.{low}": params[low].default, f"{path}.{high}": params[high].default}
    wrong = {f"{path}.{low}": least, f"{path}.{high}": most}
    worlds = np.arange(3)
    values = Overrides(mission, 3)
    mixed = {name: [fine[name], wrong[name], fine[name]] for name in fine}
    with pytest.raises(ParameterError, match=rf"^world 1: .*{cls.__name__}.{low} = .* with {high} = "):
        values.set(mixed, worlds)
    assert not values.columns
    values.set(fine, worlds)
    with pytest.raises(ParameterError, match="world 2: "):
        values.set(wrong, worlds[2:])
    assert values.given.keys() == {(*key[:2], name) for key in values.given for name in (low, high)}


def test_a_limit_is_compared_with_what_its_world_has():
    lidar = RayTrace(min_range=1.0, max_range=10.0)
    block = Block(name="a", count=2, sensor=lidar, autonomy=GoTo(), motion=SingleIntegrator())
    mission = Mission(blocks=[block], end=1.0)
    path = "a.RayTrace"
    with pytest.raises(
        ParameterError, match=r"world 1: 'a': RayTrace.min_range = 20.0 with max_range = 10.0"
    ):
        Simulation(mission, [1, 2], params={f"{path}.min_range": [5.0, 20.0]})
    with Simulation(mission, [1, 2], params={f"{path}.max_range": [30.0, 10.0]}) as simulation:
        before = simulation.state_hash(0), simulation.state_hash(1)
        with pytest.raises(ParameterError, match="world 1: "):
            simulation.reset([0, 1], params={f"{path}.min_range": 20.0})
        assert (simulation.state_hash(0), simulation.state_hash(1)) == before
        simulation.reset([0], params={f"{path}.min_range": 20.0})
        assert simulation.read("a.RayTrace.min_range")[0].tolist() == [[20.0, 20.0], [1.0, 1.0]]
