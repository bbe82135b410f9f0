"""The tags and attributes of mission files, each with its unit, default and meaning."""

from __future__ import annotations

from typing import NamedTuple

from tussle.plugins import stock


class TagSpec(NamedTuple):
    """A tag or attribute.

    Attributes:
        doc: Its meaning.
        default: Text of the value if it is missing.
        unit: Unit of a bare number; "" for none.
        kept_for: "viewer" or "log" if the game does not depend on it.
        reads: How its text is parsed: "text", "truth", "number", "whole", "words".
        bound: Bound of a number: "> 0" or ">= 0".
        attributes: Attributes of a tag for the viewer.
    """

    doc: str
    default: str = ""
    unit: str = ""
    kept_for: str = ""
    reads: str = "number"
    bound: str = ""
    attributes: tuple[str, ...] = ()


def _viewer(doc: str, default: str = "", reads: str = "text", attributes: str = "") -> TagSpec:
    return TagSpec(doc, default, "", "viewer", reads, attributes=tuple(attributes.split()))


def _log(doc: str, default: str = "", reads: str = "text") -> TagSpec:
    return TagSpec(doc, default, "", "log", reads)


RUNSCRIPT = {
    "name": TagSpec("Title.", "", reads="text"),
    "compat": TagSpec(
        "`scrimmage` plays the mission by SCRIMMAGE's own laws where tussle's differ (addition to the format).",
        "",
        reads="text",
    ),
}
"""Attributes of <runscript>."""

