"""A domain of ROS 2 that no other process of this machine uses, and the node in C++ on Fast DDS."""

from __future__ import annotations

import subprocess
from pathlib import Path

import needs
import pytest

LIBRARIES = "fastrtps", "fastcdr"


@pytest.fixture(scope="session")
def driver(tmp_path_factory):
    """The node in C++, compiled; where Fast DDS is not installed, the test is skipped."""
    needs.require("fastdds")
    program = tmp_path_factory.mktemp("fastdds") / "driver"
    source = Path(__file__).with_name("driver.cpp")
    libraries = [f"-l{name}" for name in LIBRARIES]
    subprocess.run(["g++", "-O0", str(source), "-o", str(program), *libraries], check=True)
    return program
