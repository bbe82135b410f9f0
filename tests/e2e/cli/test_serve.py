"""`tussle serve`, as a user starts and ends it."""

import re
import signal
import subprocess
import sys
from pathlib import Path

from cli_process import COMMAND, environment

CLIENT = Path(__file__).parents[3] / "examples" / "serve" / "client.py"


def test_a_client_plays_and_ctrl_c_ends_the_server():
    command = [*COMMAND, "serve", "predator_prey", "--seed", "3", "--worlds", "2", "--set", "prey.count=7"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment()
    ) as server:
        line = server.stdout.readline()
        url = re.search(r"ws://127\.0\.0\.1:\d+/\w{32}", line)[0]
        done = subprocess.run([sys.executable, CLIENT, url], capture_output=True, text=True, check=True)
        assert done.stdout.splitlines()[1] == "10 s: 7 prey"
        server.send_signal(signal.SIGINT)
        assert server.wait() == 0
        assert not server.stderr.read()