RUN = {
    "start": TagSpec("Time of the first step.", "0", "s"),
    "end": TagSpec("Time at which the condition `time` ends the mission.", "50", "s"),
    "dt": TagSpec("Length of a step.", "0.00833333", "s", bound="> 0"),
    "motion_multiplier": TagSpec("Substeps of controllers and motion per step.", "1", reads="whole"),
    "update": TagSpec(
        "`synchronous`: all entities decide on the states at the start of the step; `sequential`: the entities decide and move one "
        "after another; `random`: the same in another random order in each step; `random_in_blocks`: in random order within each block "
        "(addition to the format).",
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
    "run": TagSpec("Times and steps; its attributes are below.", reads="text"),
    "end_condition": TagSpec(
        "Any of `time`, `one_team`, `all_dead`, `none`, separated by commas.", "time", reads="words"
    ),
    "seed": TagSpec("Seed of all random numbers, an integer.", "none", reads="text"),
    "latitude_origin": TagSpec("Latitude of the world frame's origin.", "29", "deg"),
    "longitude_origin": TagSpec("Its longitude, east positive.", "-95", "deg"),
    "altitude_origin": TagSpec("Its height above the ellipsoid.", "0", "m"),
    "network": TagSpec(
        "A network, by its plugin's name; attributes are parameters. `GlobalNetwork` is always there.",
        reads="text",
    ),
    "entity_interaction": TagSpec("An interaction plugin; they run in the order of the file.", reads="text"),
    "metrics": TagSpec("A metric plugin.", reads="text"),
    "param_common": TagSpec(
        "Parameters that plugin tags take with `param_common='NAME'`: one child tag each.", reads="text"
    ),
    "entity_common": TagSpec(
        "Tags that entities take with `entity_common='NAME'`; the entity's own tags take precedence.",
        reads="text",
    ),
    "entity": TagSpec("A block of entities with the same plugins; its tags are below.", reads="text"),
    "terrain": TagSpec(
        "Hills or a mesh that rays meet: a file beside the mission (.asc, .png, .tif, .vtk, .obj, .ply, .stl, .glb, .gltf, .off), or a "
        "terrain .xml of SCRIMMAGE. Attributes: `position` (x, y, z of its origin) [m]; of an image `cell`, a pixel's width [m], "
        "and `height` of white [m]; of a mesh `scale`. `texture`: an image that is draped over it, which only pictures show.",
        reads="text",
    ),
    "ground": TagSpec("Flat ground at this height, which rays meet (addition to the format).", "none", "m"),
    "wall": TagSpec(
        "A box that rays meet (addition to the format). Attributes: `center` and `lengths` [m], `rpy` [deg], three numbers each.",
        reads="text",
    ),
    "building": TagSpec(
        "A polygon extruded upwards that rays meet (addition to the format). Attributes: `corners`, such as `[0 0] [9 0] [9 5]` [m], "
        "`low` and `high`, the heights of its ends [m].",
        reads="text",
    ),
    "multi_threaded": _log("Threads; results do not depend on them."),
    "output_type": _log("Kinds of output of SCRIMMAGE; a run directory has all of them."),
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
    "map": _viewer(
        "A picture on the ground: a GeoTIFF, or a PNG or JPEG with `bounds`, west, south, east, north [deg] (addition to the format).",
        attributes="bounds",
    ),
    "background_color": _viewer("Red, green, blue, 0 to 255."),
    "show_origin": _viewer("Draw the axes.", "false", "truth"),
    "origin_length": _viewer("Length of the axes [m].", "1", "number"),
    "scale": _viewer("Scale of all models.", "1", "number"),
    "gui_update_period": _viewer("Time between frames [ms]."),
    "plot_tracks": _viewer("Draw the paths.", "false", "truth"),
    "camera": _viewer(
        "Attributes `mode`, `follow_id`, `pos`, `focal_point`, `show_fps`.",
        attributes="mode follow_id pos focal_point show_fps",
    ),
    "enable_screenshots": _viewer(
        "Attributes `min_period`, `start`, `end`.", "false", "truth", "min_period start end"
    ),
    "stream_ip": _viewer("Address of a remote viewer.", "localhost"),
    "stream_port": _viewer("Port of a remote viewer.", "50051"),
}
"""Tags of <runscript>."""

ENTITY = {
    "name": TagSpec("Name of the block, for paths such as `prey.Boids.gain`.", "team_ID", reads="text"),
    "team_id": TagSpec("Team.", "0", reads="whole"),
    "id": TagSpec(
        "Id of the first entity; ignored here, ids count up in the order of the file.", "next", reads="whole"
    ),
    "count": TagSpec("Total number of entities.", "1", reads="whole"),
    "health": TagSpec("Initial health; an entity is removed at 0.", "1", bound="> 0"),
    "radius": TagSpec("Body radius.", "1", "m", bound="> 0"),
    "mass": TagSpec(
        "Mass, for motion models without a parameter `mass` (addition to the format).", "1", "kg", bound="> 0"
    ),
    "box_x": TagSpec(
        "Length of the box that rays meet instead of the sphere of `radius` (addition).",
        "0",
        "m",
        bound=">= 0",
    ),
    "box_y": TagSpec("Its width.", "0", "m", bound=">= 0"),
    "box_z": TagSpec("Its height.", "0", "m", bound=">= 0"),
    "box_mesh": TagSpec(
        "Instead of the three: a mesh file beside the mission, whose bounds are the box; the entity is at their middle (addition).",
        reads="text",
    ),
    "x": TagSpec("Start position of the first entity, East.", "0", "m"),
    "y": TagSpec("North.", "0", "m"),
    "z": TagSpec("Up.", "0", "m"),
    "latitude": TagSpec("Start position instead of x, y, z, if all three are given.", "", "deg"),
    "longitude": TagSpec("East positive.", "", "deg"),
    "altitude": TagSpec("Above the ellipsoid.", "", "m"),
    "heading": TagSpec("Counter-clockwise from East.", "0", "deg"),
    "roll": TagSpec("Right wing down positive.", "0", "deg"),
    "pitch": TagSpec("Nose **down** positive, as always in this format.", "0", "deg"),
    "vx": TagSpec("Initial velocity, East.", "0", "m/s"),
    "vy": TagSpec("North.", "0", "m/s"),
    "vz": TagSpec("Up.", "0", "m/s"),
    "speed": TagSpec("Initial speed along the heading, if vx, vy, vz are 0.", "0", "m/s", bound=">= 0"),
    "placement": TagSpec("`normal` or `uniform` (addition to the format).", "normal", reads="text"),
    "variance_x": TagSpec(
        "Variance (not standard deviation) of the start position of all but the first.",
        "100",
        "m^2",
        bound=">= 0",
    ),
    "variance_y": TagSpec("The same, North.", "100", "m^2", bound=">= 0"),
    "variance_z": TagSpec("The same, up.", "0", "m^2", bound=">= 0"),
    "half_width_x": TagSpec(
        "With uniform placement: largest distance of all but the first from it (addition).",
        "0",
        "m",
        bound=">= 0",
    ),
    "half_width_y": TagSpec("The same, North.", "0", "m", bound=">= 0"),
    "half_width_z": TagSpec("The same, up.", "0", "m", bound=">= 0"),
    "variance_heading": TagSpec("Variance of the heading.", "0", "deg^2", bound=">= 0"),
    "use_variance_all_ents": TagSpec("Place the first entity at random too.", "false", reads="truth"),
    "generate_rate": TagSpec(
        "Births per second in each slot, `a / b` or a number; needs generate_count > 0.", "none", "1/s"
    ),
    "generate_count": TagSpec(
        "Slots: birth sequences that run in parallel (the total is `count`).", "none", reads="whole"
    ),
    "generate_start_time": TagSpec("Time of the first birth.", "0", "s"),
    "generate_time_variance": TagSpec(
        "Standard deviation of the time between births.", "0", "s", bound=">= 0"
    ),
    "generate_without_space": TagSpec(
        "A birth that finds no free position may `wait`, and try again in each step, or `fail` and end the game (addition).",
        "wait",
        reads="text",
    ),
    "autonomy": TagSpec("An autonomy; several run in the order of the file.", "none", reads="text"),
    "controller": TagSpec(
        "A controller; several are chained in the order of the file.", "none", reads="text"
    ),
    "motion_model": TagSpec("The motion model.", stock.UNMOVED, reads="text"),
    "sensor": TagSpec("A sensor; several are allowed.", "none", reads="text"),
    "base": TagSpec("A base of the team; its tags are below.", "none", reads="text"),
    "connect_entity": TagSpec("0 turned off the wiring check; here it is always on.", "1", reads="text"),
    "color": _viewer("Red, green, blue, 0 to 255."),
    "visual_model": _viewer("Name of the model that is drawn."),
    "visual_scale": _viewer("Scale of that model."),
    "visual_rpy": _viewer("Attitude of that model."),
    "script_name": TagSpec("Flight script of a JSBSimModel or JSBSimControl.", "none", reads="text"),
}
"""Tags of <entity> and <entity_common>."""

ENTITY_ATTRIBUTES = {
    "tag": TagSpec("Name by which plugins spawn further entities of this block.", reads="text"),
    "entity_common": TagSpec("Name of the <entity_common> whose tags it takes.", reads="text"),
}

BASE = {
    "x": TagSpec("Centre, East.", "-1", "m"),
    "y": TagSpec("North.", "-1", "m"),
    "z": TagSpec("Up.", "-1", "m"),
    "latitude": TagSpec("Centre instead of x, y, z, if all three are given.", "", "deg"),
    "longitude": TagSpec("East positive.", "", "deg"),
    "altitude": TagSpec("Above the ellipsoid.", "", "m"),
    "radius": TagSpec("Radius.", "25", "m", bound="> 0"),
    "opacity": TagSpec("Opacity in the viewer, 0 to 1.", "1"),
}
"""Tags of <base>."""

PLUGIN = {
    "name": TagSpec(
        "Instance name, for several of the same plugin in one entity or in the world.",
        "the plugin's",
        reads="text",
    ),
    "loop_rate": TagSpec(
        "Calls per second of an autonomy, controller or sensor, at most one per step (controller: per substep); 0 is one per step.",
        "0",
        "1/s",
    ),
    "states": TagSpec(
        "Of a plugin inside another one: states of the entity in which it acts, separated by commas or blanks.",
        "all",
        reads="text",
    ),
    "param_common": TagSpec(
        "Name of a <param_common>; the tag's own attributes take precedence.", "none", reads="text"
    ),
}
"""Attributes that every plugin's tag takes besides the plugin's parameters."""

SEED_ATTRIBUTES = ("reseed_time", "reseed", "rekeys")
MANY = ("autonomy", "controller", "sensor", "base")
"""Tags of an entity that may occur several times."""
WORLD_MANY = ("entity", "network", "entity_interaction", "metrics", "terrain", "wall", "building")
"""Tags of <runscript> that may occur several times; so may <param_common> and <entity_common>, with different names."""
