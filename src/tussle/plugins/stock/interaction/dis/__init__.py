"""A world in an exercise of Distributed Interactive Simulation."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from tussle.api import Interaction, Param, State, WorldView
from tussle.errors import ParameterError
from tussle.numeric.quaternion import quat_rotate_inverse
from tussle.plugins.stock.interaction.dis import pdu
from tussle.plugins.stock.interaction.dis.link import ExerciseLink, Remote

MAX_PORT = 65535


class DIS(Interaction):
    """Shares the entities with other simulators by IEEE 1278.1 (DIS), versions 6 and 7: Entity State PDUs by UDP.

    Each entity is sent when it appears, every `heartbeat`, and as soon as the others' dead reckoning of it is wrong by more than
    `position_threshold` or `orientation_threshold`; when it is gone, a PDU says so. Entities of other simulators become entities of
    the block `remote`, which has `count` 0 and the motion model External; they move by the dead reckoning algorithm of their last PDU
    (1 to 9) and are removed when their simulator says so or after `timeout` without a PDU. Such an entity that something here removes
    stays away until then.

    A force of DIS is a team: entities have the number of their team, and remote ones the team with the number of their force, or
    else that of the block. PDUs of other exercises, damaged ones, and entities further than `reach` from the origin are ignored; the
    result counts them. DIS knows no authentication: whoever reaches the port adds entities. In a stack of worlds the first one takes
    part. HLA, fire, detonation and emission PDUs are not there.

    Raises:
        ParameterError: An address is not known, the port is taken, or a type is no type.
        MissionError: There is no block `remote`.
    """

    grade = "external"

    address = Param("127.0.0.1", doc="Where PDUs are sent: a host, a broadcast or a multicast address.")
    port = Param(3000, structural=True, ge=1, le=MAX_PORT, doc="Its port.")
    listen_address = Param(
        "127.0.0.1", doc="Address that PDUs are received on; for multicast, that of the interface."
    )
    listen_port = Param(
        0, structural=True, ge=0, le=MAX_PORT, doc="Port that they are received on; 0 for none."
    )
    remote = Param("", doc="Block of the entities of other simulators.")
    version = Param(7, structural=True, choices=(6, 7), doc="Protocol version of sent PDUs.")
    exercise = Param(1, structural=True, ge=0, le=255, doc="Number of the exercise.")
    site = Param(1, structural=True, ge=0, le=65534, doc="Number of this site.")
    application = Param(1, structural=True, ge=0, le=65534, doc="Number of this simulation at the site.")
    types = Param(
        (), fields=f"team {' '.join(pdu.TYPE_FIELDS)}", ragged=True,
        doc="Types of the entities, by team; a platform of no domain where there is none.",
    )  # fmt: skip
    heartbeat = Param(5.0, structural=True, unit="s", gt=0.0, doc="Longest time between PDUs of an entity.")
    timeout = Param(12.0, structural=True, unit="s", gt=0.0, doc="Time after which a silent one is removed.")
    position_threshold = Param(1.0, structural=True, unit="m", ge=0.0, doc="Error that calls for a PDU.")
    orientation_threshold = Param(
        math.radians(3.0), structural=True, unit="rad", text_unit="deg", ge=0.0, doc="Likewise."
    )
    reach = Param(
        200e3, structural=True, unit="m", gt=0.0, doc="Largest distance of remote entities from the origin."
    )
    most_remote = Param(1000, structural=True, ge=0, doc="Largest number of remote entities.")
    time_warp = Param(
        1.0, structural=True, ge=0.0, doc="Simulated time over time, at most; 0 is as fast as possible."
    )
    key = State(dtype=int, doc="Site, application and number of a remote entity as one number; 0 for others.")
    sent_time = State(unit="s", default=-math.inf, doc="When its last PDU was sent.")
    sent_pos = State("x y z", unit="m", doc="Position in that.")
    sent_vel = State("x y z", unit="m/s", doc="Velocity in that.")
    sent_quat = State("w qx qy qz", default=1.0, doc="Attitude in that.")
    sent_omega = State("x y z", unit="rad/s", doc="Angular velocity in that, body axes.")

    def check_values(self) -> None:
        """Check the types of entities."""
        for row in self.values["types"]:
            for field, value in zip(pdu.TYPE_FIELDS, row[1:], strict=True):
                most = np.iinfo(pdu.TYPE[field]).max
                if not (value == int(value) and 0 <= value <= most):
                    raise ParameterError(
                        f"DIS.types: {field} = {value:g} of team {row[0]:g} is not allowed; it takes a whole number from 0 to {most}"
                    )

    def named_blocks(self) -> tuple[str, ...]:
        """Return the block of the remote entities, if there is one."""
        return (self.values["remote"],) if self.values["remote"] else ()

    def start(self, w: WorldView) -> None:
        """Open the socket."""
        if self.listen_port and not self.remote:
            raise ParameterError(
                f"{self.instance_name}: listen_port = {self.listen_port} needs remote, the block of the entities that come"
            )
        self._link(w)

    def step(self, w: WorldView) -> None:
        """Move the remote entities, and send the own ones."""
        link, t = self._link(w), float(w.t[0])
        if self.time_warp:
            link.pace.hold(t, w.dt, w.context.is_interrupted)
        link.begin(t)
        own = self.site << 16 | self.application
        link.receive(t, self.exercise, own, w.scene.origin, self.reach, self.most_remote)
        link.forget(t - self.timeout)
        is_remote = np.zeros(w.n, bool)
        if self.remote:
            is_remote = w.bodies.block == w.context.block_names.index(self.remote)
            self._move(w, link, np.flatnonzero(is_remote & (w.world == 0)), t)
        self._send(w, link, np.flatnonzero(~is_remote & (w.world == 0)), t)

    def _link(self, w: WorldView) -> ExerciseLink:
        places = self.address, self.port, self.listen_address, self.listen_port, self.time_warp
        link: ExerciseLink = w.context.share((DIS, self.instance_name), partial(ExerciseLink, *places))
        return link

    # -- entities of other simulators -----------------------------------------------------------------------------------------------

    def _move(self, w: WorldView, link: ExerciseLink, rows: np.ndarray, t: float) -> None:
        """Give each remote entity a row, request rows for new ones, remove those that are gone, and move all."""
        remotes, origin = link.remotes, w.scene.origin
        row_of = {int(key): int(row) for key, row in zip(self.key[rows], rows, strict=True) if key}
        w.kill([row for key, row in row_of.items() if key not in remotes], "left the exercise")
        free = [int(row) for row in rows if not self.key[row]]
        born: list[tuple[Remote, int]] = []
        for key, remote in remotes.items():
            if key in row_of or remote.is_here:
                remote.is_here = True
                continue
            team = self._team(w, remote)
            row = next((row for row in free if w.team[row] == team), None)
            if row is None:
                born.append((remote, team))
            else:
                free.remove(row)
                self.key[row], row_of[key], remote.is_here = key, row, True
        w.kill(free, "left the exercise")
        there = {key: row for key, row in row_of.items() if key in remotes}
        found = [remotes[key] for key in there] + [remote for remote, _ in born]
        if not found:
            return
        records = np.array([remote.record for remote in found], pdu.LAYOUT)
        pos, vel, quat, omega = pdu.reckon(records, t - np.array([remote.t for remote in found]), origin)
        n = len(there)
        w.move(list(there.values()), pos=pos[:, :n], vel=vel[:, :n], quat=quat[:, :n], omega=omega[:, :n])
        if born:
            teams = [team for _, team in born]
            w.spawn(
                self.remote, [0] * len(born), pos=pos[:, n:], vel=vel[:, n:], quat=quat[:, n:], team=teams
            )

    def _team(self, w: WorldView, remote: Remote) -> int:
        force = int(remote.record["force"])
        if force in w.teams:
            return force
        return int(w.context.simulation().mission.blocks[w.templates.index(self.remote)].team)

    # -- own entities ---------------------------------------------------------------------------------------------------------------

    def _send(self, w: WorldView, link: ExerciseLink, rows: np.ndarray, t: float) -> None:
        """Send the entities that are due, and say which are gone."""
        for row in rows[w.id[rows] > pdu.MAX_ENTITY]:
            w.fail(row, f"DIS has no number for entity {w.id[row]}; the largest is {pdu.MAX_ENTITY}")
        rows = rows[w.id[rows] <= pdu.MAX_ENTITY]
        here = set(w.id[rows].tolist())
        if gone := [number for number in link.sent if number not in here]:
            link.leave(gone)
        rows = rows[self._is_due(w, rows, t)]
        if not len(rows):
            return
        pos, vel, quat, omega = (x[:, rows] for x in (w.pos, w.vel, w.bodies.quat, w.omega))
        records = pdu.encode(w.scene.origin, pos, vel, quat, omega)
        records["version"], records["exercise"], records["timestamp"] = (
            self.version,
            self.exercise,
            link.stamp,
        )
        records["site"], records["application"], records["entity"] = self.site, self.application, w.id[rows]
        records["force"] = np.where((w.team[rows] >= 0) & (w.team[rows] <= 255), w.team[rows], 0)
        types = {int(row[0]): tuple(map(int, row[1:])) for row in self.values["types"]}
        nobody = (1,) + (0,) * (len(pdu.TYPE_FIELDS) - 1)
        records["type"] = np.array([types.get(int(team), nobody) for team in w.team[rows]], pdu.TYPE)
        records["marking"] = [self._marking(w, int(row)) for row in rows]
        link.send(records)
        self.sent_time[rows], self.sent_pos[:, rows], self.sent_vel[:, rows] = t, pos, vel
        self.sent_quat[:, rows], self.sent_omega[:, rows] = quat, quat_rotate_inverse(quat, omega)

    def _is_due(self, w: WorldView, rows: np.ndarray, t: float) -> np.ndarray:
        """Whether each entity, (m,), is to be sent: the others have waited for long, or are wrong about it."""
        age = t - self.sent_time[rows]
        is_due = age >= self.heartbeat - 1e-9
        age = np.where(is_due, 0.0, age)
        pos, _, quat, _ = pdu.extrapolate(
            np.full(len(rows), pdu.CONSTANT_RATES), self.sent_pos[:, rows], self.sent_vel[:, rows],
            np.zeros((3, len(rows))), self.sent_quat[:, rows], self.sent_omega[:, rows], age,
        )  # fmt: skip
        error = w.pos[:, rows] - pos
        cosine = np.abs((quat * w.bodies.quat[:, rows]).sum(axis=0))
        angle = 2.0 * np.arccos(np.minimum(cosine, 1.0))
        return np.asarray(
            is_due
            | ((error * error).sum(axis=0) > self.position_threshold**2)
            | (angle > self.orientation_threshold)
        )

    def _marking(self, w: WorldView, row: int) -> bytes:
        """Name of an entity, such as "prey 12", in at most 11 characters; long names of blocks are cut."""
        number = f" {int(w.bodies.block_index[row]) + 1}"
        name = w.context.block_names[int(w.bodies.block[row])]
        return f"{name[: pdu.MARKING_CHARACTERS - len(number)]}{number}".encode("ascii", "replace")

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        """PDUs of the first world: sent, received and refused."""
        link, first = self._link(w), np.arange(w.n_worlds) == 0
        counts = {"sent": link.n_sent, "received": link.n_received, "refused": link.n_refused}
        return {name: count * first for name, count in counts.items()}
