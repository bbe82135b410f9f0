"""Plays and records a game until it is killed: python recording_child.py DIRECTORY [LARGEST FILE IN BYTES]."""

import resource
import signal
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "unit" / "record"))

from recorded_games import hunt

from tussle import Recorder, Simulation
from tussle.errors import RecordError

if len(sys.argv) > 2:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # writing then fails, as on a full disk
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), int(sys.argv[2])))
sim = Simulation(hunt(end=1e6, end_conditions="time"), seeds=range(8))
try:
    flush_every = 0.1 if len(sys.argv) == 2 else 1e-3
    with Recorder(sim, sys.argv[1], flush_every=flush_every, columns="*.target"):
        print("begun", flush=True)
        while True:
            sim.step(20)
            print(time.monotonic(), int(sim.steps[0]), flush=True)
except RecordError as error:
    print(error)
    sys.exit(3)
