"""Random missions: each world of a stack with a past is what it is alone, and nothing but a TussleError comes out.

TUSSLE_FUZZ=20000 plays as many missions by hand.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from histories import difference, played_alone

from tussle.errors import TussleError

N_MISSIONS = int(os.environ.get("TUSSLE_FUZZ", "200"))
N_FAST = 40  # of these, in the tests that are not slow
N_CHECKED = 16
N_SMALL = int(os.environ.get("TUSSLE_FUZZ", "40"))
CHUNK = 10
pytestmark = [
    pytest.mark.filterwarnings("ignore:.*its messages are not received"),  # random networks often are two
    pytest.mark.filterwarnings("ignore:.*no block has this team"),  # random plugins name random teams
    # NumPy warns once for all rows: made an error, it would end worlds that do not overflow.
    pytest.mark.filterwarnings("ignore:.* encountered in:RuntimeWarning"),
]


@pytest.mark.parametrize(
    "first",
    [pytest.param(k, marks=pytest.mark.slow if k >= N_FAST else ()) for k in range(0, N_MISSIONS, CHUNK)],
)
def test_worlds_of_random_missions_are_as_alone(first):
    found = [difference(number) for number in range(first, min(first + CHUNK, N_MISSIONS))]
    assert [text for text in found if text] == []
    least = 6 if first == 0 else len(found) // 3
    assert found.count("") >= least  # the others' parts do not fit together


@pytest.mark.slow
def test_caches_with_room_for_one_thing_change_no_random_mission():
    """Alone, in stacks, in threads, reset and restored; each world is also what it is with the caches as shipped."""
    program = Path(__file__).with_name("small_caches.py")
    done = subprocess.run(
        [sys.executable, str(program), "0", str(N_SMALL)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    played = json.loads(done.stdout.splitlines()[-1])
    assert {"tussle.api.bodies.KEPT_INDEXES", "tussle.api.bodies.KEPT_RANGES", "tussle.api.laws"} <= {
        *played["shrunk"]
    }
    assert played["wrong"] == []
    assert len(played["hashes"]) >= N_SMALL // 3
    differ = [n for n, hashes in played["hashes"].items() if tuple(hashes) != shipped_hashes(int(n))]
    assert differ == []


def shipped_hashes(number: int) -> tuple[str, ...]:
    """Hashes of a random mission with the caches as shipped."""
    try:
        return played_alone(number, 1).hashes
    except TussleError:
        return ()


@pytest.mark.slow
def test_no_kernel_leaves_its_arrays():
    """The same with bounds checks compiled in, in a process of its own: Numba reads the setting when it is imported."""
    program = (
        "import sys, histories\n"
        "found = [text for text in map(histories.difference, range(int(sys.argv[1]))) if text]\n"
        "sys.exit('\\n'.join(found) or 0)\n"
    )
    path = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    env = dict(os.environ, NUMBA_BOUNDSCHECK="1", PYTHONPATH=path)
    command = [sys.executable, "-c", program, str(N_CHECKED)]
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
