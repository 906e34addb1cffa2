"""Rows of a run's results for printing, recording and comparison."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.dynamics import parameters
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.identifiability import identifiability
from exograv.identification.core.interface import Estimate
from exograv.model.arm import Arm, Limb
from exograv.model.assembly import Assembly
from exograv.procedures.weighing.weight_estimator import Weighing
from exograv.recording.rounding import rounded
from exograv.rig.twin import Machine, Wearer
from exograv.rig.twin.twin import WARM_UP_TIME
from exograv.rig.twin.wearer.parameter_truth import parameter_truth

from .truth_score import TruthScore

Interval = list[float]
"""Ends of a 95 % interval."""


@dataclass(frozen=True)
class ScoredParameter:
    """Estimate of one parameter of the arm, beside truth and prior."""

    name: str
    unit: str
    truth: float
    prior: float
    estimate: float
    ci95: Interval | None
    """Absent if the method has no uncertainty."""


@dataclass(frozen=True)
class CalibrationRow:
    """Calibrated parameter of one joint, beside the truth."""

    joint: str
    name: str
    unit: str
    truth: float
    estimate: float
    ci95: Interval


@dataclass(frozen=True)
class WeightRow:
    """Estimate of a known weight on the arm, beside the truth."""

    true_kg: float
    estimated_kg: float
    ci95_kg: Interval

    @classmethod
    def of(cls, true_kg: float, found: Weighing) -> "WeightRow":
        """Round the figures of one weighing."""
        return cls(true_kg, round(found.mass, 4), rounded(np.array(found.ci95)))


@dataclass(frozen=True)
class BaseParameterRow:
    """Combination of parameters that the motion determined."""

    combination: dict[str, float]
    """Weight of each parameter [-]."""
    unit: str
    estimate: float
    ci95: Interval


@dataclass(frozen=True)
class IdentifiabilityResult:
    """Parameters that the motion determined, and those that stayed at their prior."""

    learnable: int
    condition_number: float | None
    base_parameters: list[BaseParameterRow]
    by_data: tuple[str, ...]
    by_prior: tuple[str, ...]
    confused: list[tuple[str, str, float]]
    """Pairs of parameters with the correlation of their errors [-]."""


def parameter_rows(assembly: Assembly, prior: np.ndarray, estimate: Estimate, wearer: Wearer) -> list[ScoredParameter]:
    """List all parameters of the arm that slow motion can show."""
    truth = parameter_truth(wearer)
    rows = []
    layout, arm = parameters.ParameterLayout.of(assembly), assembly.arm
    for i, (name, unit) in enumerate(parameters.names_and_units(assembly)):
        # Moments of inertia keep the table's values, because slow motion does not show them.
        if name not in truth or ".I" in name:
            continue
        learned = i < layout.phi.stop or (estimate.covariance is not None and estimate.sd[i] > 0.0)
        if learned:
            rows.append(_row(name, unit, truth[name], float(prior[i]), estimate, np.eye(len(prior))[i]))
    return [*(_mass_row(limb, layout, arm, truth, prior, estimate) for limb in arm.limbs), *rows]


def _mass_row(
    limb: Limb,
    layout: parameters.ParameterLayout,
    arm: Arm,
    truth: Mapping[str, float],
    prior: np.ndarray,
    estimate: Estimate,
) -> ScoredParameter:
    """Row of the mass of a whole arm."""
    segments = [limb.prefix + name for name in limb.bodies]
    masses = np.zeros(len(prior))
    masses[[layout.bodies[arm.segments.index(name)].start for name in segments]] = 1.0
    total = sum(truth[f"{name}.mass"] for name in segments)
    return _row(f"{limb.prefix}arm.mass", "kg", total, float(masses @ prior), estimate, masses)


def _row(name: str, unit: str, truth: float, prior: float, estimate: Estimate, weights: np.ndarray) -> ScoredParameter:
    value = float(weights @ estimate.x)
    interval = None
    if estimate.covariance is not None:
        interval = _interval(value, float(np.sqrt(weights @ estimate.covariance @ weights)))
    return ScoredParameter(name, unit, round(truth, 5), round(prior, 5), round(value, 5), interval)


def _interval(value: float, sd: float) -> Interval:
    return [round(float(value + sign * 1.96 * sd), 5) for sign in (-1, 1)]


def identifiability_rows(
    assembly: Assembly, prior: Float[np.ndarray, "parameter parameter"], estimate: Estimate
) -> IdentifiabilityResult | None:
    """List how far data and prior determined each parameter; None if the method states no uncertainty."""
    if estimate.covariance is None:
        return None
    units = dict(parameters.names_and_units(assembly))
    found = identifiability(list(units), prior, estimate.covariance, estimate.x)
    return IdentifiabilityResult(
        learnable=found.learned,
        condition_number=round(found.condition, 1) if found.base else None,
        base_parameters=[
            BaseParameterRow(
                {name: round(weight, 4) for name, weight in base.weights.items()},
                units[next(iter(base.weights))],
                round(base.value, 5),
                _interval(base.value, base.sd),
            )
            for base in found.base
        ],
        by_data=found.by_data,
        by_prior=found.by_prior,
        confused=[(first, second, round(value, 3)) for first, second, value in found.confused],
    )


def calibration_rows(
    machine: CalibratedMachine, truth: Machine, t: float, joints: tuple[str, ...]
) -> list[CalibrationRow]:
    """List the calibrated values beside the true ones of the twin at time `t` of its clock [s]."""
    friction, sd, still = machine.friction, machine.friction_sd, still_to_rub(truth, t)
    gains, rub = machine.actuators, truth.friction
    columns = (
        ("gain", "N·m/A", _floats(truth.drives.gain, gains.gain, gains.gain_sd)),
        ("coulomb", "N·m", _floats(still * rub.coulomb, friction.coulomb, sd.coulomb)),
        ("viscous", "N·m·s/rad", _floats(still * rub.viscous, friction.viscous, sd.viscous)),
    )
    return [
        CalibrationRow(joint, name, unit, round(true[j], 5), round(value[j], 5), _interval(value[j], spread[j]))
        for j, joint in enumerate(joints)
        for name, unit, (true, value, spread) in columns
    ]


def _floats(*columns: Any) -> list[list[float]]:
    return [[float(value) for value in column] for column in columns]


def still_to_rub(truth: Machine, t: float) -> Float[np.ndarray, " joint"]:
    """Share of the cold machine's friction that remains after `t` seconds (joint,) [-]."""
    return 1.0 - truth.friction.warm_up * (1.0 - np.exp(-t / WARM_UP_TIME))


def time_to_target(scores: Mapping[float, TruthScore], targets: Sequence[float]) -> float | None:
    """Time of motion [s] until the true residual torque stays below every joint's target to the end; None if never."""
    reached = None
    for t in sorted(scores):
        if np.all(scores[t].total <= targets):
            reached = t if reached is None else reached
        else:
            reached = None
    return None if reached is None else round(reached, 2)
