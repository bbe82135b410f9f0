"""Channels of vehicles and their units, for plugins whose parameters name channels."""

CHANNEL_UNITS = {
    "desired_speed": "m/s", "desired_altitude": "m", "desired_heading": "rad", "desired_roll": "rad", "speed": "m/s",
    "velocity_x": "m/s", "velocity_y": "m/s", "velocity_z": "m/s", "turn_rate": "rad/s", "pitch_rate": "rad/s", "roll_rate": "rad/s",
    "acceleration_x": "m/s^2", "acceleration_y": "m/s^2", "acceleration_z": "m/s^2", "throttle": "", "thrust": "", "elevator": "",
    "aileron": "", "rudder": "",
}  # fmt: skip
"""Name of a channel -> its unit."""

DRIVEN_CHANNELS = CHANNEL_UNITS | {f"motor_{i}": "rad/s" for i in range(8)}
"""The same with the motors of a multirotor, for plugins that drive actuators."""
