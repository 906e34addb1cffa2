"""Tuning of a method for a payload on the unloaded log with a virtual trial load; the loaded log is not used."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from exograv.identification.baselines.descent import Descent
from exograv.identification.baselines.gradient_prior import GradientPrior
from exograv.identification.core.interface import Method, Sample
from exograv.identification.core.setting import Setting
from exograv.identification.methods import CANDIDATES, built
from exograv.model.tree import inertial_parameters

from .payload import MASS_SD, PAYLOAD, PayloadModel

TRIAL_LOAD = inertial_parameters(MASS_SD, np.full(3, 0.1), 0.02 * np.eye(3))
"""Virtual payload of the rehearsal: mass as the prior expects, centre 0.1 m from the frame along each axis."""

SHARES_OF_STABLE = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002)
"""Candidate steps, as shares of the largest stable step for the trial load [-]."""

FOUND = 0.1  # share of the trial load's mass within which it counts as found
LOOK_PERIOD_S = 0.1

Tuning = Mapping[str, float]


def rehearsed(name: str, setting: Setting, unloaded: list[Sample], progress: Callable[[float], None]) -> Tuning:
    """Tuning, of at most nine candidates, that finds a trial load soonest on the unloaded log.

    The torque of the trial load is added to the measured torque. The rehearsal therefore has this robot's motion, noise
    and model error, and the loaded log stays unseen. The tuning is empty for a method without candidates.

    Args:
        name: Name of a method in `methods.BUILDERS`.
        setting: Setting of the payload on its `PayloadModel`.
        unloaded: Samples of the log without load.
        progress: Function that receives the finished share [-].
    """
    rehearsal = with_trial_load(setting, unloaded)
    candidates = _candidates(name, setting, rehearsal)
    if len(candidates) == 1:
        return candidates[0]
    best: tuple[tuple[float, float], Tuning] | None = None
    for i, tuning in enumerate(candidates):
        progress(i / len(candidates))
        with np.errstate(over="ignore", invalid="ignore"):
            result = found_after(built(name, setting, tuning), rehearsal)
        if best is None or result < best[0]:
            best = result, tuning
    return MappingProxyType({}) if best is None else best[1]


def with_trial_load(setting: Setting, unloaded: Iterable[Sample]) -> list[Sample]:
    """Unloaded log with the torque of the trial load added."""
    model: PayloadModel = setting.model  # pyright: ignore[reportAssignmentType] - by contract
    loaded, bare = setting.mean.copy(), setting.mean.copy()
    loaded[PAYLOAD], bare[PAYLOAD] = TRIAL_LOAD, 0.0
    rehearsal = []
    for s in unloaded:
        added = model.linearise(s, loaded)[0].copy() - model.linearise(s, bare)[0]
        rehearsal.append(Sample(s.t, s.q, s.v, s.a, s.tau + added))
    return rehearsal


def found_after(method: Method, rehearsal: list[Sample]) -> tuple[float, float]:
    """Time after which the trial load's mass stays found [s], infinite if never; and the final error, for ties.

    An offline method is evaluated only at the end.
    """
    found_t, error, look_t = np.inf, np.inf, rehearsal[0].t
    asked_late = getattr(method, "offline", False)
    for sample in rehearsal:
        method.update(sample)
        if sample is not rehearsal[-1] and (asked_late or sample.t < look_t):
            continue
        look_t = sample.t + LOOK_PERIOD_S
        error = abs(method.estimate().x[0] / MASS_SD - 1.0)
        if not error <= FOUND:
            found_t = np.inf
        elif not np.isfinite(found_t):
            found_t = sample.t
    return found_t, error if np.isfinite(error) else np.inf


def _candidates(name: str, setting: Setting, rehearsal: list[Sample]) -> tuple[Tuning, ...]:
    """Candidates of the arm; step lengths depend on the robot and are shares of the largest stable one instead."""
    if name == "least-squares":
        # A ridge above one would pull a light payload towards nothing. A payload is far from its start in log-Cholesky
        # coordinates, along a curved valley: the search of the arm stopped at 1.0 kg of 2.8 kg.
        return (MappingProxyType({"ridge": 1.0, "settled": 1e-7, "steps_max": 100.0}),)
    mean = setting.mean.copy()
    mean[PAYLOAD] = TRIAL_LOAD
    loaded = replace(setting, mean=mean)
    if name == "gradient-full":
        descent = Descent(loaded)
        curvature = max(_largest(descent, sample) for sample in rehearsal)
    elif name == "gradient-prior":
        descent = GradientPrior(loaded)
        curvature = max(descent.curvature_at(sample) for sample in rehearsal)
    else:
        return CANDIDATES.get(name, ())
    return tuple({"step": 2.0 / curvature * share} for share in SHARES_OF_STABLE)


def _largest(descent: Descent, sample: Sample) -> float:
    """Largest eigenvalue of the squared error's Gauss–Newton Hessian [(N·m)²]."""
    _, derivative = descent.error(sample)
    return float(np.linalg.eigvalsh(derivative @ derivative.T)[-1])
