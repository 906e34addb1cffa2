"""Figures and warnings of a calibration, for `exograv rig calibrate --json`."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float

from exograv.identification.calibration.empty_machine import Calibration
from exograv.identification.calibration.empty_prior import EmptyPrior
from exograv.model.description import RigDescription
from exograv.results import OPTIONAL

DIGITS = 5
GAIN_SD_SURE = 0.02  # relative: 2 % of an arm's weight is 0.2 N·m at the shoulder
GAIN_UNUSUAL = 0.15  # relative: larger than the tolerance of any unit (docs/explanation/safety.md)
OFFSET_UNUSUAL = np.deg2rad(1.0)
TWIN_SURPRISE_SD = 4.0
"""Distance of a gain from the twin's above which the twin is in doubt, in standard deviations of the prior [-]."""
Values = Float[np.ndarray, " value"]
Row = TypeVar("Row")


@dataclass(frozen=True)
class CalibrationTruth:
    """True values of a simulated machine at one time of its clock, for the figures only."""

    gain: Float[np.ndarray, " joint"]
    """Torque per current (joint,) [N·m/A]."""
    encoder_offset: Float[np.ndarray, " joint"]
    """True encoder offset of each joint [rad]."""
    lean: Float[np.ndarray, " 2"]
    """Lean of the base, forward and left [rad]."""
    friction: Mapping[str, Float[np.ndarray, " joint"]]
    """Friction parameters by the names of `Friction`'s fields."""


Interval = tuple[float, float]
"""Ends of a 95 % interval."""


@dataclass(frozen=True)
class JointEstimate:
    """Estimated value of a joint."""

    joint: str
    true: float | None = field(metadata=OPTIONAL)
    estimate: float
    ci95: Interval


@dataclass(frozen=True)
class LeanEstimate:
    """Estimated lean of the base in one direction."""

    lean: str
    true: float | None = field(metadata=OPTIONAL)
    estimate: float
    ci95: Interval


@dataclass(frozen=True)
class JointFriction:
    """Estimated friction of a joint."""

    joint: str
    coulomb_Nm: float
    coulomb_Nm_ci95: Interval
    coulomb_Nm_true: float | None = field(metadata=OPTIONAL)
    viscous: float
    viscous_ci95: Interval
    viscous_true: float | None = field(metadata=OPTIONAL)
    breakaway: float
    breakaway_ci95: Interval
    breakaway_true: float | None = field(metadata=OPTIONAL)
    load_share: float
    load_share_ci95: Interval
    load_share_true: float | None = field(metadata=OPTIONAL)
    asymmetry_Nm: float
    asymmetry_Nm_ci95: Interval
    asymmetry_Nm_true: float | None = field(metadata=OPTIONAL)
    v_stribeck_rad_per_s: float
    v_stribeck_rad_per_s_ci95: Interval
    v_stribeck_rad_per_s_true: float | None = field(metadata=OPTIONAL)


@dataclass(frozen=True)
class LinkEstimate:
    """Estimated inertial parameters of the link that a joint moves."""

    joint: str
    mass_kg: float
    first_moment_kgm: list[float]
    sd: list[float]


@dataclass(frozen=True)
class CalibrationFigures:
    """Gains, friction, encoders, links, base and the residual torque."""

    joints: tuple[str, ...]
    gain: list[JointEstimate]
    friction: list[JointFriction]
    encoder_offset_deg: list[JointEstimate]
    tilt_deg: list[LeanEstimate]
    links: list[LinkEstimate]
    rotor_inertia_kgm2: list[float]
    residual_sd_Nm: list[float]


