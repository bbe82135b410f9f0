"""MultirotorTests: constant pulse widths for the rotors of a multirotor."""

from tussle.plugins.stock.autonomy.multirotor_tests.plugin import MultirotorTests

__all__ = ["MultirotorTests"]
