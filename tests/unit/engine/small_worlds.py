"""Small plugins and missions for the tests of the engine: motion that can be computed in one's head."""

from __future__ import annotations

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.api import (
    Autonomy,
    EasyAutonomy,
    Interaction,
    Message,
    Metric,
    Output,
    Param,
    Publish,
    State,
    Subscribe,
)
from tussle.declare.columns import Field, Handle
from tussle.stock import SingleIntegrator

VELOCITY = "velocity_x velocity_y velocity_z"


class Drift(Autonomy):
    """Fly with one velocity for ever."""

    grade = "portable"
    to = Param((1.0, 0.0, 0.0), fields="x y z", unit="m/s")
    velocity = Output(VELOCITY, unit="m/s")

    def step(self, g):
        self.velocity[:] = self.to


class Wander(Autonomy):
    """Fly with a velocity that is drawn in every step: any mistake with rows, streams or clocks changes the path."""

    grade = "portable"
    spread = Param(1.0, unit="m/s", ge=0.0)
    pull = State("x y z")
    velocity = Output(VELOCITY, unit="m/s")

    def step(self, g):
        self.pull[:] = 0.5 * self.pull + g.normal("pull", 3)
        self.velocity[:] = self.spread * self.pull


class Note(Message):
    """A number."""

    value = Field(dtype=int)


class Delivery(Message):
    """A number, a list of points and any object."""

    value = Field(dtype=int)
    points = Field("x y", ragged=True)
    thing = Handle()


class Talker(Autonomy):
    """Say the number of the step in the steps [first, last)."""

    first = Param(0)
    last = Param(1_000_000)
    network = Param("GlobalNetwork")
    topic = Param("Note")
    notes = Publish(Note, network_param="network", topic_param="topic")

    def step(self, g):
        said = (g.step_count >= self.first) & (g.step_count < self.last)
        self.notes.publish(said, value=g.step_count[said])


class Listener(Autonomy):
    """Count what is heard; remember the last value, from whom, and in which step it was read."""

    network = Param("GlobalNetwork")
    topic = Param("Note")
    notes = Subscribe(Note, network_param="network", topic_param="topic")
    n_heard = State(dtype=int)
    total = State(dtype=int)
    value = State(dtype=int, default=-1)
    sender = State(dtype=int)
    read_in = State(dtype=int, default=-1)

    def step(self, g):
        rows, heard = self.notes.pairs()
        np.add.at(self.n_heard, rows, 1)
        np.add.at(self.total, rows, heard.value)
        rows, heard = self.notes.latest()
        self.value[rows] = heard.value
        self.sender[rows] = heard.sender
        self.read_in[rows] = g.step_count[rows]


class EasyListener(EasyAutonomy):
    """The same in easy mode."""

    notes = Subscribe(Note)
    n_heard = State(dtype=int)
    value = State(dtype=int, default=-1)
    sender = State(dtype=int)

    def step_one(self, me):
        for note in me.notes:
            me.n_heard = me.n_heard + 1
            me.value = note.value
            me.sender = note.sender.id


class NoteMetric(Metric):
    """Count notes in the step they are said."""

    n_notes = State(dtype=int, per="world")
    total = State(dtype=int, per="world")

    def step(self, w):
        notes = w.inbox(Note)
        np.add.at(self.n_notes, notes.world, 1)
        np.add.at(self.total, notes.world, notes.value)

    def result(self, w):
        return {"n_notes": self.n_notes, "total": self.total}


class Reaper(Interaction):
    """Remove the entities of a team at a time."""

    team = Param(1)
    at = Param(0.5, unit="s")

    def step(self, w):
        w.kill((w.team == self.team[w.world]) & (w.t[w.world] >= self.at[w.world] - 1e-9), "reaped")


def block(name="a", **values):
    """A block of points, at the origin and unscattered unless said otherwise."""
    values.setdefault("motion", SingleIntegrator())
    values.setdefault("autonomy", Drift())
    values.setdefault("variance", (0.0, 0.0, 0.0))
    return Block(name=name, **values)


def mission(*blocks, **values):
    """A mission of one second in ten steps."""
    values.setdefault("end", 1.0)
    return Mission(blocks=blocks or (block(),), **values)


def alone(game, seed, params=None, **values):
    """The simulation of one world after its end."""
    sim = Simulation(game, seeds=seed, params=params, **values)
    sim.run()
    return sim


def hashes(game, seeds, **values):
    """State hash of each world at the end."""
    return [r.state_hash for r in Simulation(game, seeds=seeds, **values).run()]
