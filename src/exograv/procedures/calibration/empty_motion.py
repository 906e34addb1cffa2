"""Motion file of an empty machine: a table [excitation] as in rig.toml, flown after the sweeps of a calibration."""

import tomllib
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from exograv.errors import ConfigError
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription
from exograv.model.rig_settings import Excitation
from exograv.motion import Trajectory, eased_in, eased_out, fourier, go_to, joined

EASE_S = 3.0
"""Time in which the motion reaches its speed from rest, and comes to rest [s]."""

APPROACH = 0.8
"""Speed to the start of the motion [rad/s]."""


def read_empty_motion(path: Path, description: RigDescription) -> Excitation:
    """Read a motion file.

    Raises:
        ConfigError: The file cannot be read, or the motion is not one of this machine within its limits.
    """
    try:
        with path.open("rb") as stream:
            block = Excitation.model_validate(tomllib.load(stream)["excitation"])
    except (OSError, tomllib.TOMLDecodeError, KeyError, ValidationError) as error:
        raise ConfigError(
            f"{path} holds no motion: {error}. Give a file with a table [excitation], such as further_motion.toml of "
            "`exograv twin fit`."
        ) from error
    joints = len(description.joints)
    if any(len(row) != joints for row in (block.centre_deg, *block.sine_deg, *block.cosine_deg)):
        raise ConfigError(f"{path} is a motion of another number of joints; {description.name} has {joints}.")
    q = _path(block, block.period_s, 0.02).q
    for joint, column in zip(read_exoskeleton(description).joints, q.T, strict=True):
        if column.min() < joint.lower or column.max() > joint.upper:
            low, high, lower, upper = np.rad2deg([column.min(), column.max(), joint.lower, joint.upper])
            raise ConfigError(
                f"{path} moves joint '{joint.name}' from {low:.1f}° to {high:.1f}°; its range is {lower:.1f}° to "
                f"{upper:.1f}°."
            )
    return block


def empty_motion(block: Excitation, q_start: np.ndarray, dt: float) -> Trajectory:
    """Return the way from rest at `q_start` [rad] to the motion, and one period of it, from rest to rest."""
    path = eased_out(eased_in(_path(block, block.period_s + EASE_S, dt), EASE_S), EASE_S)
    return joined([go_to(q_start, path.q[0], APPROACH, dt), path])


def _path(block: Excitation, seconds: float, dt: float) -> Trajectory:
    centre, sine, cosine = (np.deg2rad(part) for part in (block.centre_deg, block.sine_deg, block.cosine_deg))
    return fourier(centre, sine, cosine, block.period_s, seconds, dt)
