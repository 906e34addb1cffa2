"""Recorded reaching of people in a four-joint arm exoskeleton (HuG-MP), in the freedoms of our arm.

Source: TUM-ITR/HuG-MP, processed_dataset; angles in degrees at 100 Hz, order abduction, flexion, rotation, elbow.
"""

import os
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.errors import RecordingError
from exograv.motion import Trajectory

RATE_HZ = 100.0
CUTOFF_HZ = 6.0
"""Cutoff frequency [Hz]. Reaching has little power above. Derivatives of the angles' steps of 0.03° would be noise."""

Angles = Float[np.ndarray, "tick 4"]


def reaching_folder() -> Path:
    """Return the folder of the recordings.

    The folder is `$EXOGRAV_DATA/exo_reaching`, or `shared/data/exo_reaching` beside the project.

    Raises:
        RecordingError: The folder does not exist.
    """
    beside = Path(__file__).parents[4] / "shared" / "data"
    folder = Path(os.environ.get("EXOGRAV_DATA", beside)) / "exo_reaching"
    if not folder.is_dir():
        raise RecordingError(
            f"No recorded reaching in {folder}. Get processed_dataset of github.com/TUM-ITR/HuG-MP, put it into a "
            "folder exo_reaching and set EXOGRAV_DATA to the folder above it; or choose --movement pointing."
        )
    return folder


def read_reaching(path: Path, task: int, repetition: int = 1) -> Angles:
    """Read flexion, abduction, rotation, elbow [rad] at `RATE_HZ`, for a repetition of a task, both counted from 1.

    Raises:
        RecordingError: The file cannot be read, or has no such task.
    """
    return arm_angles(np.deg2rad(np.concatenate(_segments(path, task, repetition), axis=1).T))


def smooth_path(q: Angles, dt: float) -> Trajectory:
    """Return recorded angles without the steps of the encoder, at a period of `dt` [s]."""
    from scipy.interpolate import CubicSpline
    from scipy.signal import butter, sosfiltfilt

    smooth = sosfiltfilt(butter(2, CUTOFF_HZ, fs=RATE_HZ, output="sos"), q, axis=0)
    spline = CubicSpline(np.arange(len(smooth)) / RATE_HZ, smooth)
    t = np.arange(0.0, (len(smooth) - 1) / RATE_HZ, dt)
    return Trajectory(spline(t), spline(t, 1), spline(t, 2), dt)


def arm_angles(exo: Angles) -> Angles:
    """Compute the freedoms of our arm from joint angles of that exoskeleton [rad].

    In that exoskeleton, abduction is first, then flexion, then rotation about the upper arm's own axis. Abduction,
        flexion
    and internal rotation count as negative (inferred from the joints' ranges and from the tasks). Here flexion is
        first.
    """
    from scipy.spatial.transform import Rotation

    # Right arm, x forward, y left: flexion turns about −y, abduction about −x, internal rotation about z.
    theirs = Rotation.from_euler("XYZ", exo[:, :3] * np.array([1.0, 1.0, -1.0]))
    about_y, about_x, about_z = theirs.as_euler("YXZ").T
    return np.column_stack([-about_y, -about_x, about_z, exo[:, 3]])


def _segments(path: Path, task: int, repetition: int) -> list[Float[np.ndarray, "4 tick"]]:
    from scipy.io import loadmat

    try:
        cell = loadmat(path)["tasks"][repetition - 1, task - 1]
        segments = [np.asarray(segment, dtype=float) for segment in cell.ravel()]
    except (OSError, ValueError, KeyError, IndexError, TypeError) as error:
        raise RecordingError(
            f"{path} has no repetition {repetition} of task {task} ({error}). Give processed trajectories of HuG-MP."
        ) from error
    if not segments or any(segment.ndim != 2 or segment.shape[0] != 4 for segment in segments):
        raise RecordingError(f"{path}, task {task}: segments must be 4 × N angles. Give the processed trajectories.")
    return segments
