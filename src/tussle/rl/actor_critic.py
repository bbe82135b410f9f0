"""A policy and a critic as networks of PyTorch."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.errors import MissingExtraError

try:
    import torch
    from torch import nn
except ImportError:
    raise MissingExtraError("training needs PyTorch: pip install 'tussle[train]'") from None

ROWS = 64
"""With another number of rows, libraries of linear algebra may add in another order."""


class ActorCritic:
    """The policy, a multilayer perceptron, and the critic, another one; with memory, each has a gated recurrent unit.

    What an agent keeps from a decision is given before the next one, (m, 2, memory): for the policy, and for the critic.

    Args:
        width: Numbers of an observation.
        sizes: Number of levels of each action; () for actions in ranges.
        n_actions: Number of actions in ranges.
        hidden: Width of the hidden layers.
        n_state: Numbers of the state of the world that the critic sees besides an observation.
        memory: Numbers that policy and critic keep from one decision to the next; 0 for none.
    """

    def __init__(
        self,
        width: int,
        sizes: tuple[int, ...],
        n_actions: int,
        hidden: int,
        n_state: int = 0,
        memory: int = 0,
    ) -> None:
        self.sizes, self.memory = sizes, memory
        self.policy = network(width, hidden, memory, sum(sizes) or n_actions, 0.01)
        self.critic = network(width + n_state, hidden, memory, 1, 1.0)
        self.log_std = nn.Parameter(torch.full((n_actions,), -1.0))
        self.parameters = [*self.policy.parameters(), *self.critic.parameters(), self.log_std]

    def distributions(self, obs: Any, mask: Any, before: Any, begins: Any = None) -> tuple[list[Any], Any]:
        """Distributions of the actions, independent of each other, and what the policy keeps, (m, memory).

        Args:
            obs: Observations, (m, width), or those of sequences, (m, T, width).
            mask: Levels that are allowed, (m, levels) or (m, T, levels); others have the probability 0.
            before: What has been kept, (m, 2, memory).
            begins: Decisions of sequences before which it is forgotten, (m, T).
        """
        out, after = self.policy(obs, before[:, 0], begins)
        return self._distributions(out, mask), after

    def value(self, seen: Any, before: Any, begins: Any = None) -> tuple[Any, Any]:
        """Values, (m,) or (m, T), and what the critic keeps, (m, memory); arguments as of `distributions`."""
        out, after = self.critic(seen, before[:, 1], begins)
        return out[..., 0], after

    def _distributions(self, out: Any, mask: Any) -> list[Any]:
        """Those for what the policy returns."""
        if mask is not None:
            out = out.masked_fill(~mask, -1e9)
        if self.sizes:
            return [torch.distributions.Categorical(logits=part) for part in out.split(self.sizes, -1)]
        return [torch.distributions.Normal(out, self.log_std.exp())]

    def most_likely(self, obs: Any, before: Any, mask: Any = None) -> tuple[Any, Any]:
        """Most likely actions, (m, n), and what is kept, (m, 2, memory).

        To the last bit, those of a row are those of the row alone: the network runs on `ROWS` rows at a time.
        """
        inputs = (
            nn.functional.pad(each, (0, 0, 0, -len(obs) % ROWS)).split(ROWS) for each in (obs, before[:, 0])
        )
        parts = [self.policy(*rows) for rows in zip(*inputs, strict=True)]
        outs, after = (torch.cat(each)[: len(obs)] for each in zip(*parts, strict=True))
        found = self._distributions(outs, mask)
        actions = torch.stack([d.logits.argmax(-1) for d in found], -1) if self.sizes else found[0].mean
        return actions, torch.stack([after, before[:, 1]], 1)

    def log_prob(self, distributions: list[Any], actions: Any) -> Any:
        """Logarithm of the density of actions, (..., n), as (...)."""
        if not self.sizes:
            return distributions[0].log_prob(actions).sum(-1)
        return sum(d.log_prob(actions[..., i]) for i, d in enumerate(distributions))

    def state(self) -> dict[str, Any]:
        return {
            "policy": self.policy.state_dict(),
            "critic": self.critic.state_dict(),
            "log_std": self.log_std.data,
        }

    def load(self, state: dict[str, Any]) -> None:
        self.policy.load_state_dict(state["policy"])
        self.critic.load_state_dict(state["critic"])
        self.log_std.data.copy_(state["log_std"])

    def layers(self) -> list[tuple[np.ndarray, ...]]:
        """Weights (outputs, inputs) and biases of the policy's layers, and the arrays of its recurrent unit, as for `write_policy`."""
        parts = [layer for layer in self.policy.children() if isinstance(layer, (nn.Linear, nn.GRUCell))]
        return [tuple(each.detach().numpy() for each in layer.parameters()) for layer in parts]


class Perceptron(nn.Sequential):  # type: ignore[misc]
    """Hidden layers of tanh, which keep nothing."""

    def forward(self, x: Any, before: Any, begins: Any = None) -> tuple[Any, Any]:
        """Outputs for rows."""
        return super().forward(x), before


class Recurrent(nn.Module):  # type: ignore[misc]
    """A hidden layer of tanh, a gated recurrent unit, and a linear layer."""

    def __init__(self, first: Any, cell: Any, last: Any) -> None:
        super().__init__()
        self.first, self.cell, self.last = first, cell, last

    def forward(self, x: Any, before: Any, begins: Any = None) -> tuple[Any, Any]:
        """Outputs for rows (m, n), or for sequences (m, T, n), and what the unit keeps, (m, memory)."""
        inner = self.first(x).tanh()
        if begins is None:
            after = self.cell(inner, before)
            return self.last(after), after
        steps = []
        for part, is_new in zip(inner.unbind(1), begins.unbind(1), strict=True):
            before = self.cell(part, before.masked_fill(is_new[:, None], 0.0))
            steps.append(before)
        return self.last(torch.stack(steps, 1)), before


def network(width: int, hidden: int, memory: int, n_out: int, last: float) -> Any:
    """Two hidden layers with orthogonal weights, the second of which may be a recurrent unit; `last` scales those of the output."""
    if memory:
        return Recurrent(
            _linear(width, hidden, 2**0.5), nn.GRUCell(hidden, memory), _linear(memory, n_out, last)
        )
    layers: list[Any] = []
    for n_in, n, gain in ((width, hidden, 2**0.5), (hidden, hidden, 2**0.5), (hidden, n_out, last)):
        layers += [_linear(n_in, n, gain), nn.Tanh()]
    return Perceptron(*layers[:-1])


def _linear(n_in: int, n_out: int, gain: float) -> Any:
    linear = nn.Linear(n_in, n_out)
    nn.init.orthogonal_(linear.weight, gain)
    nn.init.zeros_(linear.bias)
    return linear


__all__ = ["ActorCritic", "network"]
