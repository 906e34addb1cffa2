"""False-alarm rate of a CUSUM test on a residual torque with a correlated noise, and the threshold for a wanted rate.

The test adds up the residual beyond an allowance k, and never goes below zero:

    S ← max(0, S + (residual − k) · dt)

Over times longer than the correlation time the sum of the noise is a Brownian motion with variance s² per second. A
Brownian motion with drift −k and a reflecting barrier at zero needs, on average,

    T = s²/(2 k²) · (exp(y) − 1 − y),   y = 2 k h / s²

to reach h. The correlated noise is smoother than the Brownian motion and reaches h later, so T is a lower bound.

Source: Siegmund 1985, Sequential Analysis, ch. II (CUSUM); Karlin & Taylor 1981, ch. 15 (reflected Brownian motion).
"""

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]

ITERATIONS = 12
"""Newton steps. They begin above the solution of a convex equation and converge from there."""


def variance_rate(sd: Joints, correlation_s: float) -> Joints:
    """Variance per second of the time integral of an Ornstein–Uhlenbeck noise (joint,) [N²·m²·s].

    Args:
        sd: Standard deviation of the noise (joint,) [N·m].
        correlation_s: Time after which its autocorrelation is 1/e [s].
    """
    return 2.0 * sd**2 * correlation_s


def time_between_alarms(threshold: Joints, allowance: Joints, rate: Joints) -> Joints:
    """Mean time to a false alarm (joint,) [s].

    Args:
        threshold: Value h of the sum at which the test gives an alarm (joint,) [N·m·s].
        allowance: Part k of the residual that is not added up (joint,) [N·m].
        rate: Variance of the noise's time integral per second (joint,) [N²·m²·s].
    """
    y = 2.0 * allowance * threshold / rate
    return rate / (2.0 * allowance**2) * (np.expm1(y) - y)


def threshold_of(mean_s: float, allowance: Joints, rate: Joints) -> Joints:
    """Threshold (joint,) [N·m·s] of a test with this mean time to a false alarm [s]; other arguments as above."""
    wanted = 2.0 * allowance**2 * mean_s / rate
    # exp(y) − 1 − y is above y²/2, and from y = 1.26 on above half of exp(y) − 1.
    y = np.minimum(np.sqrt(2.0 * wanted), np.maximum(np.log1p(2.0 * wanted), 1.26))
    for _ in range(ITERATIONS):
        y = y - (np.expm1(y) - y - wanted) / np.expm1(y)
    return y * rate / (2.0 * allowance)
