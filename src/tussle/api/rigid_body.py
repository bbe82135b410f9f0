"""Motion models whose state is that of a rigid body."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import kernels
from tussle.api.bodies import DERIVED
from tussle.api.laws import BODY
from tussle.api.mass import MassProperties
from tussle.api.motion import MotionBody, MotionModel
from tussle.declare.columns import Param, State
from tussle.errors import ParameterError
from tussle.numeric.quaternion import quat_rotate_inverse
from tussle.numeric.row_kernel import Number, RowCall


class InertiaParam(Param):
    """An inertia tensor about the center of mass, body frame, written as `[ xx xy xz ] [ yx yy yz ] [ zx zy zz ]` or nine numbers.

    Args:
        default: The nine elements, row by row.
        unit: SI unit.
        text_unit: Unit in mission files, where it is not SI.
        doc: One-line description.

    Raises:
        ParameterError: The matrix is not positive definite.
    """

    def __init__(self, default: Any, *, unit: str = "kg*m^2", text_unit: str = "", doc: str = "") -> None:
        super().__init__(
            default, fields="xx xy xz yx yy yz zx zy zz", unit=unit, text_unit=text_unit, doc=doc
        )

    def _item(self, value: Any, where: str) -> Any:
        item = super()._item(value, where)
        xx, xy, xz, yx, yy, yz, zx, zy, zz = item
        xy, xz, yz = 0.5 * (xy + yx), 0.5 * (xz + zx), 0.5 * (yz + zy)
        minor = xx * yy - xy * xy
        if not (xx > 0.0 and minor > 0.0 and zz * minor > xx * yz * yz + yy * xz * xz - 2.0 * xy * yz * xz):
            raise ParameterError(
                f"{self._place(where)} = {item} is not allowed; an inertia tensor is positive definite"
            )
        return item


class PositiveParam(Param):
    """A positive size, such as a mass, without a smallest value: near 0 the equations become too stiff for any step.

    So the conformance kit tries a tenth of the default, and no number near 0.

    Args:
        default: Value in SI units.
        unit: SI unit.
        doc: One-line description.
    """

    def __init__(self, default: float, *, unit: str = "", doc: str = "") -> None:
        super().__init__(default, unit=unit, gt=0.0, doc=doc)


RIGID_BODY = tuple(Number(f"rigid_body {k}") for k in range(13))
"""The state of a rigid body as numbers of a row kernel."""
TO_COLUMNS = RowCall(
    kernels.columns_of_body,
    (RIGID_BODY,),
    tuple(
        Number(part)
        for name in ("pos", "vel", "quat", "omega", *DERIVED)
        for part, (column, _) in BODY.items()
        if column == name
    ),
)
"""The body columns that belong to the state of a rigid body, as `to_body` writes them."""


class RigidBodyModel(MotionModel):
    """A motion model with six degrees of freedom; abstract.

    A subclass adds `derivative`, which may take the state as the tuple `rigid_body` and compute its rates with the functions of
    `tussle.numeric.rigid_body`.
    """

    rigid_body = State(
        "x y z vx vy vz qw qx qy qz p q r",
        unit="m m m m/s m/s m/s 1 1 1 1 rad/s rad/s rad/s",
        doc="Position, velocity, world frame; quaternion body to world; angular velocity, body frame.",
    )

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Copy position, velocity, attitude and angular velocity."""
        quat = body.quat[:, rows]
        state = self.rigid_body
        state[:3, rows] = body.pos[:, rows]
        state[3:6, rows] = body.vel[:, rows]
        state[6:10, rows] = quat
        state[10:13, rows] = quat_rotate_inverse(quat, body.omega[:, rows])

    def to_body(self, body: MotionBody) -> None:
        """Write position, velocity, attitude and angular velocity."""
        kernels.write_rigid_bodies(self.rigid_body, body.table, body.first)

    def mass_properties(self, body: MotionBody) -> MassProperties:
        """As for other models; the inertia tensor is the first `InertiaParam`, if the model has one."""
        tensors = [name for name, column in type(self).params().items() if isinstance(column, InertiaParam)]
        found = super().mass_properties(body)
        return found._replace(inertia=getattr(self, tensors[0])) if tensors else found
