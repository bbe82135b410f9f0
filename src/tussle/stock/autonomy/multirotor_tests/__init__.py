"""MultirotorTests: constant pulse widths for the rotors of a multirotor."""

from tussle.stock.autonomy.multirotor_tests.plugin import MultirotorTests

__all__ = ["MultirotorTests"]
