"""The host's side of CANopen: network management, heartbeats both ways, emergencies, SDO; one thread, no waiting that
has no end. Profiles add the frames of the cycle to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from devices.cia301 import frames
from devices.cia301.disturbance import Disturbances
from devices.cia301.frames import HOST_NODE, NmtCommand, NmtState
from devices.errors import FrameError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from devices.cia301.buses import CanBus
    from devices.clock import Clock

HEARTBEAT_PERIOD, HEARTBEAT_LIMIT = 0.1, 0.5
"""Time between heartbeats, both ways, and how long one may be missing, s."""

# With `idle` every node answers on this thread: what has not come after so many rounds never will.
_ROUNDS = 10
# However many frames of others arrive, a wait ends.
_FRAMES_AT_ONCE = 5000


@dataclass(slots=True)
class FrameCounts:
    """Frames that were not an answer to the last SYNC or SDO request.

    Attributes
    ----------
    foreign : int
        Of nodes or services that are none of ours.
    commands : int
        Of another master: what only the host sends.
    stale : int
        Answers that came before what they should answer, or twice.
    heartbeats : int
        Of our nodes.
    malformed : int
        Of our nodes, with bytes that make no sense.
    """

    foreign: int = 0
    commands: int = 0
    stale: int = 0
    heartbeats: int = 0
    malformed: int = 0


class Host:
    """Some nodes, seen from the host.

    Parameters
    ----------
    bus : CanBus
    nodes : sequence of int
        Ours; others on the bus are left alone.
    clock : Clock
    idle : callable, optional
        Called while waiting; nodes that live on this thread are serviced in it. With it nothing blocks.
    node : int
        The host's own number, under which it beats.
    answers : sequence of int
        Identifiers of process data that are waited for after a SYNC, the one that is always required first.
    own : sequence of int
        Identifiers of process data that the host sends.

    Attributes
    ----------
    counts : FrameCounts
    emergencies : dict
        First emergency of each node since its last error reset.
    restarted : int or None
        A node that is no longer operational, though it was started.
    answer_time : float
        From the last SYNC to the last of its answers, s; NaN before the first.
    other_master : str or None
        What another master was first heard to send.
    """

    def __init__(
        self,
        bus: CanBus,
        nodes: Sequence[int],
        clock: Clock,
        idle: Callable[[], None] | None,
        *,
        node: int = HOST_NODE,
        answers: Sequence[int] = (),
        own: Sequence[int] = (),
    ) -> None:
        if node in nodes:
            raise ValueError(f"CANopen node {node} is the host's own; no device can have it")
        self.counts = FrameCounts()
        self.emergencies: dict[int, frames.Emergency] = {}
        self.restarted: int | None = None
        self.other_master: str | None = None
        self.bus = bus
        self.node = node
        self.nodes = tuple(nodes)
        self._clock = clock
        self._idle = idle
        self.answer_time = math.nan
        self._expected = set(answers)
        self._first = answers[0] if answers else None
        self._emergencies = {frames.EMCY + number: number for number in nodes}
        self._heartbeats = {frames.HEARTBEAT + number: number for number in nodes}
        requests = [frames.SDO_REQUEST + number for number in nodes]
        # The bus keeps our own frames from us: whoever sends these is another master.
        self._masters = {frames.NMT: "NMT", frames.SYNC: "SYNC", frames.HEARTBEAT + node: "the host's heartbeat"}
        self._masters |= dict.fromkeys(own, "set-points") | dict.fromkeys(requests, "SDO requests")
        self._disturbances = Disturbances()
        self._sdo_answers = {frames.SDO_ANSWER + number for number in nodes}
        self._beat_due = -math.inf
        self._looked = -math.inf
        self._due: dict[int, float] = {}

    def collect(self, time_limit: float, spare: float | None) -> dict[int, bytes]:
        """Return the answers to the SYNC just sent, by identifier, as far as they come within `time_limit`, s.

        With `spare`, s, the others are waited for no longer than that once the first is there.
        """
        answers: dict[int, bytes] = {}
        sent = self._clock.now()
        deadline = sent + time_limit
        wanted = len(self._expected)
        for _ in range(_FRAMES_AT_ONCE):
            if (frame := self.next_frame(deadline)) is None:
                break
            identifier, data = frame
            if identifier not in self._expected or identifier in answers:
                self.sort(identifier, data)
                continue
            answers[identifier] = data
            if len(answers) == wanted:
                break
            if spare is not None and identifier == self._first:
                deadline = sent + spare
        self.answer_time = self._clock.now() - sent
        return answers

    def start(self) -> None:
        """Tell our nodes, and only ours, to become operational."""
        for node in self.nodes:
            self.bus.send(frames.NMT, frames.pack_nmt(NmtCommand.START, node))

    def watch(self, node: int) -> None:
        """Expect heartbeats of a node from now on; see `silent`."""
        self._due[node] = self._clock.now() + HEARTBEAT_LIMIT

    def beat(self) -> None:
        """Send the host's own heartbeat if it is due, so that nodes which watch it know that it lives."""
        now = self._clock.now()
        if now >= self._beat_due:
            self._beat_due = now + HEARTBEAT_PERIOD
            self.bus.send(frames.HEARTBEAT + self.node, frames.pack_heartbeat(NmtState.OPERATIONAL))

    def silent(self) -> int | None:
        """Return a watched node whose heartbeat is overdue, or None; ask once a cycle, after `drain`."""
        now = self._clock.now()
        away, self._looked = now - self._looked, now
        if away > 0.5 * HEARTBEAT_LIMIT:
            # Time in which the host itself did not look is no node's silence.
            for node in self._due:
                self._due[node] = now + HEARTBEAT_LIMIT
        for node, due in self._due.items():
            if now > due:
                return node
        return None

    def trust(self) -> None:
        """Judge the bus by what happens from now on: bringing machines up and down is allowed late answers."""
        self.other_master = None
        self._disturbances = Disturbances()

    def disturbance(self) -> str | None:
        """Return why the bus is not to be trusted, a sentence, or None; ask once a cycle, after `drain`."""
        if self.other_master is not None:
            return f"another master sends {self.other_master}"
        return self._disturbances.judge(errors=self.bus.errors, stale=self.counts.stale)

    def drain(self) -> None:
        """Take in what has arrived: emergencies and heartbeats count, answers are stale."""
        for _ in range(_FRAMES_AT_ONCE):
            if (frame := self.bus.receive()) is None:
                return
            self.sort(*frame)

    def next_frame(self, deadline: float) -> tuple[int, bytes] | None:
        """Return the next frame, or None where none came until `deadline`, s of the clock."""
        if self._idle is None:
            left = deadline - self._clock.now()
            return self.bus.receive(left) if left > 0.0 else None
        frame = self.bus.receive()
        for _ in range(_ROUNDS):
            # Once at least, however late it is: where host and nodes share a thread they were all late.
            if frame is None:
                self._idle()
                frame = self.bus.receive()
            if frame is not None or self._clock.now() > deadline:
                break
        return frame

    def await_frame(self, identifier: int, time_limit: float) -> bytes | None:
        """Return the bytes of the next frame with this identifier; None where it does not come within the limit, s."""
        deadline = self._clock.now() + time_limit
        for _ in range(_FRAMES_AT_ONCE):
            if (frame := self.next_frame(deadline)) is None:
                return None
            if frame[0] == identifier:
                return frame[1]
            self.sort(*frame)
        return None

    def sort(self, identifier: int, data: bytes) -> None:
        """Take one frame that is not waited for."""
        counts = self.counts
        try:
            if identifier in self._masters:
                counts.commands += 1
                self.other_master = self.other_master or self._masters[identifier]
            elif identifier in self._expected or identifier in self._sdo_answers:
                counts.stale += 1
            elif identifier in self._emergencies:
                self._note(self._emergencies[identifier], frames.unpack_emergency(data))
            elif identifier in self._heartbeats:
                counts.heartbeats += 1
                self._hear(self._heartbeats[identifier], frames.unpack_heartbeat(data))
            else:
                counts.foreign += 1
        except FrameError:
            counts.malformed += 1

    def _note(self, node: int, emergency: frames.Emergency) -> None:
        # Code 0 says that errors are over; the first cause is what counts until then.
        if emergency.code == 0:
            self.emergencies.pop(node, None)
        else:
            self.emergencies.setdefault(node, emergency)

    def _hear(self, node: int, state: NmtState) -> None:
        if state is not NmtState.OPERATIONAL:
            self.restarted = node
        if node in self._due:
            self._due[node] = self._clock.now() + HEARTBEAT_LIMIT
