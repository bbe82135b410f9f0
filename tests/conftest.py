"""For all tests: none is timed, since a machine may be slow or busy; what is kept for the user lies in a folder of the tests' own."""

from __future__ import annotations

import gc
import os
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Generator
from pathlib import Path

import needs
import pytest
from hypothesis import HealthCheck, settings

# Each worker, and each program that a test starts, has its share of the cores; threads of linear algebra wait for each other in loops.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


def pytest_xdist_auto_num_workers() -> int:
    """One more than cores, since many tests wait; each further one imports and collects everything, for 20 s of CPU time."""
    return (os.cpu_count() or 1) + 1


def pytest_configure() -> None:
    """Ctrl-C reaches the processes that tests start, even where these run in the background of a shell, which lets it be ignored."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """No garbage is looked for among the million objects of imports and of the tests themselves, now or later: they stay."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Slow tests come first, so that at the end no worker waits for one; with TUSSLE_TEST_BACKWARDS=1, the last of a module first."""
    if os.environ.get("TUSSLE_TEST_BACKWARDS"):
        items.reverse()
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test marked with what it needs is skipped without."""
    for mark in item.iter_markers("needs"):
        needs.require(*mark.args)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Tell what was skipped and how to get what it needs.

    The file that the variable TUSSLE_SKIPPED_TESTS names gets what has to be played again where more is installed, one name a line.
    """
    skipped = terminalreporter.stats.get("skipped", [])
    if skipped:
        terminalreporter.section("skipped")
        reasons = Counter(report.longrepr[2].removeprefix("Skipped: ") for report in skipped)
        for reason, n in sorted(reasons.items()):
            terminalreporter.write_line(f"{n:5}  {reason}")
    if named := os.environ.get("TUSSLE_SKIPPED_TESTS"):
        both = (r for r in terminalreporter.stats.get("passed", []) if "with_and_without" in r.keywords)
        # Where a test had nothing to be played for, it is played for all that there is then.
        names = dict.fromkeys(report.nodeid.removesuffix("[NOTSET]") for report in (*skipped, *both))
        Path(named).write_text("".join(f"{name}\n" for name in names))


@pytest.fixture(scope="session", autouse=True)
def _own_state(tmp_path_factory):
    """Tests leave nothing in the state folder of who runs them."""
    before = os.environ.get("XDG_STATE_HOME")
    os.environ["XDG_STATE_HOME"] = str(tmp_path_factory.mktemp("state"))
    yield
    if before is None:
        del os.environ["XDG_STATE_HOME"]
    else:
        os.environ["XDG_STATE_HOME"] = before


@pytest.fixture(scope="session")
def roscore(tmp_path_factory):
    """Address of a ROS master, for nodes of this process too; where ROS is not installed, the test is skipped."""
    from tussle.plugins.links.ros.node import master_fault

    needs.require("roscore", "rospy")
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    folder = str(tmp_path_factory.mktemp("ros"))
    uri = f"http://127.0.0.1:{port}"
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {"MASTER_URI": uri, "IP": "127.0.0.1", "LOG_DIR": folder, "HOME": folder}.items():
            patch.setenv(f"ROS_{name}", value)
        process = subprocess.Popen(
            ["roscore", "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        while master_fault():
            assert process.poll() is None, "roscore has ended"
            time.sleep(0.05)
        yield uri
        process.terminate()
        process.wait()


@pytest.fixture(scope="session")
def ros_domain():
    """Number of a domain of ROS 2 that no other tests on this machine use; without Cyclone DDS, the test is skipped."""
    needs.require("cyclonedds")
    for domain in range(1, 101):  # the ports of higher ones are given to clients
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as claim:
            try:
                claim.bind(("127.0.0.1", 7400 + 250 * domain + 249))  # a port that no participant uses
            except OSError:
                continue
            with pytest.MonkeyPatch.context() as patch:
                patch.setenv("ROS_DOMAIN_ID", str(domain))
                patch.delenv("CYCLONEDDS_URI", raising=False)
                yield domain
            return
    pytest.fail("all domains are in use")


@pytest.fixture(scope="session")
def built_site(tmp_path_factory) -> Path:
    """Folder of the documentation site: that of .ci/run, or one that is built here. Warnings are errors."""
    if built := os.environ.get("TUSSLE_SITE"):
        return Path(built)
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(
        command, check=False, cwd=needs.ROOT, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder
