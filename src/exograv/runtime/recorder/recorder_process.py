"""Recorder process: reads the rings and writes the file; also the types that both sides share."""

import contextlib
import json
import math
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import ExogravError, RecordingError
from exograv.recording import RecordingWriter
from exograv.recording.disk import TICKS_PER_S
from exograv.recording.encoding import tick_dtype
from exograv.recording.guard_state import guard_message
from exograv.recording.messages import TimingMessage
from exograv.recording.schema import CHANNELS
from exograv.results import json_value
from exograv.runtime.lsl.blocks import RecordedDevices
from exograv.runtime.lsl.intake import BlockError, BlockIntake
from exograv.runtime.lsl.outlets import Outlets, OutletsJob
from exograv.runtime.processes.shared_memory import Mailbox, Ring
from exograv.safety.state import VERSION, most_numbers

RING_TICKS = 32 * TICKS_PER_S
"""Capacity of the ring: five seconds without a recorder, and the time in which the next one reads the file.

The five seconds are those of F18 in docs/explanation/safety.md. Reading takes a second per ten minutes of recording on
an idle computer, and three on a busy one.
"""

RING_EVENTS = 256
"""Capacity of the ring of events, which are rare."""

EVENT = np.dtype([("t", "<f8"), ("kind", "S32"), ("text", "S480")])
"""Entry of the ring of events; text is UTF-8."""

RING_GUARDS = 32
"""Capacity of the ring of the guard's states: those of a minute."""

PHASE = "phase"
"""Kind of event that begins a phase with its text as name; it goes to `/phase`, all others to `/event`."""

MARKED = "/task"
"""Topic of the records of a task, each of which is also published as a marker."""

GUARD = "/guard"
"""Topic of the guard's states."""

OWN = frozenset({"/settings", "/tick", "/event", "/phase", GUARD, "/timing", "/correction"})
"""Topics that the recorder writes itself. Messages of all others come from the parent."""

PUBLISH_EVERY_S = 0.01
"""Largest delay of published ticks, without the network [s]."""

GAVE_UP = 3
"""Exit code of a recorder that cannot write its file. A replacement would fail at the same disk."""

STATUS = np.dtype([("start", "<u4"), ("sync_us_max", "<f4"), ("why", "S480"), ("unpublished", "S480")])
"""Status of a recorder: its number, its longest sync, and why it cannot write or publish any more."""


@dataclass(frozen=True)
class Inlet:
    """Names of the shared memory by which another process hands over data to record. One process writes into each."""

    n_joints: int
    tick_ring: str
    event_ring: str
    guard_ring: str

    def ticks(self) -> Ring:
        """Return the ring of ticks: rows of `recording.encoding.tick_dtype`, each with its `phase` and `sequence`."""
        return Ring(tick_dtype(self.n_joints), RING_TICKS, self.tick_ring)

    def events(self) -> Ring:
        """Return the ring of events: rows of `event`."""
        return Ring(EVENT, RING_EVENTS, self.event_ring)

    def guards(self) -> Ring:
        """Return the ring of the guard's states: rows of `guard_dtype`."""
        return Ring(guard_dtype(self.n_joints), RING_GUARDS, self.guard_ring)


def guard_dtype(n_joints: int) -> np.dtype:
    """Return the type of an entry of the ring of the guard's states; the first `size` numbers count."""
    return np.dtype(
        [
            ("now", "<f8"),
            ("t", "<f8"),
            ("persons", "<i8"),
            ("size", "<i8"),
            ("numbers", "<f8", (most_numbers(n_joints),)),
        ]
    )


def event(t: float, kind: str, text: str) -> np.ndarray:
    """Return an entry of the ring of events; a text that is too long is cut."""
    row = np.zeros((), EVENT)
    row["t"], row["kind"], row["text"] = t, _utf8(kind, "kind"), _utf8(text, "text")
    return row


def _utf8(text: str, name: str) -> bytes:
    """Return the text cut to the size of this entry, in whole characters."""
    return text.encode(errors="replace")[: EVENT[name].itemsize].decode(errors="ignore").encode()


