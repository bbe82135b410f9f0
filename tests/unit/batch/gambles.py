"""A game of chance that costs next to nothing, and plugins that fail for one seed in five; this file is a plugin file too."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np

from tussle import Block, Mission
from tussle.api import Autonomy, Handle, Interaction, Metric, Param, State
from tussle.batch import InProcess
from tussle.stock import Still

THIS = Path(__file__)


def is_bad(seeds):
    """The seeds that things go wrong with: 3, 8, 13 ..."""
    return seeds % np.uint64(5) == 3


class Roulette(Interaction):
    """In each step everyone is hit with some probability, and dies of so many hits as it has health."""

    grade = "portable"

    odds = Param(0.2, ge=0.0, le=1.0)
    harm = Param((1.0, 1.0), fields="least most")
    rule = Param("all", choices=("all", "first"))
    is_gentle = Param(False, structural=True)

    def step(self, w):
        luck = w.uniform_by("luck", w.world, w.id, w.team)
        least, most = self.harm[:, w.world]
        hit = luck < self.odds[w.world]
        if self.rule == "first":
            hit &= w.id % 2 == 1
        harm = least + (most - least) * (luck % 0.01) * 100.0
        w.bodies.health[hit] = w.bodies.health[hit] - harm[hit] * (0.5 if self.is_gentle else 1.0)


class Chips(Metric):
    """What each team has left, by weight."""

    grade = "portable"

    weight = Param(1.0)
    n_steps = State(dtype=int, per="world")
    left = State(per="team")

    def step(self, w):
        self.n_steps[:] += 1
        self.left[:] = 0.0
        np.add.at(self.left, (w.team_numbers(w.team), w.world), w.bodies.health)

    def result(self, w):
        return {"score": self.weight * self.left, "steps": self.n_steps}


class Trouble(Interaction):
    """Goes wrong with the bad seeds, in the way that it is told to."""

    grade = "portable"

    how = Param("never")
    at = Param(2)

    def start(self, w):
        if self.how == "start" and is_bad(w.seeds[w.world]).any():
            raise RuntimeError("this seed cannot begin")

    def step(self, w):
        bad = is_bad(w.seeds[w.world]) & (w.step_count[w.world] == self.at[w.world])
        if not bad.any():
            return
        if self.how == "step":
            raise RuntimeError("this seed goes wrong")
        if self.how == "nan":
            w.move(bad, pos=np.full(3, np.nan))
        elif self.how == "leave":
            sys.exit("this seed leaves")
        elif self.how == "exit":
            os._exit(7)
        elif self.how == "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        elif self.how == "sleep":
            time.sleep(600)

    def result(self, w):
        if self.how == "result" and is_bad(w.seeds).any():
            raise RuntimeError("this seed has no result")
        return {"word": np.array(["said"] * w.n_worlds)} if self.how == "word" else {}


class Nervous(Autonomy):
    """Fails as it is placed, as it decides, or as what it talks to does not answer."""

    how = Param("never")
    link = Handle()

    def open_one(self, row):
        if self.how == "open" and is_bad(np.uint64(row.seed)):
            raise RuntimeError("nobody answers")
        return row.id

    def spawn(self, g, rows):
        if self.how == "spawn" and is_bad(g.context.seeds[g.world[rows]]).any():
            raise RuntimeError("it does not want to")

    def step(self, g):
        bad = is_bad(g.context.seeds[g.world]) & (g.step_count == 1)
        if self.how == "decide" and bad.any():
            raise RuntimeError("it cannot decide")
        for row in np.flatnonzero(bad) if self.how == "part" else ():
            g.fail(row, "it parts from itself")


MISSION = """\
<?xml version="1.0"?>
<runscript name="A game of chance">
  <run start="0" end="${end=1}" dt="${dt=0.1}"/>
  <end_condition>time, one_team</end_condition>
  <entity_interaction odds="${odds=0.2}">Roulette</entity_interaction>
  <entity_interaction how="${how=never}">Trouble</entity_interaction>
  <metrics>Chips</metrics>
  <entity>
    <name>reds</name> <team_id>1</team_id> <count>${reds=4}</count> <health>${health=2}</health>
    <autonomy how="${mood=never}">Nervous</autonomy>
    <motion_model>Still</motion_model>
  </entity>
  <entity>
    <name>blues</name> <team_id>2</team_id> <count>3</count> <health>2</health> <x>50</x>
    <motion_model>Still</motion_model>
  </entity>
</runscript>
"""


def game(how="never", mood="never", reds=4, end=1.0, at=2, **odds):
    """The same, made in Python."""
    blocks = [
        Block(name="reds", team=1, count=reds, health=2.0, autonomy=Nervous(how=mood), motion=Still()),
        Block(name="blues", team=2, count=3, health=2.0, position=(50, 0, 0), motion=Still()),
    ]
    return Mission(
        blocks=blocks, dt=0.1, end=end, end_conditions=("time", "one_team"), name="A game of chance",
        interactions=[Roulette(**odds), Trouble(how=how, at=at)], metrics=[Chips()],
    )  # fmt: skip


def rows(results):
    """All that came of a batch, but for what it cost."""
    return results.table.drop_columns(["cpu_s", "host"]).to_pylist(), results.alive.to_pylist()


def counted(batch, path, until=None, executor=None):
    """Play, and say how many runs were played now."""
    numbers = []
    results = batch.play(
        path,
        executor or InProcess(5),
        until=until,
        on_progress=lambda p: numbers.append((p.n_before, p.n_done)),
    )
    return results, numbers[-1][1] - numbers[-1][0]
