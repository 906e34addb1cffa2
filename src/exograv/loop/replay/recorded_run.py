"""What a recording holds of its run: machine, person and what control was given, as the objects of a session."""

import contextlib
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from exograv.errors import ExogravError, RecordingError
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly, adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.model.support import put_together
from exograv.model.tree import Tree
from exograv.recording import Recording, read_recording
from exograv.recording.fields import Message

SINCE = 3
"""Version of the recording format from which on a recording holds what control was given."""

UNUSABLE = (KeyError, TypeError, ValueError, IndexError, AttributeError)
"""What comes of content that is not as this exograv writes it."""


@dataclass(frozen=True)
class RecordedRun:
    """A recording that can be flown again."""

    recording: Recording
    description: RigDescription
    """The machine by the files that the recording holds, or by those that take their place."""

    @property
    def gaps(self) -> np.ndarray:
        """Ticks that were flown before each of these, and not recorded (tick,)."""
        return gaps(self.recording.ticks["sequence"], self.recording.messages("/timing"))

    @property
    def live(self) -> Mapping[str, Any] | None:
        """What guard and control of a live run were started with; None of a run in lock-step."""
        return self.recording.settings["settings"].get("live")

    @property
    def control(self) -> Sequence[Message]:
        """What control was given in a run in lock-step, in its order."""
        return self.recording.messages("/control")

    @cached_property
    def assembly(self) -> Assembly:
        """The machine with the arm of the table in it."""
        told = self.recording.settings["settings"]["told"]["body"]
        return put_together(self.description, Body(**told))

    @cached_property
    def tree(self) -> Tree:
        """The empty machine as it was set."""
        lengths = self.recording.settings["settings"]["told"]["lengths_m"]
        return adjusted(read_exoskeleton(self.description), self.description, lengths)

    @property
    def phase_names(self) -> list[str]:
        """By the number in a tick; 0 is before the first."""
        return ["", *(phase["name"] for phase in self.recording.messages("/phase"))]


@contextlib.contextmanager
def recorded(path: Path, rig: str | None = None) -> Iterator[RecordedRun]:
    """Open a recording for a replay; the machine's files are there as long as it is open.

    Args:
        path: The recording.
        rig: Name or folder of a machine in place of the recorded one.

    Raises:
        RecordingError: It cannot be read, is of a version that does not hold what control was given, or of a run
            whose control did not say it.
        ConfigError: There is no machine `rig`, or it cannot be used.
    """
    recording = read_recording(path)
    refuse_silent(recording)
    with tempfile.TemporaryDirectory(prefix="exograv-replay-") as folder:
        with readable(path):
            machine = _unpack(path, recording.settings["settings"]["rig_files"], Path(folder))
            side = recording.settings["side"]
        description = load_rig(str(machine) if rig is None else rig, side)
        if description.joints != recording.joints:
            raise RecordingError(
                f"{path} is of a machine with the joints {', '.join(recording.joints)}; {description.name} has "
                f"{', '.join(description.joints)}. Give the machine that it was recorded on with --rig, or none."
            )
        yield RecordedRun(recording, description)


def refuse_silent(recording: Recording) -> None:
    """Refuse what does not hold enough.

    Raises:
        RecordingError: Says what is missing.
    """
    path, version = recording.path, recording.settings["schema_version"]
    if version < SINCE:
        raise RecordingError(
            f"{path} has version {version} of the recording format; what control was given is in a recording from "
            f"version {SINCE} on. `exograv report` reads it; to replay it, record the run again."
        )
    if not len(recording.ticks):
        raise RecordingError(f"{path} holds no tick that could be used. {recording.remark or 'Record a longer run.'}")
    settings = recording.settings.get("settings") or {}
    missing = [f"settings.{name}" for name in ("rig_files", "told") if name not in settings]
    missing += [] if "side" in recording.settings else ["side"]
    if "live" not in settings and not recording.messages("/control"):
        missing.append("/control")
    if missing:
        raise RecordingError(
            f"{path} does not hold {', '.join(missing)}: the program that recorded it did not say what control was "
            "given. Recordings of `exograv demo`, `identify` and `live` can be replayed."
        )


@contextlib.contextmanager
def readable(path: Path) -> Iterator[None]:
    """Turn content that nobody can use into a sentence."""
    try:
        yield
    except ExogravError:
        raise
    except UNUSABLE as error:
        raise RecordingError(
            f"{path} holds something that this exograv does not write ({type(error).__name__}: {error}). Replay it "
            "with the version that recorded it."
        ) from error


def _unpack(path: Path, files: Mapping[str, str], folder: Path) -> Path:
    """Write the machine's files; its own folder lies so deep in `folder` that its neighbours are inside too."""
    names = {name: PurePosixPath(name) for name in files}
    ups = {name: sum(part == ".." for part in parts.parts) for name, parts in names.items()}
    for name, inside in names.items():
        if inside.is_absolute() or ".." in inside.parts[ups[name] :]:
            raise RecordingError(f"{path} holds a file of the machine outside of its folder: '{name}'. Do not use it.")
    machine = folder.joinpath(*["machine"] * (max(ups.values(), default=0) + 1))
    machine.mkdir(parents=True)
    for name, text in files.items():
        place = machine / names[name]
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding="utf-8")
    return machine


def gaps(sequence: np.ndarray, timing: Sequence[Mapping[str, Any]]) -> np.ndarray:
    """Ticks that were flown and not recorded before each of these, by the numbers of their measurements (tick,).

    A recording that was completed says how many its ring did not take. Where that is none, numbers that are missing
    are of measurements that a bus has lost or of periods that passed: the guard did not see them either.
    """
    sequence = sequence.astype(np.int64)
    if timing and timing[-1].get("ticks_lost") == 0:
        return np.zeros(len(sequence), dtype=np.int64)
    return np.maximum(np.diff(sequence, prepend=sequence[:1] - 1) - 1, 0)
