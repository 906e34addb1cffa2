"""Result of a test of support, for the figure and for `exograv run support-level --json`."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SupportCurve:
    """Share of the targets that is reached, by support."""

    support_percent: np.ndarray
    share: np.ndarray
    low: np.ndarray
    high: np.ndarray
    """Ends of the 95 % band."""
    by_target: np.ndarray
    """Share by target and support (target, support)."""


@dataclass(frozen=True)
class TargetSupport:
    """Median support that one target needs."""

    outward_deg: float
    up_deg: float
    share_of_length: float
    support_percent: float


@dataclass(frozen=True)
class SupportAttempt:
    """Attempt at one target."""

    target: int
    support_percent: float
    reached: bool


@dataclass(frozen=True)
class SupportOutcome:
    """Smallest support with which a person reaches most targets."""

    support_percent: float | None
    """Smallest support; None if even the support of the whole weight is not enough."""
    ci95: list[float]
    reached: int
    targets: int
    criterion: float
    tolerance_m: float
    not_enough_probability: float
    attempts: int
    text: str
    curve: SupportCurve
    by_target: list[TargetSupport]
    tried: list[SupportAttempt]
