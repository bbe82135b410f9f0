"""MotorSchemas: the weighted mean of behaviours."""

from tussle.plugins.stock.autonomy.motor_schemas.plugin import MotorSchemas

__all__ = ["MotorSchemas"]