def calibration_figures(
    calibration: Calibration, joints: tuple[str, ...], truth: CalibrationTruth | None = None
) -> CalibrationFigures:
    """Figures of a calibration.

    Args:
        calibration: Result of the calibration.
        joints: Names of the joints.
        truth: True values of a simulated machine, shown beside the estimates.
    """
    machine, gains = calibration.machine, calibration.machine.actuators
    tilt = np.rad2deg(np.arcsin(calibration.tilt)), np.rad2deg(calibration.tilt_sd)
    offset = np.rad2deg(calibration.offset), np.rad2deg(calibration.offset_sd)
    true_gain = None if truth is None else truth.gain
    true_offset = None if truth is None else np.rad2deg(truth.encoder_offset)
    true_lean = None if truth is None else np.rad2deg(truth.lean)
    return CalibrationFigures(
        joints=joints,
        gain=_estimates(JointEstimate, joints, gains.gain, gains.gain_sd, true_gain),
        friction=[_friction(calibration, j, joint, truth) for j, joint in enumerate(joints)],
        encoder_offset_deg=_estimates(JointEstimate, joints, *offset, true_offset),
        tilt_deg=_estimates(LeanEstimate, ("forward", "left"), *tilt, true_lean),
        links=[
            LinkEstimate(joint, _short(phi[0]), _list(phi[1:4]), _list(sd[:4]))
            for joint, phi, sd in zip(joints, machine.phi, calibration.phi_sd, strict=True)
        ],
        rotor_inertia_kgm2=_list(machine.rotor_inertia),
        residual_sd_Nm=_list(machine.residual_sd),
    )


def warnings(calibration: Calibration, description: RigDescription) -> list[str]:
    """Warnings for the operator that do not invalidate the calibration."""
    gains, found = calibration.machine.actuators, []
    for j, joint in enumerate(description.joints):
        sd, off = gains.gain_sd[j] / gains.gain[j], gains.gain[j] / description.nominal_gain[j] - 1.0
        if sd > GAIN_SD_SURE:
            found.append(
                f"The gain of '{joint}' is only known to ±{1.96 * sd:.0%}: no weight loads this joint in the sweeps of "
                "rig.toml. Add a sweep in which a weight loads it, if such a posture exists."
            )
        if abs(off) > GAIN_UNUSUAL:
            found.append(
                f"The gain of '{joint}' differs by {off:+.0%} from rig.toml. Check motor, gear and the unit of current."
            )
        if abs(calibration.offset[j]) > OFFSET_UNUSUAL:
            offset = np.rad2deg(calibration.offset[j])
            found.append(
                f"The encoder of '{joint}' seems to be off by {offset:+.1f}°. Set its zero at the jig or the stop."
            )
    return found


def twin_warnings(calibration: Calibration, description: RigDescription, known: EmptyPrior) -> list[str]:
    """Name the joints whose gain contradicts the twin that was the prior (`known`) of the calibration."""
    place = known.layout.of("inverse_gain")
    before, sd = known.mean[place], np.sqrt(np.diag(known.covariance)[place])
    away = np.abs(description.nominal_gain / calibration.machine.actuators.gain - before) / sd
    joints = [joint for joint, far in zip(description.joints, away, strict=True) if far > TWIN_SURPRISE_SD]
    if not joints:
        return []
    return [
        f"The gain of {', '.join(joints)} contradicts the twin by up to {away.max():.0f} standard deviations: the twin "
        "is of another machine, or a motor, gear or unit has changed. All intervals are in doubt. Calibrate without "
        "--prior twin, or record and fit the twin again."
    ]


def _estimates(
    kind: Callable[[str, float | None, float, Interval], Row],
    names: tuple[str, ...],
    value: Values,
    sd: Values,
    truth: Values | None,
) -> list[Row]:
    return [
        kind(name, None if truth is None else _short(truth[j]), _short(value[j]), _interval(value[j], sd[j]))
        for j, name in enumerate(names)
    ]


def _friction(calibration: Calibration, j: int, joint: str, truth: CalibrationTruth | None) -> JointFriction:
    value, sd = calibration.machine.friction, calibration.machine.friction_sd
    row: list[Any] = []
    for name in ("coulomb", "viscous", "breakaway", "load_share", "asymmetry", "v_stribeck"):
        found = getattr(value, name)[j]
        true = None if truth is None or name not in truth.friction else _short(truth.friction[name][j])
        row += [_short(found), _interval(found, getattr(sd, name)[j]), true]
    return JointFriction(joint, *row)


def _interval(value: float, sd: float) -> Interval:
    return _short(value - 1.96 * sd), _short(value + 1.96 * sd)


def _list(values: Values) -> list[float]:
    return [_short(value) for value in values]


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
