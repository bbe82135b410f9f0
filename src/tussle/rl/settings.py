"""Settings of training, from the command line and from TOML files."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tussle.documents import read_text
from tussle.errors import ParameterError, listed, nearest_name

CRITICS = ("own", "central")
MAX_TEXT = 2**20
"""Largest file of settings, in bytes."""


@dataclass(frozen=True)
class Settings:
    """Settings of PPO.

    Attributes:
        worlds: Number of worlds.
        decisions: Decisions of each agent between two updates.
        epochs: Passes over these in an update.
        minibatch: Decisions per gradient step.
        hidden: Width of both hidden layers.
        memory: Numbers that an agent keeps from one decision to the next, in a recurrent unit in place of the second hidden layer; 0
            for none.
        learning_rate: Of Adam at the beginning; it falls linearly with time to a tenth.
        discount: Weight of a reward one decision later.
        trace: Weight of an advantage estimate that looks one decision further, lambda.
        clip: Largest change of a decision's probability that pays, as a share.
        entropy: Weight of the policy's entropy.
        critic: "own": the critic sees what its agent observes; "central": the state of the world (`Task.state`) as well.
        evaluate_every: Updates between two evaluations, with the most likely actions; 0 for none.
        evaluate_episodes: Episodes of an evaluation.

    Raises:
        ParameterError: A value is not allowed.
    """

    worlds: int = 32
    decisions: int = 128
    epochs: int = 4
    minibatch: int = 4096
    hidden: int = 64
    memory: int = 0
    learning_rate: float = 1e-3
    discount: float = 0.99
    trace: float = 0.95
    clip: float = 0.2
    entropy: float = 0.0
    critic: str = "own"
    evaluate_every: int = 0
    evaluate_episodes: int = 100

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            least = (
                0
                if name in ("entropy", "evaluate_every", "discount", "trace", "memory")
                else 1
                if type(value) is int
                else 1e-12
            )
            most = 1.0 if name in ("discount", "trace") else np.inf
            if name != "critic" and not least <= value <= most:
                raise ParameterError(
                    f"{name} = {value!r} is not allowed; it takes a number from {least:g} to {most:g}"
                )
        if self.critic not in CRITICS:
            raise ParameterError(
                f"critic = {self.critic!r} is not allowed{nearest_name(self.critic, CRITICS)}; {listed(CRITICS)}"
            )

    def replaced(self, given: Mapping[str, Any], where: str) -> Settings:
        """These settings with other values, which may be texts.

        Args:
            given: Values by name.
            where: What names them, for errors.

        Raises:
            ParameterError: A name is unknown, or a value is not allowed.
        """
        found = asdict(self)
        for name, value in given.items():
            if name not in found:
                raise ParameterError(
                    f"{where}: there is no setting {name!r}{nearest_name(name, found)}; {listed(found)}"
                )
            kind = type(getattr(Settings, name))
            is_whole = not isinstance(value, float) or kind is not int
            try:
                if isinstance(value, bool) or not is_whole:
                    raise ValueError
                found[name] = kind(value)
            except (TypeError, ValueError):
                what = {int: "a whole number", float: "a number", str: "a text"}[kind]
                raise ParameterError(f"{where}: {name} = {value!r} is not allowed; it takes {what}") from None
        try:
            return Settings(**found)
        except ParameterError as error:
            raise ParameterError(f"{where}: {error}") from None


def read_training(path: Path) -> dict[str, Any]:
    """Values of a TOML file of settings, by name.

    Raises:
        ParameterError: It cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(read_text(path, ParameterError, MAX_TEXT).removeprefix("\ufeff"))
    except tomllib.TOMLDecodeError as error:
        raise ParameterError(f"{path}: this is not TOML: {error}") from None
    except RecursionError:
        raise ParameterError(f"{path}: lists or tables are nested too deep") from None


__all__ = ["Settings", "read_training"]
