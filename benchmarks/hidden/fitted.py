"""Fit of `exograv twin fit` in the form that `judge` reads."""

import json
from pathlib import Path

import numpy as np

from exograv.model.description import load_rig
from exograv.storage.twin_file import FittedDrive, FittedJoint, read_twin

STRIBECK_POWER = 1.3
"""Power of the speed in the Stribeck term of `exograv.dynamics.friction`."""
SPEEDS = np.geomspace(0.02, 2.0, 40)


def write_fitted(folder: Path, figures: Path, fit: Path) -> None:
    """Write the twin in a machine's folder, with the figures of `--json`.

    Args:
        folder: Folder of the machine with `twin.toml`.
        figures: File that `exograv twin fit --json` has written.
        fit: File to write.
    """
    twin, said = read_twin(load_rig(str(folder))), json.loads(figures.read_text(encoding="utf-8"))["figures"]
    v = np.concatenate([-SPEEDS[::-1], SPEEDS])
    torque = np.stack([friction(joint, v) for joint in twin.joints], axis=1)
    content = {
        "friction": {"speed_rad_s": v.tolist(), "torque_Nm": torque.tolist(), "t_s": said["recorded_s"]},
        "delay_ms": twin.delay_ms[0],
        "lag_ms": [lag_ms(drive) for drive in twin.drives],
        "rotor_inertia_kgm2": [joint.rotor_inertia_kgm2 for joint in twin.joints],
        "axis_inertia_kgm2": [row["inertia_kgm2"] for row in said["axis_inertia"]],
        "gain_Nm_per_A": [joint.gain_Nm_per_A for joint in twin.joints],
    }
    fit.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def friction(joint: FittedJoint, v: np.ndarray) -> np.ndarray:
    """Friction of an unloaded joint at constant speeds [N·m]."""
    stribeck = 1.0 + (joint.breakaway - 1.0) * np.exp(-(np.abs(v / joint.v_stribeck_rad_per_s) ** STRIBECK_POWER))
    dry = (joint.coulomb_Nm + joint.asymmetry_Nm * np.sign(v)) * stribeck
    return np.sign(v) * (dry + joint.viscous_Nms_per_rad * np.abs(v) ** joint.viscous_power)


def lag_ms(drive: FittedDrive) -> float:
    """Lag of a drive at low frequency [ms]."""
    order = 2.0 * drive.damping if drive.damping else 1.0
    return 1e3 * order / (2.0 * np.pi * drive.bandwidth_Hz)
