"""Missions as data, and the reading of mission files."""

from tussle.mission.catalogue import Catalogue
from tussle.mission.given import GivenMission, mission_of
from tussle.mission.limits import Limits
from tussle.mission.plugin_files import PluginFile, load_plugin_file
from tussle.mission.source import shipped_missions
from tussle.mission.spec import Block, Mission
from tussle.mission.write import to_python, to_xml
from tussle.mission.xml import Loaded, read_mission

__all__ = [
    "Block",
    "Catalogue",
    "GivenMission",
    "Limits",
    "Loaded",
    "Mission",
    "PluginFile",
    "load_plugin_file",
    "mission_of",
    "read_mission",
    "shipped_missions",
    "to_python",
    "to_xml",
]
