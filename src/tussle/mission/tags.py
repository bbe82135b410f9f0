"""The tags and attributes of mission files, each with its unit, default and meaning."""

from __future__ import annotations

from typing import NamedTuple

from tussle import stock


class Known(NamedTuple):
    """A tag or attribute.

    Attributes:
        doc: Its meaning.
        default: Text of the value if it is missing.
        unit: Unit of a bare number; "" for none.
        kept_for: "viewer" or "log" if the game does not depend on it.
        reads: How its text is parsed: "text", "truth", "number", "whole", "words".
        bound: Bound of a number: "> 0" or ">= 0".
    """

    doc: str
    default: str = ""
    unit: str = ""
    kept_for: str = ""
    reads: str = "number"
    bound: str = ""


def _viewer(doc: str, default: str = "", reads: str = "text", unit: str = "") -> Known:
    return Known(doc, default, unit, "viewer", reads)


def _log(doc: str, default: str = "", reads: str = "text") -> Known:
    return Known(doc, default, "", "log", reads)


RUN = {
    "start": Known("Time of the first step.", "0", "s"),
    "end": Known("Time at which the condition `time` ends the mission.", "50", "s"),
    "dt": Known("Length of a step.", "0.00833333", "s", bound="> 0"),
    "motion_multiplier": Known("Substeps of controllers and motion per step.", "1", reads="whole"),
    "update": Known(
        "`synchronous`: all entities decide on the states at the start of the step; `sequential`: the entities decide and move one "
        "after another (addition to the format).",
        "synchronous",
        reads="text",
    ),
    "time_warp": _viewer("Simulated seconds per second; 0 or less is as fast as possible.", "0", "number"),
    "enable_gui": _viewer("Open the viewer.", "true", "truth"),
    "network_gui": _viewer("Serve a remote viewer.", "false", "truth"),
    "start_paused": _viewer("Wait for a key before the first step.", "false", "truth"),
    "full_screen": _viewer("Use the whole screen.", "false", "truth"),
    "window_width": _viewer("Width of the window [pixels].", "800", "number"),
    "window_height": _viewer("Height of the window [pixels].", "600", "number"),
}
"""Attributes of <run>."""

WORLD = {
    "run": Known("Times and steps; its attributes are below.", reads="text"),
    "end_condition": Known(
        "Any of `time`, `one_team`, `all_dead`, `none`, separated by commas.", "time", reads="words"
    ),
    "seed": Known("Seed of all random numbers, an integer.", "none", reads="text"),
    "latitude_origin": Known("Latitude of the world frame's origin.", "29", "deg"),
    "longitude_origin": Known("Its longitude, east positive.", "-95", "deg"),
    "altitude_origin": Known("Its height above the ellipsoid.", "0", "m"),
    "network": Known(
        "A network, by its plugin's name; attributes are parameters. `GlobalNetwork` is always there.",
        reads="text",
    ),
    "entity_interaction": Known("An interaction plugin; they run in the order of the file.", reads="text"),
    "metrics": Known("A metric plugin.", reads="text"),
    "param_common": Known(
        "Parameters that plugin tags take with `param_common='NAME'`: one child tag each.", reads="text"
    ),
    "entity_common": Known(
        "Tags that entities take with `entity_common='NAME'`; the entity's own tags take precedence.",
        reads="text",
    ),
    "entity": Known("A block of entities with the same plugins; its tags are below.", reads="text"),
    "multi_threaded": _log("Threads; results do not depend on them."),
    "output_type": _log("Kinds of output of the existing system; a run directory has all of them."),
    "no_bin_logging": _log("Whether to leave out the trajectory.", "false", "truth"),
    "log_dir": _log(
        "Folder of the run directories; files are written only below the command line's `--out`."
    ),
    "create_latest_dir": _log("Link to the latest run.", "true", "truth"),
    "output_dir_trailer": _log("Suffix of the run directory's name."),
    "display_progress": _log("Show a progress bar.", "true", "truth"),
    "show_plugins": _log("List the plugins.", "false", "truth"),
    "grid_spacing": _viewer("Spacing of the ground grid [m].", "100", "number"),
    "grid_size": _viewer("Size of the ground grid [m].", "10000", "number"),
    "background_color": _viewer("Red, green, blue, 0 to 255."),
    "show_origin": _viewer("Draw the axes.", "false", "truth"),
    "origin_length": _viewer("Length of the axes [m].", "1", "number"),
    "scale": _viewer("Scale of all models.", "1", "number"),
    "gui_update_period": _viewer("Time between frames [ms]."),
    "plot_tracks": _viewer("Draw the paths.", "false", "truth"),
    "camera": _viewer("Attributes `mode`, `follow_id`, `pos`, `focal_point`, `show_fps`."),
    "enable_screenshots": _viewer("Attributes `min_period`, `start`, `end`.", "false", "truth"),
    "stream_ip": _viewer("Address of a remote viewer.", "localhost"),
    "stream_port": _viewer("Port of a remote viewer.", "50051"),
    "terrain": _viewer("Heights of the ground: an .asc grid beside the mission file."),
}
"""Tags of <runscript>."""

ENTITY = {
    "name": Known("Name of the block, for paths such as `prey.Boids.gain`.", "team_ID", reads="text"),
    "team_id": Known("Team.", "0", reads="whole"),
    "id": Known(
        "Id of the first entity; ignored here, ids count up in the order of the file.", "next", reads="whole"
    ),
    "count": Known("Total number of entities.", "1", reads="whole"),
    "health": Known("Initial health; an entity is removed at 0.", "1", bound="> 0"),
    "radius": Known("Body radius.", "1", "m", bound="> 0"),
    "mass": Known("Mass (addition to the format).", "1", "kg", bound="> 0"),
    "x": Known("Start position of the first entity, East.", "0", "m"),
    "y": Known("North.", "0", "m"),
    "z": Known("Up.", "0", "m"),
    "latitude": Known("Start position instead of x, y, z, if all three are given.", "", "deg"),
    "longitude": Known("East positive.", "", "deg"),
    "altitude": Known("Above the ellipsoid.", "", "m"),
    "heading": Known("Counter-clockwise from East.", "0", "deg"),
    "roll": Known("Right wing down positive.", "0", "deg"),
    "pitch": Known("Nose **down** positive, as always in this format.", "0", "deg"),
    "vx": Known("Initial velocity, East.", "0", "m/s"),
    "vy": Known("North.", "0", "m/s"),
    "vz": Known("Up.", "0", "m/s"),
    "speed": Known("Initial speed along the heading, if vx, vy, vz are 0.", "0", "m/s", bound=">= 0"),
    "placement": Known("`normal` or `uniform` (addition to the format).", "normal", reads="text"),
    "variance_x": Known(
        "Variance (not standard deviation) of the start position of all but the first.",
        "100",
        "m^2",
        bound=">= 0",
    ),
    "variance_y": Known("The same, North.", "100", "m^2", bound=">= 0"),
    "variance_z": Known("The same, up.", "0", "m^2", bound=">= 0"),
    "half_width_x": Known(
        "With uniform placement: largest distance of all but the first from it (addition).",
        "0",
        "m",
        bound=">= 0",
    ),
    "half_width_y": Known("The same, North.", "0", "m", bound=">= 0"),
    "half_width_z": Known("The same, up.", "0", "m", bound=">= 0"),
    "variance_heading": Known("Variance of the heading.", "0", "deg^2", bound=">= 0"),
    "use_variance_all_ents": Known("Place the first entity at random too.", "false", reads="truth"),
    "generate_rate": Known(
        "Births per second in each slot, `a / b` or a number; needs generate_count > 0.", "none", "1/s"
    ),
    "generate_count": Known(
        "Slots: birth sequences that run in parallel (the total is `count`).", "none", reads="whole"
    ),
    "generate_start_time": Known("Time of the first birth.", "0", "s"),
    "generate_time_variance": Known("Standard deviation of the time between births.", "0", "s", bound=">= 0"),
    "autonomy": Known("An autonomy; several run in the order of the file.", "none", reads="text"),
    "controller": Known("A controller; several are chained in the order of the file.", "none", reads="text"),
    "motion_model": Known("The motion model.", stock.UNMOVED, reads="text"),
    "sensor": Known("A sensor; several are allowed.", "none", reads="text"),
    "base": Known("A base of the team; its tags are below.", "none", reads="text"),
    "connect_entity": Known("0 turned off the wiring check; here it is always on.", "1", reads="text"),
    "color": _viewer("Red, green, blue, 0 to 255."),
    "visual_model": _viewer("Name of the model that is drawn."),
    "visual_scale": _viewer("Scale of that model."),
    "visual_rpy": _viewer("Attitude of that model."),
    "script_name": Known(
        "Flight script of JSBSim models, which are not in tussle yet.", "none", reads="text"
    ),
}
"""Tags of <entity> and <entity_common>."""

ENTITY_ATTRIBUTES = {
    "tag": Known("Name by which plugins spawn further entities of this block.", reads="text"),
    "entity_common": Known("Name of the <entity_common> whose tags it takes.", reads="text"),
}

BASE = {
    "x": Known("Centre, East.", "-1", "m"),
    "y": Known("North.", "-1", "m"),
    "z": Known("Up.", "-1", "m"),
    "latitude": Known("Centre instead of x, y, z, if all three are given.", "", "deg"),
    "longitude": Known("East positive.", "", "deg"),
    "altitude": Known("Above the ellipsoid.", "", "m"),
    "radius": Known("Radius.", "25", "m", bound="> 0"),
    "opacity": Known("Opacity in the viewer, 0 to 1.", "1"),
}
"""Tags of <base>."""

PLUGIN = {
    "name": Known(
        "Instance name, for several of the same plugin in one entity or in the world.",
        "the plugin's",
        reads="text",
    ),
    "loop_rate": Known(
        "Calls per second of an autonomy, controller or sensor, at most one per step (controller: per substep); 0 is one per step.",
        "0",
        "1/s",
    ),
    "param_common": Known(
        "Name of a <param_common>; the tag's own attributes take precedence.", "none", reads="text"
    ),
}
"""Attributes that every plugin's tag takes besides the plugin's parameters."""

SEED_ATTRIBUTES = ("reseed_time", "reseed")
MANY = ("autonomy", "controller", "sensor", "base")
"""Tags of an entity that may occur several times."""
