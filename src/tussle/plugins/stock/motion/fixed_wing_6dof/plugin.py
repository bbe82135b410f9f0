"""An aircraft with linear aerodynamic derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import (
    GroupView,
    HistoricAttributes,
    InertiaParam,
    Input,
    MotionBody,
    Param,
    PositiveParam,
    RigidBodyModel,
    State,
)
from tussle.numeric.rigid_body import newton_euler, to_body, to_world
from tussle.plugins.stock.motion.fixed_wing_6dof import kernels

SLUG_FT_SQ = 1.3558179483314004  # kg m^2, from the foot and the pound of 1959 and standard gravity
MOMENT = "beta p r delta_aileron delta_rudder"
SKYHAWK = tuple(SLUG_FT_SQ * i for i in (8090.0, 0.0, 1300.0, 0.0, 25900.0, 0.0, 1300.0, 0.0, 29200.0))
RASCAL = tuple(SLUG_FT_SQ * i for i in (1.95, 0.0, 0.0, 0.0, 1.55, 0.0, 0.0, 0.0, 1.91))


class FixedWing6DOF(RigidBodyModel):
    """A fixed-wing aircraft: Newton's and Euler's equations with linear aerodynamic derivatives, thrust along the body x axis.

    m v' = R (air force + thrust) - m g, I w' = air moment - w x I w. The rate of the angle of attack is computed from the
    state, not as a difference. Lift saturates at its value for an angle of attack of 26 degrees; up to 11 degrees it is linear within
    1 %. A throttle in [throttle_input_min, throttle_input_max] gives a thrust in [thrust_min, thrust_max]; surfaces are clamped.
    Positive elevator lowers the nose, positive aileron the right wing; rudder by C_n_delta_rudder. The defaults are the A-4D
    Skyhawk (Nelson 1998, "Flight stability and automatic control", appendix B), also called FixedWing6DOF-A-4D.

    Differences from SCRIMMAGE: air loads, weight and gyroscopic moment are those of each stage of the integration
    (there, of the start of the step); the rate of the angle of attack is used (there, 0); the wind is subtracted (there, added);
    the aspect ratio is span^2 / area (there, span / chord); lift is limited (there, it grew up to backward flight); the side
    force acts along the body y axis; drag by the elevator is read; the throttle is clamped to its range (there, to [-1, 1], which
    gave three times the reverse thrust); the ground damps critically (there, hardly); the product of inertia turns a banking nose
    to its side, as Nelson's positive I_xz does (there, the sign was that of the axes upside down).

    With `use_launcher` it rests on a launcher for `launch_time`; then a catapult accelerates it along its x axis by `launch_accel`
    from rest to `launch_speed`, x = a t^2 / 2, and releases it at the end of that substep. Until then nothing else moves or turns it.
    A `rollout` is one without a launcher.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(
        joined={
            "wind": ("wind_E", "wind_N", "wind_U"),
            "drag": ("C_D0", "C_D_alpha", "C_D_delta_elevator"),
            "lift": ("C_L0", "C_L_alpha", "C_LQ", "C_L_alpha_dot", "C_L_delta_elevator"),
            "side_force": ("C_Y_beta", "C_Y_delta_rudder"),
            "roll_moment": ("C_L_beta", "C_LP", "C_LR", "C_L_delta_aileron", "C_L_delta_rudder"),
            "pitch_moment": ("C_M0", "C_M_alpha", "C_MQ", "C_M_alpha_dot", "C_M_delta_elevator"),
            "yaw_moment": ("C_N_beta", "C_NP", "C_NR", "C_N_delta_aileron", "C_N_delta_rudder"),
        },
        unread=("draw_vel", "draw_ang_vel"),
    )

    gravity_magnitude = Param(9.81, unit="m/s^2", ge=0.0, doc="Acceleration of gravity.")
    air_density = Param(1.225, unit="kg/m^3", ge=0.0, doc="Density of the air.")
    wind = Param((0.0, 0.0, 0.0), fields="east north up", unit="m/s", doc="Velocity of the air, world frame.")
    mass = PositiveParam(7973.2467, unit="kg", doc="Mass.")
    inertia_matrix_slug_ft_sq = InertiaParam(
        SKYHAWK, text_unit="slug*ft^2", doc="Inertia tensor; numbers in Python are SI."
    )
    throttle_input_min = Param(0.0, doc="Throttle of thrust_min.")
    throttle_input_max = Param(1.0, doc="Throttle of thrust_max.")
    thrust_min = Param(-36000.0, unit="N", doc="Smallest thrust.")
    thrust_max = Param(36000.0, unit="N", doc="Largest thrust.")
    delta_elevator_min = Param(-0.5236, unit="rad", doc="Limit of the elevator.")
    delta_elevator_max = Param(0.5236, unit="rad", doc="Limit of the elevator.")
    delta_aileron_min = Param(-0.5236, unit="rad", doc="Limit of the aileron.")
    delta_aileron_max = Param(0.5236, unit="rad", doc="Limit of the aileron.")
    delta_rudder_min = Param(-0.2618, unit="rad", doc="Limit of the rudder.")
    delta_rudder_max = Param(0.2618, unit="rad", doc="Limit of the rudder.")
    wing_span = PositiveParam(8.382, unit="m", doc="Span.")
    surface_area_of_wing = PositiveParam(24.1548, unit="m^2", doc="Area of the wing.")
    chord_length = PositiveParam(3.29184, unit="m", doc="Mean chord.")
    efficiency_factor = PositiveParam(0.995, doc="Oswald's efficiency factor.")
    drag = Param((0.03, 0.3, 0.01), fields="zero alpha delta_elevator", ge=0.0, doc="Coefficients of drag.")
    lift = Param(
        (0.28, 3.45, 0.0, 0.72, 0.36),
        fields="zero alpha q alpha_dot delta_elevator",
        doc="Coefficients of lift.",
    )
    side_force = Param((-0.98, 0.17), fields="beta delta_rudder", doc="Coefficients of side force.")
    roll_moment = Param((-0.12, -0.26, 0.14, 0.08, -0.105), fields=MOMENT, doc="Coefficients of roll moment.")
    pitch_moment = Param(
        (0.0, -0.38, -3.6, -1.1, -0.5),
        fields="zero alpha q alpha_dot delta_elevator",
        doc="Coefficients of pitch moment.",
    )
    yaw_moment = Param((0.25, 0.022, -0.35, 0.06, 0.032), fields=MOMENT, doc="Coefficients of yaw moment.")
    use_ground_model = Param(
        True, structural=True, doc="A spring and damper hold the aircraft above height 0."
    )
    use_launcher = Param(False, doc="It starts from a launcher.")
    launch_accel = Param(200.0, unit="m/s^2", gt=0.0, doc="Acceleration by the launcher.")
    launch_speed = Param(20.0, unit="m/s", ge=0.0, doc="Speed at which the launcher releases it.")
    launch_time = Param(30.0, unit="s", ge=0.0, doc="Time from its birth to the launch.")
    born = State(unit="s", doc="Time of its birth, with use_launcher.")
    on_rail = State(unit="m", doc="Distance travelled on the launcher.")
    throttle = Input(doc="Throttle.")
    elevator = Input(doc="Elevator [rad], nose down positive.")
    aileron = Input(doc="Aileron [rad], right wing down positive.")
    rudder = Input(doc="Rudder [rad].")

    def check_values(self) -> None:
        """Check the ranges of throttle, thrust and surfaces."""
        self.check_range("throttle_input_min", "throttle_input_max")
        for name in ("thrust", "delta_elevator", "delta_aileron", "delta_rudder"):
            self.check_order(f"{name}_min", f"{name}_max")

    @staticmethod
    def derivative(
        rigid_body: Any,
        throttle: float,
        elevator: float,
        aileron: float,
        rudder: float,
        force: Any,
        torque: Any,
        gravity_magnitude: float,
        air_density: float,
        wind: Any,
        mass: float,
        inertia_matrix_slug_ft_sq: Any,
        throttle_input_min: float,
        throttle_input_max: float,
        thrust_min: float,
        thrust_max: float,
        delta_elevator_min: float,
        delta_elevator_max: float,
        delta_aileron_min: float,
        delta_aileron_max: float,
        delta_rudder_min: float,
        delta_rudder_max: float,
        wing_span: float,
        surface_area_of_wing: float,
        chord_length: float,
        efficiency_factor: float,
        drag: Any,
        lift: Any,
        side_force: Any,
        roll_moment: Any,
        pitch_moment: Any,
        yaw_moment: Any,
        use_ground_model: bool,
    ) -> Any:
        """State equation; in axes forward, right, down, the second and third components have the other sign."""
        surfaces = (
            kernels.clamp(elevator, delta_elevator_min, delta_elevator_max),
            kernels.clamp(aileron, delta_aileron_min, delta_aileron_max),
            kernels.clamp(rudder, delta_rudder_min, delta_rudder_max),
        )
        opened = kernels.clamp(throttle, throttle_input_min, throttle_input_max) - throttle_input_min
        thrust = thrust_min + opened * (thrust_max - thrust_min) / (throttle_input_max - throttle_input_min)
        wing = air_density, wing_span, surface_area_of_wing, chord_length, efficiency_factor
        vx, vy, vz = rigid_body[3], rigid_body[4], rigid_body[5]
        forward, left, up = to_body(rigid_body, (vx - wind[0], vy - wind[1], vz - wind[2]))
        air, omega = (forward, -left, -up), (rigid_body[10], -rigid_body[11], -rigid_body[12])
        flow = kernels.flow_of(air)
        fx, fy, fz = force
        ground = kernels.ground_push(rigid_body[2], vz, mass) if use_ground_model else 0.0
        others = to_body(rigid_body, (fx, fy, fz + ground - mass * gravity_magnitude))
        x, y, z = kernels.air_force(air, flow, omega, surfaces, 0.0, wing, drag, lift, side_force)
        total = x + thrust + others[0], y - others[1], z - others[2]
        rate = kernels.alpha_rate_of(air, omega, total, mass, wing, lift)
        x, y, z = kernels.air_force(air, flow, omega, surfaces, rate, wing, drag, lift, side_force)
        roll, pitch, yaw = kernels.air_moment(
            flow, omega, surfaces, rate, wing, roll_moment, pitch_moment, yaw_moment
        )
        tx, ty, tz = to_body(rigid_body, torque)
        px, py, pz = to_world(rigid_body, (x + thrust, -y, -z))
        loads = px + fx, py + fy, pz + fz + ground
        moments = tx + roll, ty - pitch, tz - yaw
        return newton_euler(rigid_body, loads, moments, mass, inertia_matrix_slug_ft_sq, gravity_magnitude)

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Put newborn aircraft on their launchers."""
        self.born[rows] = g.t[rows]

    def to_body(self, body: MotionBody) -> None:
        """Write the states. Aircraft on their launchers have the state of the launcher."""
        if self.use_launcher.any():
            self._launch(body)
        super().to_body(body)

    def _launch(self, body: MotionBody) -> None:
        """Move aircraft on their launchers, from their positions before this substep; `body.t` is the time of its start."""
        pushed = body.t - self.born - self.launch_time
        rows = np.flatnonzero((self.use_launcher != 0) & (pushed * self.launch_accel < self.launch_speed))
        since, push = np.maximum(pushed[rows], 0.0), self.launch_accel[rows]
        way = 0.5 * push * since * since
        forward, state = body.column("forward", rows), self.rigid_body
        state[:3, rows] = body.pos[:, rows] + (way - self.on_rail[rows]) * forward
        state[3:6, rows] = push * since * forward
        state[6:10, rows], state[10:, rows] = body.quat[:, rows], 0.0
        self.on_rail[rows] = way


class FixedWing6DOFRascal(FixedWing6DOF):
    """FixedWing6DOF with the parameters of the SIG Rascal 110, a model aircraft of 5.9 kg; in missions FixedWing6DOF-Rascal.

    Parameters of the JSBSim model that ArduPilot's simulation uses. The surfaces take [-1, 1].
    """

    mass = PositiveParam(5.91, unit="kg", doc="Mass.")
    inertia_matrix_slug_ft_sq = InertiaParam(
        RASCAL, text_unit="slug*ft^2", doc="Inertia tensor; numbers in Python are SI."
    )
    thrust_min = Param(0.0, unit="N", doc="Smallest thrust.")
    thrust_max = Param(25.0, unit="N", doc="Largest thrust.")
    delta_elevator_min = Param(-1.0, unit="rad", doc="Limit of the elevator.")
    delta_elevator_max = Param(1.0, unit="rad", doc="Limit of the elevator.")
    delta_aileron_min = Param(-1.0, unit="rad", doc="Limit of the aileron.")
    delta_aileron_max = Param(1.0, unit="rad", doc="Limit of the aileron.")
    delta_rudder_min = Param(-1.0, unit="rad", doc="Limit of the rudder.")
    delta_rudder_max = Param(1.0, unit="rad", doc="Limit of the rudder.")
    wing_span = PositiveParam(2.7, unit="m", doc="Span.")
    surface_area_of_wing = PositiveParam(0.982, unit="m^2", doc="Area of the wing.")
    chord_length = PositiveParam(0.351, unit="m", doc="Mean chord.")
    drag = Param((0.028, 0.0, 0.03), fields="zero alpha delta_elevator", ge=0.0, doc="Coefficients of drag.")
    lift = Param(
        (0.25, 5.0, 0.0, 0.0, 0.2),
        fields="zero alpha q alpha_dot delta_elevator",
        doc="Coefficients of lift.",
    )
    side_force = Param((-1.0, 0.0), fields="beta delta_rudder", doc="Coefficients of side force.")
    roll_moment = Param((-0.1, -0.4, 0.15, 0.13, 0.01), fields=MOMENT, doc="Coefficients of roll moment.")
    pitch_moment = Param(
        (0.0, -0.5, -12.0, -7.0, -0.5),
        fields="zero alpha q alpha_dot delta_elevator",
        doc="Coefficients of pitch moment.",
    )
    yaw_moment = Param((0.12, 0.0, -0.15, -0.03, -0.05), fields=MOMENT, doc="Coefficients of yaw moment.")
