"""Motion models: state equation, integration, and conversion from and to the body table."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from tussle.api.bodies import DERIVED, OFFSETS, Bodies, derive
from tussle.api.group import GroupView
from tussle.api.kinds import EntityPlugin
from tussle.api.mass import MassProperties
from tussle.api.range_kernel import RangeKernel
from tussle.api.row_laws import BODY_INPUTS, advance_rows
from tussle.declare.columns import Channel, Param, State
from tussle.errors import DeclarationError, ParameterError, listed, nearest_name
from tussle.numeric.arrays import numbers_of
from tussle.numeric.paths import GRAVITY
from tussle.numeric.quaternion import quat_from_euler
from tussle.numeric.rk4 import compile_derivative, rk4

WRITABLE = ("pos", "quat", "vel", "omega")


class MotionBody(GroupView):
    """View of a motion model on the body table; pos, vel, quat and omega are writable.

    Attributes:
        span: Rows [first, last) of the view for which yaw, climb, roll and forward are computed; they are 0 elsewhere.
        forward_speed: Speed along the body x axis [m/s], (n,).
        table: Storage of the body table, starting with the rows of pos, vel, quat and omega, (>= 13, N); columns first to first + n - 1
            belong to this view; for kernels.
    """

    _called = "body"

    def reset(self, bodies: Bodies, first: int, last: int) -> None:
        super().reset(bodies, first, last)
        self.span = (0, self.n)

    def __getattr__(self, name: str) -> Any:
        if name in WRITABLE:
            array = getattr(self._bodies, name)[:, self.first : self.last]
            self.__dict__[name] = array
            self._seen.add(name)
            return array
        if name == "forward_speed":
            east, north, up = self.forward
            vx, vy, vz = self.vel
            return vx * east + vy * north + vz * up
        return super().__getattr__(name)

    @property
    def table(self) -> np.ndarray:
        return self._bodies.floats

    def _derive(self, name: str) -> np.ndarray:
        # Computed without the table's cache, which is outdated while a model writes quaternions.
        k, (first, last) = DERIVED[name], self.span
        out = np.zeros((k, self.n) if k > 1 else self.n)
        derive(name, self._bodies.quat, self.first + first, self.first + last, self.first, out)
        return out

    def remove(self, row: int) -> None:
        """Remove the entity of a row at the end of this step, by a health of 0."""
        self._bodies.health[self.first + row] = 0.0

    def set_attitude(self, roll: Any = 0.0, climb: Any = 0.0, yaw: Any = 0.0) -> None:
        """Write quat from bank (right wing down positive), elevation (nose up positive) and heading [rad], each (n,) or a number."""
        flat = np.zeros(self.n)
        self.quat[:] = quat_from_euler(flat + roll, flat - climb, flat + yaw)


class MotionModel(EntityPlugin):
    """The dynamics of an entity: x' = f(x, u); abstract.

    A model declares one `State` with named fields, its inputs and parameters, and `derivative`: a static function whose arguments
    are matched by name to fields, inputs, parameters, force_x ... torque_z (world frame) and mass, and which returns the
    derivatives of the fields in order. Columns with fields, force and torque can be taken whole, as tuples; structural parameters
    are constants. It is integrated by the shared fourth-order Runge-Kutta method. Alternatively, a model consists of `row_law`s,
    which also return body columns, so that one kernel can run controllers with row laws and the model in all substeps; or it has
    a kernel: `advance = kernel` with arguments (x, u, p, dt, substeps), x (m, n), u (k, n) inputs and p (q, n) parameters in
    order of declaration; or a property `advance` that returns the kernel of the structural variant. With `range_kernel` several threads
    share the rows, and controllers with row laws and the model run in one kernel.

    Raises:
        DeclarationError: There is not exactly one state, it is a list, or an argument of `derivative` is unknown.
    """

    kind = "motion"
    derivative: Any = None
    abstract: ClassVar[bool] = True
    reads_all: ClassVar[bool] = False
    """All channels of the entity are computed, since they are read from outside."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for name, column in cls.columns.items():
            if isinstance(column, (State, Channel)) and column.ragged:
                raise DeclarationError(
                    f"{cls.__name__}.{name}: in a motion model, only parameters can be lists"
                )
        own = vars(cls).get("advance")
        if own is not None and not isinstance(own, (property, staticmethod)):
            cls.advance = staticmethod(own)  # type: ignore[method-assign]  # a plain function would become a method
        if cls.derivative is None and cls.advance is MotionModel.advance and not cls.row_laws:
            return
        states = [c for c in cls.states().values() if c.fields]
        if len(states) != 1:
            raise DeclarationError(
                f"{cls.__name__} declares {len(states)} states with fields; a motion model must have one, such as x = State('east north')"
            )
        if cls.derivative is not None:
            named = [*cls._named_numbers(), *(k for k, c in cls.params().items() if c.structural)]
            allowed = list(
                dict.fromkeys(
                    (*states[0].fields, *cls._input_names(), *cls._param_names(), *named, *BODY_INPUTS)
                )
            )
            for name in inspect.signature(cls.derivative).parameters:
                if name not in allowed:
                    raise DeclarationError(
                        f"{cls.__name__}.derivative has an argument {name!r}{nearest_name(name, allowed)} that is no state, input, "
                        f"parameter, force, torque or mass; {listed(allowed)}"
                    )

    @classmethod
    def state(cls) -> State:
        """Declaration of the state vector."""
        return next(c for c in cls.states().values() if c.fields)

    @classmethod
    def _input_names(cls) -> list[str]:
        return [channel for c in cls.inputs().values() for channel in c.channels]

    @classmethod
    def row_params(cls) -> dict[str, Param]:
        """Parameters that are columns, in order: the rows of `p`."""
        return {k: c for k, c in cls.params().items() if c.is_row_data}

    @classmethod
    def _param_names(cls) -> list[str]:
        return [name for k, c in cls.row_params().items() for name in _numbers(k, c)]

    @classmethod
    def _named_numbers(cls) -> dict[str, tuple[str, ...] | str]:
        """Further names in `derivative`: whole columns, and fields of parameters whose name is not taken."""
        found: dict[str, tuple[str, ...] | str] = {"force": BODY_INPUTS[:3], "torque": BODY_INPUTS[3:6]}
        found |= {k: c.fields for k, c in cls.states().items() if c.fields}
        found |= {k: c.channels for k, c in cls.inputs().items() if c.fields}
        fields: dict[str, list[str]] = {}
        for k, c in cls.row_params().items():
            found[k] = _numbers(k, c) if c.fields else k
            for field, number in zip(c.fields, _numbers(k, c), strict=False):
                fields.setdefault(field, []).append(number)
        return {**{k: numbers[0] for k, numbers in fields.items() if len(numbers) == 1}, **found}

    def active_inputs(self) -> list[str]:
        """Names of the inputs that this instance uses, in order of declaration; structural parameters may disable some."""
        return list(type(self).inputs())

    def input_channels(self) -> list[str]:
        """Channel names of the rows of `u`."""
        return [channel for k in self.active_inputs() for channel in type(self).inputs()[k].channels]

    def body_inputs(self) -> list[str]:
        """Components of force and torque, and mass, that the model takes."""
        if type(self).advance is not MotionModel.advance:
            return []
        names = {name for law in self.row_laws.values() for name in law.arguments}
        if self.derivative is not None and not names:
            names = set(inspect.signature(self.derivative).parameters)
        own = self._param_names()
        return [name for name in BODY_INPUTS if (name in names or name[:-2] in names) and name not in own]

    @property
    def range_kernel(self) -> RangeKernel | None:
        """A kernel that steps a range of rows, if the model has one; then `advance` is that of this kernel."""
        return None

    @property
    def advance(self) -> Any:
        """The compiled function (x, u, p, dt, substeps) that simulations and `rollout` call."""
        return advance_rows(self) if self.row_laws else self.solver()

    def solver(self) -> Any:
        """Runge-Kutta integration of `derivative`, as a function (x, u, p, dt, substeps)."""
        f = compile_derivative(
            type(self).derivative,
            list(self.state().fields),
            [*self.input_channels(), *self.body_inputs()],
            self._param_names(),
            self._named_numbers(),
            {k: self.values[k] for k, c in self.params().items() if c.structural},
        )
        return lambda x, u, p, dt, substeps: rk4(f, x, u, p, dt, substeps)

    # -- hooks --------------------------------------------------------------------------------------------------------------

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Set the state of `rows`, (m,), from the body table: at birth, and after world plugins have moved entities."""
        raise TypeError(f"{type(self).__name__} has no from_body")

    def to_body(self, body: MotionBody) -> None:
        """Write pos, quat, vel (and omega) of all rows from the state."""
        raise TypeError(f"{type(self).__name__} has no to_body")

    def mass_properties(self, body: MotionBody) -> MassProperties:
        """Mass, inertia and weight of all rows, by which e.g. the ground carries them and contacts push them.

        The mass is the parameter `mass`, or else that of the block. The weight of a model that takes `force_z` is this mass times
        the parameter `gravity_magnitude`, or else 9.81 m/s^2; other models have none. The inertia is 0. Override it in a model that
        takes `force_z` and does not fall, or falls by another law.
        """
        own = type(self).columns
        mass = self.mass if "mass" in own else body.mass
        gravity = self.gravity_magnitude if "gravity_magnitude" in own else GRAVITY
        falls = "force_z" in self.body_inputs()
        return MassProperties(mass, np.zeros((9, body.n)), mass * gravity if falls else np.zeros(body.n))

    # -- planning -----------------------------------------------------------------------------------------------------------

    def rollout(
        self, x0: Any, inputs: Any, dt: float, substeps: int = 1, params: Mapping[str, Any] | None = None
    ) -> np.ndarray:
        """Predict states for given inputs, with the function that simulations use: results are equal bit for bit.

        Call it on an unbound plugin (`Unicycle(vel_max=20).rollout(...)`); simulations are not affected.

        Args:
            x0: Initial states, (m,) or (m, n).
            inputs: One row per step, (T, k) or (T, k, n), in order of declaration.
            dt: Length of a step [s].
            substeps: Runge-Kutta steps per step; as in the simulation with the mission's motion_multiplier.
            params: Parameters that differ between the n columns, name -> (n,) or (k, n).

        Returns:
            (T + 1, m) or (T + 1, m, n), x0 first.

        Raises:
            ParameterError: A shape does not fit, a parameter is unknown, or the model's dynamics are outside: it has handles.
        """
        if self.handles():
            raise ParameterError(
                f"{type(self).__name__} has no rollout: its dynamics are in {', '.join(self.handles())}"
            )
        own = self.__dict__["_values"]
        where = f"{type(self).__name__}.rollout"
        x = numbers_of(x0, f"{where}: x0").copy()
        is_single = x.ndim == 1
        x = np.ascontiguousarray(x[:, None] if is_single else x)
        u = numbers_of(inputs, f"{where}: inputs")
        u = u[..., None] if u.ndim == 2 else u
        n, names = x.shape[1], [*self.input_channels(), *self.body_inputs()]
        if (
            x.shape[0] != self.state_size(self.state().name)
            or u.ndim != 3
            or u.shape[1] != len(names)
            or u.shape[2] not in (1, n)
        ):
            raise ParameterError(
                f"{type(self).__name__}.rollout: x0 is {np.shape(x0)} and inputs {np.shape(inputs)}; expected are "
                f"({self.state_size(self.state().name)}, n) for {', '.join(self.state().fields)} and "
                f"(T, {len(names)}) for {', '.join(names)}"
            )
        for key in params or {}:
            if key not in self.row_params():
                raise ParameterError(
                    f"{type(self).__name__} has no parameter {key!r}{nearest_name(key, self.row_params())}; {listed(self.row_params())}"
                )
        rows = []
        for key, column in self.row_params().items():
            value = numbers_of((params or {}).get(key, own[key]), f"{where}: {key}")
            value = value[:, None] if column.fields and value.ndim == 1 else value
            k = len(column.fields) or 1
            if value.ndim > 2 or any(
                have not in (1, m) for have, m in zip(value.shape[::-1], (n, k), strict=False)
            ):
                raise ParameterError(
                    f"{where}: {key} has shape {value.shape}; it takes ({f'{k}, ' if k > 1 else ''}{n})"
                )
            rows.append(np.broadcast_to(value, (k, n)))
        p = np.ascontiguousarray(np.concatenate(rows)) if rows else np.zeros((0, n))
        integrate = _advance_of(self)
        path = np.empty((len(u) + 1, *x.shape))
        path[0] = x
        for k in range(len(u)):
            integrate(x, np.ascontiguousarray(np.broadcast_to(u[k], (len(names), n))), p, dt, substeps)
            path[k + 1] = x
        return path[..., 0] if is_single else path


@lru_cache(maxsize=64)
def _advance_of(model: MotionModel) -> Any:
    """The compiled function of a model; to find it takes much longer than a short rollout."""
    return model.advance


def _numbers(name: str, param: Param) -> tuple[str, ...]:
    """Names of the numbers of a parameter among those of its plugin."""
    return tuple(f"{name}_{field}" for field in param.fields) or (name,)


assert [OFFSETS[name] for name in ("pos", "vel", "quat", "omega")] == [0, 3, 6, 10]  # as kernels write them
