"""Figures of a calibration: the part of `exograv calibrate --json` that says what was found, and warnings."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.identification.calibration.empty_machine import Calibration
from exograv.model.description import RigDescription

DIGITS = 5
GAIN_SD_SURE = 0.02  # share: 2 % of an arm's weight is 0.2 N·m at the shoulder
GAIN_UNUSUAL = 0.15  # share: beyond any unit tolerance (docs/safety.md)
OFFSET_UNUSUAL = np.deg2rad(1.0)
Values = Float[np.ndarray, " value"]


@dataclass(frozen=True)
class CalibrationTruth:
    """True values of a simulated machine at one time of its clock, for the figures only."""

    gain: Float[np.ndarray, " joint"]
    """Torque per current (joint,) [N·m/A]."""
    encoder_offset: Float[np.ndarray, " joint"]
    """Of each joint [rad]."""
    lean: Float[np.ndarray, " 2"]
    """Of the base, forward and left [rad]."""
    friction: Mapping[str, Float[np.ndarray, " joint"]]
    """By the names of `Friction`'s fields."""


def calibration_figures(
    calibration: Calibration, joints: tuple[str, ...], truth: CalibrationTruth | None = None
) -> dict[str, Any]:
    """Gains, friction, encoders, links, base and the residual torque.

    Args:
        calibration: What was found.
        joints: Their names.
        truth: Of a simulated machine, to be shown beside it.
    """
    machine, gains = calibration.machine, calibration.machine.actuators
    offset = np.rad2deg(calibration.offset), np.rad2deg(calibration.offset_sd)
    tilt = np.rad2deg(np.arcsin(calibration.tilt)), np.rad2deg(calibration.tilt_sd)
    true_gain = None if truth is None else truth.gain
    true_offset = None if truth is None else np.rad2deg(truth.encoder_offset)
    true_lean = None if truth is None else np.rad2deg(truth.lean)
    true_friction = {} if truth is None else truth.friction
    return {
        "joints": list(joints),
        "gain": _per_joint(joints, gains.gain, gains.gain_sd, true_gain),
        "friction": _friction_rows(calibration, joints, true_friction),
        "encoder_offset_deg": _per_joint(joints, *offset, true_offset),
        "tilt_deg": _per_joint(("forward", "left"), *tilt, true_lean, key="lean"),
        "links": [
            {"joint": joint, "mass_kg": _short(phi[0]), "first_moment_kgm": _list(phi[1:4]), "sd": _list(sd[:4])}
            for joint, phi, sd in zip(joints, machine.phi, calibration.phi_sd, strict=True)
        ],
        "rotor_inertia_kgm2": _list(machine.rotor_inertia),
        "residual_sd_Nm": _list(machine.residual_sd),
    }


def warnings(calibration: Calibration, description: RigDescription) -> list[str]:
    """What an operator should look at, though it is no reason to refuse."""
    gains, found = calibration.machine.actuators, []
    for j, joint in enumerate(description.joints):
        sd, off = gains.gain_sd[j] / gains.gain[j], gains.gain[j] / description.nominal_gain[j] - 1.0
        if sd > GAIN_SD_SURE:
            found.append(
                f"The gain of '{joint}' is known to ±{1.96 * sd:.0%} only: no weight loads this joint in the sweeps of "
                "rig.toml. Add a sweep in which one does, if there is such a posture."
            )
        if abs(off) > GAIN_UNUSUAL:
            found.append(
                f"The gain of '{joint}' is {off:+.0%} off rig.toml's. Check motor, gear and the unit of current."
            )
        if abs(calibration.offset[j]) > OFFSET_UNUSUAL:
            offset = np.rad2deg(calibration.offset[j])
            found.append(f"The encoder of '{joint}' seems off by {offset:+.1f}°. Set its zero at the jig or the stop.")
    return found


def _per_joint(
    names: tuple[str, ...], value: Values, sd: Values, truth: Values | None, key: str = "joint"
) -> list[dict[str, Any]]:
    return [
        {key: name, **({} if truth is None else {"true": _short(truth[j])}), "estimate": _short(value[j]),
         "ci95": _interval(value[j], sd[j])}
        for j, name in enumerate(names)
    ]  # fmt: skip


def _friction_rows(
    calibration: Calibration, joints: tuple[str, ...], truth: Mapping[str, Values]
) -> list[dict[str, Any]]:
    value, sd = calibration.machine.friction, calibration.machine.friction_sd
    keys = {
        "coulomb_Nm": "coulomb",
        "viscous": "viscous",
        "breakaway": "breakaway",
        "load_share": "load_share",
        "asymmetry_Nm": "asymmetry",
        "v_stribeck_rad_per_s": "v_stribeck",
    }
    rows = []
    for j, joint in enumerate(joints):
        row: dict[str, Any] = {"joint": joint}
        for key, name in keys.items():
            row[key] = _short(getattr(value, name)[j])
            row[f"{key}_ci95"] = _interval(getattr(value, name)[j], getattr(sd, name)[j])
            if name in truth:
                row[f"{key}_true"] = _short(truth[name][j])
        rows.append(row)
    return rows


def _interval(value: float, sd: float) -> list[float]:
    return [_short(value - 1.96 * sd), _short(value + 1.96 * sd)]


def _list(values: Values) -> list[float]:
    return [_short(value) for value in values]


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
