"""Recording for the page of `exograv data view`: machine, person and motion."""

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

from exograv.errors import RecordingError
from exograv.loop.replay.recorded_run import readable
from exograv.model.anthropometry import Body
from exograv.model.description import RigDescription, load_rig
from exograv.model.scene import describe_scene
from exograv.options import Side
from exograv.recording import Recording, open_recording
from exograv.recording.machine_files import unpacked_machine

from .view_motion import motion_of
from .view_page import ViewData

NOMINAL = Body(1.75, 75.0, "male")
"""Person of a recording that holds no body data."""


def recorded_view(path: Path, rig: str | None, side: Side | None) -> ViewData:
    """Content of the page for a recording.

    Args:
        path: The recording.
        rig: Machine in place of the recorded one.
        side: Side of the machine in place of the recorded one.

    Raises:
        RecordingError: The file cannot be read, or holds no motion or machine.
        ConfigError: The machine `rig` does not exist.
        ModelError: The machine does not fit the person.
    """
    recording = open_recording(path)
    settings = recording.settings.get("settings") or {}
    told = settings.get("told") or {}
    with _machine(recording, rig, side) as description:
        if description.joints != recording.joints:
            raise RecordingError(
                f"{path} is of a machine with the joints {', '.join(recording.joints)}; {description.name} has "
                f"{', '.join(description.joints)}. Give the recorded machine with --rig."
            )
        with readable(path):
            body = Body(**told["body"]) if "body" in told else NOMINAL
            scene = describe_scene(description, body, told.get("lengths_m"))
    about = [str(recording.settings.get("command", "")), recording.remark or ""]
    title = f"{path.name}: {description.settings.title}"
    return ViewData(title, ". ".join(filter(None, about)), scene, recording.is_simulated, motion_of(recording))


@contextlib.contextmanager
def _machine(recording: Recording, rig: str | None, side: Side | None) -> Iterator[RigDescription]:
    """Machine of the recording. Its files exist as long as the block runs."""
    settings = recording.settings.get("settings") or {}
    side = side or recording.settings.get("side")
    if rig is not None:
        yield load_rig(rig, side)
    elif files := settings.get("rig_files"):
        with tempfile.TemporaryDirectory(prefix="exograv-view-") as folder:
            yield load_rig(str(unpacked_machine(recording.path, files, Path(folder))), side)
    else:
        raise RecordingError(
            f"{recording.path} does not hold the files of its machine. Give the machine with --rig, for example "
            f"--rig {recording.settings.get('rig', 'recupera_like')}."
        )
