"""Row laws without a simulation: a bound controller and what it sees."""

from types import SimpleNamespace

import numpy as np

from tussle.declare.columns import Numbers


def bound(plugin, n):
    """A plugin whose columns are arrays of n rows at their defaults, all of its outputs read."""
    made = plugin.bound()
    own = {}
    for name, column in type(plugin).declared(Numbers).items():
        if name in plugin.values and not column.is_row_data:
            own[name] = plugin.values[name]
            continue
        value = np.asarray(plugin.values.get(name, getattr(column, "default", 0.0)), float)
        shape = (len(column.fields), n) if column.fields else (n,)
        own[name] = np.array(np.broadcast_to(value[..., None] if value.ndim else value, shape))
    made.__dict__.update(own, wired=frozenset(type(plugin).outputs()))
    return made


def seen(n, dt, **columns):
    """A view of n rows with these body columns."""
    return SimpleNamespace(
        n=n,
        dt=dt,
        kept={},
        column=columns.__getitem__,
        split=lambda run, *given, least: run(*given, (0, n)),
        **columns,
    )
