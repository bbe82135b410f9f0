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
    """The policy, a multilayer perceptron, and the critic, another one.

    Args:
        width: Numbers of an observation.
        sizes: Number of levels of each action; () for actions in ranges.
        n_actions: Number of actions in ranges.
        hidden: Width of the hidden layers.
        n_state: Numbers of the state of the world that the critic sees besides an observation.
    """

    def __init__(
        self, width: int, sizes: tuple[int, ...], n_actions: int, hidden: int, n_state: int = 0
    ) -> None:
        self.sizes = sizes
        self.policy = perceptron(width, hidden, sum(sizes) or n_actions, 0.01)
        self.critic = perceptron(width + n_state, hidden, 1, 1.0)
        self.log_std = nn.Parameter(torch.full((n_actions,), -1.0))
        self.parameters = [*self.policy.parameters(), *self.critic.parameters(), self.log_std]

    def distributions(self, obs: Any, mask: Any = None) -> list[Any]:
        """Distributions of the actions, independent of each other; levels that a mask (m, levels) excludes have the probability 0."""
        return self._distributions(self.policy(obs), mask)

    def _distributions(self, out: Any, mask: Any) -> list[Any]:
        """Those for what the policy returns."""
        if mask is not None:
            out = out.masked_fill(~mask, -1e9)
        if self.sizes:
            return [torch.distributions.Categorical(logits=part) for part in out.split(self.sizes, -1)]
        return [torch.distributions.Normal(out, self.log_std.exp())]

    def most_likely(self, obs: Any, mask: Any = None) -> Any:
        """Most likely actions, (m, n). Each is, to the last bit, that of its row alone: the network runs on `ROWS` rows at a time."""
        rows = nn.functional.pad(obs, (0, 0, 0, -len(obs) % ROWS)).split(ROWS)
        found = self._distributions(torch.cat([self.policy(some) for some in rows])[: len(obs)], mask)
        return torch.stack([d.logits.argmax(-1) for d in found], -1) if self.sizes else found[0].mean

    def log_prob(self, distributions: list[Any], actions: Any) -> Any:
        """Logarithm of the density of actions, (m, n), as (m,)."""
        if not self.sizes:
            return distributions[0].log_prob(actions).sum(-1)
        return sum(d.log_prob(actions[:, i]) for i, d in enumerate(distributions))

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

    def layers(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Weights (outputs, inputs) and biases of the policy's layers."""
        linear = [layer for layer in self.policy if isinstance(layer, nn.Linear)]
        return [(layer.weight.detach().numpy(), layer.bias.detach().numpy()) for layer in linear]


def perceptron(width: int, hidden: int, n_out: int, last: float) -> Any:
    """Two hidden layers of tanh with orthogonal weights; `last` scales those of the output."""
    layers: list[Any] = []
    for n_in, n, gain in ((width, hidden, 2**0.5), (hidden, hidden, 2**0.5), (hidden, n_out, last)):
        linear = nn.Linear(n_in, n)
        nn.init.orthogonal_(linear.weight, gain)
        nn.init.zeros_(linear.bias)
        layers += [linear, nn.Tanh()]
    return nn.Sequential(*layers[:-1])


__all__ = ["ActorCritic", "perceptron"]
