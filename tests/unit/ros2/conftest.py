"""A domain of ROS 2 that no other process of this machine uses, and the node in C++ on Fast DDS."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

HEADER = Path("/usr/include/fastdds/dds/domain/DomainParticipant.hpp")
LIBRARIES = "fastrtps", "fastcdr"


@pytest.fixture(scope="session")
def driver(tmp_path_factory):
    """The node in C++, compiled; where Fast DDS is not installed, the test is skipped."""
    compiler = shutil.which("g++")
    if compiler is None or not HEADER.exists():
        assert "CI" not in os.environ, "g++, libfastrtps-dev and libfastcdr-dev are installed by .ci/run"
        pytest.skip("g++, libfastrtps-dev or libfastcdr-dev is not installed")
    program = tmp_path_factory.mktemp("fastdds") / "driver"
    source = Path(__file__).with_name("driver.cpp")
    libraries = [f"-l{name}" for name in LIBRARIES]
    subprocess.run([compiler, "-O0", str(source), "-o", str(program), *libraries], check=True)
    return program
