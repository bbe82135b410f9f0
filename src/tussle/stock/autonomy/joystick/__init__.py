"""JoystickAutonomy and JoystickController: commands by hand."""

from tussle.stock.autonomy.joystick.plugin import JoystickAutonomy, JoystickButtons, JoystickController

__all__ = ["JoystickAutonomy", "JoystickButtons", "JoystickController"]
