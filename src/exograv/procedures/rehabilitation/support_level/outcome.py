"""Figures of a support-level test, the same for a virtual and a recorded person."""

import numpy as np

from exograv.report.figures.support_data import SupportAttempt, SupportCurve, SupportOutcome, TargetSupport

from .search import CRITERION, SUPPORTS, NeededSupport
from .targets import TARGETS, TOLERANCE_M
from .threshold import THRESHOLDS

SHOWN = np.linspace(0.0, 1.0, 21)
"""Supports of the curve and of the maps [share of the weight]."""

BEYOND_MAX = 0.5
"""Probability above which the needed support exceeds full support, so that no percentage is given [-]."""


def figures(needed: NeededSupport, tried: list[tuple[int, float, bool]], reached: int | None) -> SupportOutcome:
    """Summarize a test.

    Args:
        needed: Estimated needed support.
        tried: Target, support [share of the weight] and True if it was reached, for all attempts.
        reached: Number of targets reached if all were tried with the estimated support; None if they were not.
    """
    posterior = needed.posterior
    middle, low, high = needed.ci
    beyond = needed.beyond
    share = posterior.share(SHOWN)
    of_all = share.mean(axis=1)
    own = np.clip(np.median(posterior.thresholds, axis=0), THRESHOLDS[0], THRESHOLDS[-1])
    at = share.mean(axis=0)[:, int(np.argmin(np.abs(SHOWN - middle)))]
    return SupportOutcome(
        support_percent=None if beyond > BEYOND_MAX else round(100.0 * middle, 1),
        ci95=[round(100.0 * low, 1), round(100.0 * high, 1)],
        reached=int(np.count_nonzero(at >= 0.5)) if reached is None else reached,
        targets=len(TARGETS),
        criterion=CRITERION,
        tolerance_m=TOLERANCE_M,
        not_enough_probability=round(beyond, 3),
        attempts=len(tried),
        text=sentence(needed),
        curve=SupportCurve(
            support_percent=(100.0 * SHOWN).round(1),
            share=of_all.mean(axis=0).round(3),
            low=np.quantile(of_all, 0.025, axis=0).round(3),
            high=np.quantile(of_all, 0.975, axis=0).round(3),
            by_target=share.mean(axis=0).round(3),
        ),
        by_target=[
            TargetSupport(target.outward_deg, target.up_deg, target.share, round(100.0 * float(own[k]), 1))
            for k, target in enumerate(TARGETS)
        ],
        tried=[SupportAttempt(target, round(100.0 * support, 1), hit) for target, support, hit in tried],
    )


def sentence(needed: NeededSupport) -> str:
    """Return the result as one sentence."""
    middle, low, high = (100.0 * value for value in needed.ci)
    goal = f"{100.0 * CRITERION:.0f} % of the targets"
    if needed.beyond > BEYOND_MAX:
        return f"Even with the whole weight of the arm carried, this person does not reach {goal}."
    if high <= 100.0 * float(SUPPORTS[1]):
        return f"This person reaches {goal} without any support."
    return (
        f"This person reaches {goal} when {middle:.0f} % of the arm's weight is carried "
        f"(95 % interval {low:.0f} to {high:.0f} %)."
    )
