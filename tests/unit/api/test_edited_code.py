"""Code of authors that changes: a global set anew in an interactive shell, and a file whose lines have moved."""

from __future__ import annotations

import re
from importlib.util import module_from_spec, spec_from_file_location

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.errors import PluginError
from tussle.numeric.kernel import refresh_kernels
from tussle.stock import SingleIntegrator, Unicycle

HEAD = '''
import numpy as np
from tussle.api import *
from tussle.numeric.kernel import device, kernel
LIMIT = {limit}
FACTOR = 2.0

def twice(x):
    return FACTOR * x

def is_wide(distance):
    return FACTOR < 3.0

@device
def times(x):
    return FACTOR * x

@kernel("F Fw")
def scale(x, y):
    for i in range(x.shape[0]):
        if x[i] > LIMIT:
            raise ValueError("kernel")
        y[i] = times(1.0)

class Base(Autonomy):
    """Flies east."""
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
'''
PLUGINS = {
    "neighbour law": (
        '''
class V(Base):
    """A law with a constant."""
    @neighbors(1e6, far="max")
    @staticmethod
    def law(distance):
        return FACTOR + 0.0 * distance
    def step(self, g):
        self.velocity[0] = self.law(g).far
''',
        "v.V.velocity",
    ),
    "function called by a neighbour law": (
        '''
class V(Base):
    """A law that calls another function."""
    @neighbors(1e6, far="max")
    @staticmethod
    def law(distance):
        return twice(1.0) + 0.0 * distance
    def step(self, g):
        self.velocity[0] = self.law(g).far
''',
        "v.V.velocity",
    ),
    "condition of laws": (
        '''
class V(Base):
    """Laws with a common condition."""
    @neighbors(1e6, n="sum")
    @staticmethod
    def law(distance):
        return 2.0
    both = together(law, where=is_wide)
    def step(self, g):
        self.velocity[0] = self.both(g).law_n
''',
        "v.V.velocity",
    ),
    "kernel": (
        '''
class V(Base):
    """A kernel."""
    def step(self, g):
        scale(g.components("pos")[0], self.velocity[0])
''',
        "v.V.velocity",
    ),
    "device called by Python": (
        '''
class V(Base):
    """A device."""
    def step(self, g):
        self.velocity[0] = times(1.0)
''',
        "v.V.velocity",
    ),
    "row law": (
        '''
class V(Controller):
    """A row law."""
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")
    @row_law("speed", "turn_rate", "pitch_rate")
    @staticmethod
    def law(pos_x):
        if pos_x > LIMIT:
            raise ValueError("row law")
        return FACTOR, 0.0, 0.0
''',
        "v.V.speed",
    ),
    "derivative": (
        '''
class V(MotionModel):
    """A state equation."""
    x = State("a b c", unit="m")
    @staticmethod
    def derivative(a):
        if a > LIMIT:
            raise ValueError("derivative")
        return FACTOR * 10.0, 0.0, 0.0
    def from_body(self, body, rows):
        self.x[:, rows] = body.pos[:, rows]
    def to_body(self, body):
        body.pos[:] = self.x
        body.vel[0] = FACTOR
''',
        "v.V.x",
    ),
}
RAISING = ("kernel", "row law", "derivative")


def loaded(path, name, limit=1e9, lines_above=0):
    """Module of a file with a plugin V, and a mission of it."""
    text = HEAD.format(limit=limit) + PLUGINS[name][0]
    path.write_text("\n" * lines_above + text)
    spec = spec_from_file_location(path.stem, path)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    own = {"autonomy": {"motion": SingleIntegrator()}, "controller": {"motion": Unicycle(vel_max=90.0)}}
    plugins = own.get(module.V.kind, {}) | {module.V.kind: module.V()}
    return module, Mission(blocks=[Block(name="v", count=2, variance=(9, 9, 0), **plugins)], end=0.3)


def number_of(mission, column):
    simulation = Simulation(mission)
    before = simulation.read(column)[0][0, 0].flat[0]
    simulation.step(1)
    after = simulation.read(column)[0][0, 0].flat[0]
    return after - before if column == "v.V.x" else after


@pytest.mark.parametrize("name", PLUGINS)
def test_a_new_simulation_runs_with_a_global_that_was_set_anew(name, tmp_path):
    module, mission = loaded(tmp_path / "constants.py", name)
    column = PLUGINS[name][1]
    first = number_of(mission, column)
    assert first == pytest.approx(2.0)
    module.FACTOR = 5.0
    assert number_of(mission, column) == pytest.approx(0.0 if name == "condition of laws" else 5.0)
    module.FACTOR = 2.0
    assert number_of(mission, column) == first


def test_a_kernel_that_is_called_without_a_simulation_follows_when_it_is_asked_to(tmp_path):
    module, _ = loaded(tmp_path / "constants.py", "kernel")
    result = np.empty(1)
    module.scale(np.zeros(1), result)
    address = module.scale.address
    module.FACTOR = 7.0
    refresh_kernels()
    module.scale(np.zeros(1), result)
    assert result[0] == 7.0
    assert module.scale.address != address


@pytest.mark.parametrize("name", RAISING)
def test_an_error_names_the_line_where_the_function_is_now(name, tmp_path):
    path = tmp_path / "lines.py"
    for lines_above in (0, 7):
        _, mission = loaded(path, name, limit=-1e9, lines_above=lines_above)
        line = 1 + path.read_text().splitlines().index(f'            raise ValueError("{name}")')
        with pytest.raises(PluginError, match=rf"lines\.py:{line}: ValueError: {re.escape(name)}"):
            Simulation(mission).run()
