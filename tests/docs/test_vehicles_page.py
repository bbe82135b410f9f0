"""The motion models of docs/vehicles.md integrate as its table says: exactly, or with an error of the fourth order of the step."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tussle import stock

PAGE = Path(__file__).parents[2] / "docs" / "vehicles.md"
TABLE = re.search(r"## Motion models\n\n(.*?)\n\n", PAGE.read_text(), re.DOTALL)[1]
ROWS = [line.strip("| ").split(" | ") for line in TABLE.splitlines()[2:]]
MODELS = {name: path for names, _, path in ROWS for name in re.findall(r"`(\w+)`", names)}
LIMITS = {  # so wide that no command and no state is clamped; a damping at which the error does not happen to vanish
    "HarmonicOscillator": {"damping_ratio": 0.1},
    "DoubleIntegrator": {"max_vel": 1e3, "max_acc": 1e3, "max_yaw_vel": 1e3, "max_yaw_acc": 1e3},
    "Unicycle": {"vel_max": 50.0, "turn_rate_max": 5.0, "pitch_rate_max": 5.0},
    "Unicycle3D": {"speed_max": 50.0, "turn_rate_max": 5.0, "pitch_rate_max": 5.0, "roll_rate_max": 5.0},
    "SimpleQuadrotor": {"max_vel": 1e3},
    "SimpleAircraft": {"min_velocity": 0.0, "max_roll": 1.5, "max_pitch": 1.5},
}


def flown(name, substeps):
    """States after 1 s of nine flights, from other states and with other constant inputs."""
    model = getattr(stock, name)(**LIMITS.get(name, {}))
    fields = model.state().fields
    draw = np.random.default_rng(1)
    x = draw.uniform(0.1, 0.6, (len(fields), 9))
    speed = [k for k, field in enumerate(fields) if field in ("v", "speed")]
    x[speed] = 20.0
    if "qw" in fields:
        quat = slice(fields.index("qw"), fields.index("qw") + 4)
        x[quat] /= np.linalg.norm(x[quat], axis=0)
    n_inputs = len([*model.input_channels(), *model.body_inputs()])
    u = draw.uniform(0.1, 0.6, (1, n_inputs, 9))
    first = next(iter(model.input_channels()), "")
    u[:, 0] = 20.0 if first.endswith("speed") else u[:, 0]
    return model.rollout(x, u, dt=1.0, substeps=substeps)[1]


@pytest.mark.parametrize("name", MODELS)
def test_a_model_integrates_as_the_page_says(name):
    truth = flown(name, 512)
    errors = [np.abs(flown(name, n) - truth).max() for n in (1, 16, 32)]
    if "exact" in MODELS[name]:
        assert max(errors) < 1e-9
    else:
        assert "fourth order" in MODELS[name]
        assert errors[0] > 1e-7
        assert 10.0 < errors[1] / errors[2] < 24.0  # 2^4, as far as the next order is small
