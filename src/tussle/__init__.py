"""tussle: thousands of robots in one 3D world, played fast and repeatably."""

from tussle.engine.result import WorldResult
from tussle.engine.simulation import Simulation
from tussle.errors import TussleError
from tussle.mission import Block, Mission
from tussle.scene import Scene

__all__ = ["Block", "Mission", "Scene", "Simulation", "TussleError", "WorldResult", "__version__"]

__version__ = "0.1.0.dev0"
