"""JoystickAutonomy and JoystickController: manual commands."""

from tussle.plugins.stock.autonomy.joystick.plugin import (
    JoystickAutonomy,
    JoystickButtons,
    JoystickController,
)

__all__ = ["JoystickAutonomy", "JoystickButtons", "JoystickController"]