def message_of(row: np.void) -> dict[str, object]:
    """Return the message of an entry of the ring of the guard's states, without its time."""
    size, now = min(max(int(row["size"]), 0), len(row["numbers"])), float(row["now"])
    return guard_message(now if math.isfinite(now) else 0.0, int(row["persons"]), VERSION, row["numbers"][:size])


QUIET_S, LOOK_S = 0.5, 0.05
"""Time without ticks after which a guard has ended, and time between two looks [s]."""

OUTLAST_MAX_S = 15.0
"""Time after which a guard without a parent has surely let the arm down [s]."""


@dataclass(frozen=True)
class RecorderJob:
    """Start arguments of a recorder process."""

    path: Path
    joints: tuple[str, ...]
    settings: Mapping[str, Any]
    """Content of the channel `/settings`."""

    inlet: Inlet
    status: str
    """Name of the mailbox for the recorder's status."""

    start: int
    """Number of the recorder of this file, from 1; all but the first continue the file."""

    sync_every_s: float

    outlets: OutletsJob | None = None
    """Streams to publish; None for none."""

    devices: RecordedDevices | None = None
    """Devices whose streams are recorded; None for none."""


@dataclass(frozen=True)
class RunEnd:
    """Last message of the parent: the run has ended."""

    timing: TimingMessage | None = None


def record(job: RecorderJob, parent: Connection) -> None:
    """Run the recorder process, until the parent ends the run or is gone.

    Args:
        job: Data to record, and their file.
        parent: Connection that brings messages, and `RunEnd` at the end of the run.
    """
    try:
        status = Mailbox(STATUS, job.status)
    except FileNotFoundError:  # the parent did not wait for this start
        raise SystemExit(GAVE_UP) from None
    try:
        with contextlib.closing(_Desk(job, status)) as desk:
            until = time.monotonic() + job.sync_every_s
            while True:
                wait_s = until - time.monotonic()
                try:
                    word = _heard(parent, wait_s if job.outlets is None else min(wait_s, PUBLISH_EVERY_S))
                except EOFError:
                    _outlast(desk)
                    word = RunEnd()
                if isinstance(word, tuple):
                    desk.note(*word)
                elif word is not None:
                    break
                if job.outlets is not None:
                    desk.take()
                if time.monotonic() >= until:
                    desk.save()
                    until = time.monotonic() + job.sync_every_s
            desk.finish(word.timing)
    except ExogravError as error:
        _say(status, job.start, 0.0, str(error))
        raise SystemExit(GAVE_UP) from None
    finally:
        status.close()


def _heard(parent: Connection, within_s: float) -> tuple[str, float, dict[str, Any]] | RunEnd | None:
    """Return a message to record, the end of the run, or None."""
    return parent.recv() if parent.poll(max(within_s, 0.0)) else None


def _outlast(desk: "_Desk") -> None:
    """Record on after the parent was killed: its guard still lets the arm down, and the file must hold that."""
    begun = heard = now = time.monotonic()
    while now - begun < OUTLAST_MAX_S and now - heard < QUIET_S:
        if desk.take():
            heard = now
        time.sleep(LOOK_S)
        now = time.monotonic()


