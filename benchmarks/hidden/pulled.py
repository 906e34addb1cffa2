"""Gains of a hidden machine by what the recording has as a reference: nothing, a force sensor, or a known weight."""

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exograv.model.description import load_rig
from exograv.storage.twin_file import read_twin

from .draw import Hidden, disclosed_mean_gain
from .engine import Joints
from .session import RIG

UNPULLED, PULLED = "_unpulled", "_pulled"
"""Suffixes of the recordings without weights."""
RECORDINGS = {"nothing": f"{UNPULLED}.csv", "force sensor": f"{PULLED}.csv", "weight": ".mcap"}
"""Reference that tells the gains, and the ending of the recording's file."""
NORMAL_95 = 1.96
"""Half width of a 95 % interval [standard deviations]."""


@dataclass(frozen=True)
class GainFit:
    """Gains of one fit beside the true ones."""

    reference: str
    joints: tuple[str, ...]
    error: Joints
    """Relative error against the mean gain in the recording [-]."""
    error_cold: Joints
    """Relative error against the gain of cold windings [-]."""
    half_width: Joints
    """Half of the stated 95 % interval, over the true gain [-]."""

    def rows(self) -> Iterator[str]:
        """Return one line of a table for each joint."""
        for j, joint in enumerate(self.joints):
            figures = (self.error[j], self.error_cold[j])
            within = "yes" if abs(self.error[j]) <= self.half_width[j] else "no"
            cells = [self.reference, joint, *(f"{100.0 * one:+.2f}" for one in figures)]
            yield f"| {' | '.join([*cells, f'{100.0 * self.half_width[j]:.2f}', within])} |"


def gain_fit(hidden: Hidden, recording: Path, reference: str, mean_gain: Joints) -> GainFit:
    """Fit a recording by `exograv twin fit`, and compare its gains with the mean gain in the recording [N·m/A].

    Raises:
        CalledProcessError: The fit was refused.
    """
    out = recording.with_name(f"{recording.stem}_{recording.suffix[1:]}_twin")
    command = [sys.executable, "-m", "exograv", "twin", "fit", RIG, str(recording), "--out", str(out)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    fitted = read_twin(load_rig(str(out / RIG), "right")).joints
    gain = np.array([joint.gain_Nm_per_A for joint in fitted])
    sd = np.array([joint.gain_sd_Nm_per_A for joint in fitted])
    names = tuple(joint.joint for joint in fitted)
    cold = gain / hidden.values["gain"] - 1.0
    return GainFit(reference, names, gain / mean_gain - 1.0, cold, NORMAL_95 * sd / mean_gain)


def print_gains(folder: Path, name: str, truth: Path) -> None:
    """Print the errors and intervals of the gains by what the recording has as a reference."""
    hidden, mean_gain = Hidden.disclosed(truth), disclosed_mean_gain(truth)
    print(f"machine {name}, seed {hidden.seed}, scale of the force sensor {hidden.force_sensing.scale - 1.0:+.2%}")
    print("| reference | joint | error % | of the cold gain % | stated 95 % ± % | inside |")
    print("|" + "---|" * 6)
    for reference, ending in RECORDINGS.items():
        recording = folder / f"{name}{ending}"
        found = gain_fit(hidden, recording, reference, mean_gain[recording.stem])
        print("\n".join(found.rows()), flush=True)
