"""Channels of vehicles and their units, for plugins whose parameters name channels."""

CHANNEL_UNITS = {
    "desired_speed": "m/s", "desired_altitude": "m", "desired_heading": "rad", "desired_roll": "rad", "speed": "m/s",
    "velocity_x": "m/s", "velocity_y": "m/s", "velocity_z": "m/s", "turn_rate": "rad/s", "pitch_rate": "rad/s", "roll_rate": "rad/s",
    "acceleration_x": "m/s^2", "acceleration_y": "m/s^2", "acceleration_z": "m/s^2", "throttle": "", "thrust": "", "elevator": "",
    "aileron": "", "rudder": "", **{f"motor_{i}": "rad/s" for i in range(8)}, "desired_pitch": "rad", "steering": "rad",
    "x_thrust": "m/s^2", "y_thrust": "m/s^2", "z_thrust": "m/s^2", "turn_force": "rad/s^2",
}  # fmt: skip
"""Numbers that motion models and controllers that ship read, and their units."""

_AXES = "xyz"
MEASURED_CHANNELS = {
    **{f"belief_pos_{i}": "m" for i in _AXES}, **{f"belief_vel_{i}": "m/s" for i in _AXES}, **{f"belief_quat_{i}": "" for i in "wxyz"},
    **{f"measured_pos_{i}": "m" for i in _AXES}, **{f"body_velocity_{i}": "m/s" for i in _AXES},
    **{f"body_rate_{i}": "rad/s" for i in _AXES}, **{f"body_acceleration_{i}": "m/s^2" for i in _AXES},
    **{f"body_rate_change_{i}": "rad/s^2" for i in _AXES}, "true_altitude_above_terrain": "m", "altitude_above_terrain": "m",
    "gps_latitude": "rad", "gps_longitude": "rad", "gps_altitude": "m", "gps_fix": "", "gps_time": "s", "los_range": "m", "los_sd": "m",
    "is_in_range": "", "ins_cep": "m", "n_seen": "", "n_contacts": "",
}  # fmt: skip
"""All numbers that sensors that ship write."""

MEASURED_LISTS = {
    "contacts": ("id team x y z vx vy vz qw qx qy qz", "1 1 m m m m/s m/s m/s 1 1 1 1"),
    "seen": ("id team bearing elevation range", "1 1 rad rad m"), "blobs": ("id u v width height", ""),
    "depth_image": ("", "m"), "segmentation_image": ("kind id team solid", ""), "observation": ("value", ""),
}  # fmt: skip
"""Fields of all lists that sensors that ship write anew in each call, and their units."""