class _Desk:
    """State of the recorder process between the rings and the file."""

    def __init__(self, job: RecorderJob, status: Mailbox):
        self._start, self._status, self._sync_us_max = job.start, status, 0.0
        self._is_saved, self._unpublished = True, ""
        with (
            contextlib.closing(job.inlet.ticks()) as ticks,
            contextlib.closing(job.inlet.events()) as events,
            contextlib.closing(job.inlet.guards()) as guards,
        ):
            self._writer = _writer(job, ticks.acknowledged)
            # The last recorder may have died between its sync and its acknowledgement, so ticks in the file are not
            # taken again.
            ticks.acknowledge(self._writer.sync())
            events.acknowledge(self._events_written())
            guards.acknowledge(self._writer.count(GUARD))
        self._ticks, self._events, self._guards = job.inlet.ticks(), job.inlet.events(), job.inlet.guards()
        self._intake = None if job.devices is None else BlockIntake(job.devices, self._writer, has_rig=bool(job.joints))
        self._known = Counter({topic: self._writer.count(topic) for topic in CHANNELS if topic not in OWN})
        self._outlets = None if job.outlets is None else Outlets(job.outlets)
        self._say()

    def note(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Record a message from the parent, unless the file has it: each recorder of a file receives all messages."""
        if self._known[topic] > 0:
            self._known[topic] -= 1
        else:
            if topic == MARKED and self._outlets is not None:
                self._outlets.mark(t, json.dumps(message["record"]))
            if self._intake is not None and "monotonic" in message:
                t = self._intake.rig_time(message["monotonic"])
            self._writer.write(topic, t, message)
            self._is_saved = False

    def take(self) -> bool:
        """Take and publish all new ticks and events; return True if there were any."""
        events, rows = self._events.take(), self._ticks.take()
        if not len(rows) and not len(events):
            return False
        self._is_saved = False
        for row in events:
            self._write_event(row)
        self._writer.ticks(rows)
        for row in self._guards.take():
            self._writer.write(GUARD, float(row["t"]) if np.isfinite(row["t"]) else 0.0, message_of(row))
        if self._intake is not None:
            self._intake.see(rows)
        if self._outlets is not None:
            try:
                self._outlets.publish(rows, events)
            except RuntimeError as error:
                self._outlets, self._unpublished = None, f"LSL has failed, and the recording goes on: {error}"
        return True

    def save(self) -> None:
        """Sync all new data to the disk, then acknowledge them."""
        self.take()
        is_more = self._take_blocks()
        if self._is_saved and not is_more:
            return
        start = time.perf_counter_ns()
        safe = self._writer.sync()
        self._is_saved = True
        self._sync_us_max = max(self._sync_us_max, 1e-3 * (time.perf_counter_ns() - start))
        self._ticks.acknowledge(safe)
        self._events.acknowledge(self._events_written())
        self._guards.acknowledge(self._writer.count(GUARD))
        if self._intake is not None:
            self._intake.acknowledge()
        self._say()

    def finish(self, timing: TimingMessage | None) -> None:
        """Write the end of the file, so that the recording is complete."""
        self.save()
        while self._take_blocks():
            pass
        if timing is not None:
            self._writer.write("/timing", timing.t, json_value(timing))
        self._writer.close()

    def close(self) -> None:
        """Release the shared memory; the file stays as it is."""
        for ring in (self._ticks, self._events, self._guards):
            ring.close()
        if self._intake is not None:
            self._intake.close()

    def _take_blocks(self) -> bool:
        """Write new blocks of other devices; return True if there were any. A block that cannot be is the last one."""
        if self._intake is None:
            return False
        try:
            return self._intake.take()
        except BlockError as error:
            self._intake.close()
            self._intake, self._is_saved = None, False
            self._unpublished = f"Streams of other devices are not recorded any more: a wrong block came ({error})."
            return False

    def _write_event(self, row: np.void) -> None:
        t = float(row["t"]) if np.isfinite(row["t"]) else 0.0
        kind, text = (bytes(row[name]).decode(errors="replace") for name in ("kind", "text"))
        if kind == PHASE:
            self._writer.write("/phase", t, {"name": text})
        else:
            self._writer.write("/event", t, {"kind": kind, "text": text})

    def _say(self) -> None:
        _say(self._status, self._start, self._sync_us_max, "", self._unpublished)

    def _events_written(self) -> int:
        return self._writer.count("/event") + self._writer.count("/phase")


def _writer(job: RecorderJob, acknowledged: int) -> RecordingWriter:
    if job.start > 1:
        try:
            return RecordingWriter.continued(job.path, acknowledged)
        except RecordingError:
            if acknowledged:  # without ticks, it was killed before its settings were written
                raise
    streams = () if job.devices is None else job.devices.streams
    return RecordingWriter(job.path, job.joints, job.settings, streams)


def _say(status: Mailbox, start: int, sync_us_max: float, why: str, unpublished: str = "") -> None:
    row = np.zeros((), STATUS)
    row["start"], row["sync_us_max"] = start, sync_us_max
    row["why"], row["unpublished"] = _utf8(why, "text"), _utf8(unpublished, "text")
    status.write(row)
