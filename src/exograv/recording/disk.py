"""Check of free disk space for a recording, before anything moves."""

import shutil
from pathlib import Path

from exograv.errors import RecordingError

from .container import INDEX_ENTRY, MESSAGE
from .encoding import tick_dtype

ROOM = 2.0
"""Factor of free space over the expected size (docs/explanation/safety.md, F19).

The run may take longer, and other programs write too.
"""

TICKS_PER_S = 1000
"""Tick rate of a live run."""


def expected_bytes(n_joints: int, seconds: float) -> int:
    """Size of a live recording of this duration without compression, an upper limit apart from messages."""
    return round(seconds * TICKS_PER_S * (MESSAGE.itemsize + tick_dtype(n_joints).itemsize + INDEX_ENTRY.itemsize))


def refuse_small_disk(path: Path, n_joints: int, seconds: float) -> None:
    """Refuse to start a run whose recording does not fit on the disk.

    Raises:
        RecordingError: The free space is too small.
    """
    folder = next(folder for folder in path.absolute().parents if folder.is_dir())
    free, needed = shutil.disk_usage(folder).free, round(ROOM * expected_bytes(n_joints, seconds))
    if free < needed:
        raise RecordingError(
            f"{1e-6 * free:.0f} MB are free for {path}, and {seconds:g} s may take half of {1e-6 * needed:.0f} MB. "
            f"Free {1e-6 * (needed - free):.0f} MB there, give another folder with --out, or run for a shorter time."
        )
