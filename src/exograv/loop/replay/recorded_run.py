"""Contents of a recording as objects of a session: machine, person and the inputs of control."""

import contextlib
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import ExogravError, RecordingError
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly, adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.model.support import put_together
from exograv.model.tree import Tree
from exograv.recording import Recording, open_recording
from exograv.recording.fields import Message
from exograv.recording.machine_files import unpacked_machine

from .columns import FIELDS, Columns

SINCE = 3
"""First version of the recording format that holds the inputs of control."""

UNUSABLE = (KeyError, TypeError, ValueError, IndexError, AttributeError)
"""Exceptions that are raised when a recording's content has an unknown form."""


class GuardStates:
    """Recorded states of the guard by the time of their tick; of a long recording they stay in the file."""

    def __init__(self, messages: Sequence[Message] = ()):
        self._messages = messages
        self._places = {message["now"]: k for k, message in enumerate(messages)}

    def at(self, now: float) -> Message | None:
        """Return the state after the tick with the decision at `now` [s]; None without one."""
        place = self._places.get(now)
        return None if place is None else self._messages[place]


@dataclass(frozen=True)
class RecordedRun:
    """Recording that can be replayed."""

    recording: Recording
    description: RigDescription
    """Machine as read from the files in the recording, or from their replacement."""

    def pieces(self) -> Iterator[Columns]:
        """Yield all ticks in order, some thousands at a time."""
        first, before, timing = 0, None, self.recording.messages("/timing")
        for ticks in self.recording.pieces(FIELDS):
            if len(ticks):
                yield Columns(ticks, first, gaps(ticks["sequence"], timing, before).tolist())
                first, before = first + len(ticks), int(ticks["sequence"][-1])

    @cached_property
    def guard_states(self) -> "GuardStates":
        """Recorded states of the guard."""
        return GuardStates(self.recording.messages("/guard"))

    @property
    def live(self) -> Mapping[str, Any] | None:
        """Start values of guard and control in a live run; None for a run in lock-step."""
        return self.recording.settings["settings"].get("live")

    @property
    def control(self) -> Sequence[Message]:
        """Inputs of control in a run in lock-step, in order."""
        return self.recording.messages("/control")

    @cached_property
    def assembly(self) -> Assembly:
        """Machine with the arm from the anthropometric table."""
        told = self.recording.settings["settings"]["told"]["body"]
        return put_together(self.description, Body(**told))

    @cached_property
    def tree(self) -> Tree:
        """Empty machine with its set lengths."""
        lengths = self.recording.settings["settings"]["told"]["lengths_m"]
        return adjusted(read_exoskeleton(self.description), self.description, lengths)

    @property
    def phase_names(self) -> list[str]:
        """Names of the phases by their number in a tick; 0 is before the first phase."""
        return ["", *(phase["name"] for phase in self.recording.messages("/phase"))]


@contextlib.contextmanager
def recorded(path: Path, rig: str | None = None) -> Iterator[RecordedRun]:
    """Open a recording for a replay. The machine's files exist as long as the recording is open.

    Args:
        path: The recording.
        rig: Name or folder of a machine in place of the recorded one.

    Raises:
        RecordingError: The file cannot be read, its version does not hold the inputs of control, or the program that
            made it did not record them.
        ConfigError: The machine `rig` does not exist or cannot be used.
    """
    recording = open_recording(path)
    refuse_silent(recording)
    with tempfile.TemporaryDirectory(prefix="exograv-replay-") as folder:
        with readable(path):
            machine = unpacked_machine(path, recording.settings["settings"]["rig_files"], Path(folder))
            side = recording.settings["side"]
        description = load_rig(str(machine) if rig is None else rig, side)
        if description.joints != recording.joints:
            raise RecordingError(
                f"{path} is of a machine with the joints {', '.join(recording.joints)}; {description.name} has "
                f"{', '.join(description.joints)}. Give the recorded machine with --rig, or omit --rig."
            )
        yield RecordedRun(recording, description)


def refuse_silent(recording: Recording) -> None:
    """Refuse a recording that does not hold enough for a replay.

    Raises:
        RecordingError: Names what is missing.
    """
    path, version = recording.path, recording.settings["schema_version"]
    if version < SINCE:
        raise RecordingError(
            f"{path} has version {version} of the recording format; the inputs of control are recorded from version "
            f"{SINCE} on. `exograv report` reads this file; to replay it, record the run again."
        )
    if not recording.tick_count:
        raise RecordingError(f"{path} holds no usable tick. {recording.remark or 'Record a longer run.'}")
    settings = recording.settings.get("settings") or {}
    missing = [f"settings.{name}" for name in ("rig_files", "told") if name not in settings]
    missing += [] if "side" in recording.settings else ["side"]
    if "live" not in settings and not recording.messages("/control"):
        missing.append("/control")
    if missing:
        raise RecordingError(
            f"{path} does not hold {', '.join(missing)}: the program that made it did not record the inputs of "
            "control. Recordings of `exograv demo`, `identify` and `live` can be replayed."
        )


@contextlib.contextmanager
def readable(path: Path) -> Iterator[None]:
    """Turn errors from unreadable content into a `RecordingError`."""
    try:
        yield
    except ExogravError:
        raise
    except UNUSABLE as error:
        raise RecordingError(
            f"{path} holds content that this version of exograv does not write ({type(error).__name__}: {error}). "
            "Replay it with the version that recorded it."
        ) from error


def gaps(sequence: np.ndarray, timing: Sequence[Mapping[str, Any]], before: int | None = None) -> np.ndarray:
    """Count the unrecorded ticks before each recorded one, by the sequence numbers of the measurements (tick,).

    A completed recording states how many ticks its ring buffer lost. If it lost none, a missing number means that a
    bus lost a measurement or that a period was skipped: the guard did not see that measurement either.

    Args:
        sequence: Sequence numbers of ticks that follow each other.
        timing: Messages of `/timing`.
        before: Sequence number of the tick before them; None if they are the first.
    """
    sequence = sequence.astype(np.int64)
    if timing and timing[-1].get("ticks_lost") == 0:
        return np.zeros(len(sequence), dtype=np.int64)
    previous = sequence[:1] - 1 if before is None else before
    return np.maximum(np.diff(sequence, prepend=previous) - 1, 0)
