"""A method's own setting for a payload, found without the log that it is judged on: a rehearsal with a virtual load."""

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
"""What the rehearsal hangs on the unloaded robot: as heavy as the prior expects, a hand's breadth off the frame."""

SHARES_OF_STABLE = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002)
"""Steps that are rehearsed, in shares of the largest that is stable for the trial load [-]."""

FOUND = 0.1  # share of the trial load's mass within which it counts as found
LOOK_PERIOD_S = 0.1

Tuning = Mapping[str, float]


def rehearsed(name: str, setting: Setting, unloaded: list[Sample], progress: Callable[[float], None]) -> Tuning:
    """The setting among at most nine that finds a trial load soonest on the unloaded log.

    The trial load's torque is added to the measured one, so the rehearsal has this robot's motion, noise and model
    error, and the loaded log stays unseen: as good a setting as can be had honestly. Empty for a method without one.

    Args:
        name: Of a method in `methods.BUILDERS`.
        setting: Of the payload on its `PayloadModel`.
        unloaded: Samples of the log without load.
        progress: Told the share that is done.
    """
    rehearsal = with_trial_load(setting, unloaded)
    candidates = _candidates(name, setting, rehearsal)
    best: tuple[tuple[float, float], Tuning] | None = None
    for i, tuning in enumerate(candidates):
        progress(i / len(candidates))
        with np.errstate(over="ignore", invalid="ignore"):
            result = found_after(built(name, setting, tuning), rehearsal)
        if best is None or result < best[0]:
            best = result, tuning
    return MappingProxyType({}) if best is None else best[1]


def with_trial_load(setting: Setting, unloaded: Iterable[Sample]) -> list[Sample]:
    """The unloaded log as if the trial load had hung there."""
    model: PayloadModel = setting.model  # pyright: ignore[reportAssignmentType] - by contract
    loaded, bare = setting.mean.copy(), setting.mean.copy()
    loaded[PAYLOAD], bare[PAYLOAD] = TRIAL_LOAD, 0.0
    rehearsal = []
    for s in unloaded:
        added = model.linearise(s, loaded)[0].copy() - model.linearise(s, bare)[0]
        rehearsal.append(Sample(s.t, s.q, s.v, s.a, s.tau + added))
    return rehearsal


def found_after(method: Method, rehearsal: list[Sample]) -> tuple[float, float]:
    """Time until the trial load's mass stays found [s], infinite if never; and the error at the end, for ties.

    A method off line is asked at the end only.
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
    """The arm's; but a step's length depends on the robot, and is told in shares of the largest stable one."""
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
