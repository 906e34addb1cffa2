"""Made-up acceleration of a sensor in an aircraft, at the sensor's own rate and with its own axes."""

import numpy as np
from jaxtyping import Float

RATE_HZ = 100.0
CORNERS_S = (0.0, 10.0, 13.0, 30.0, 33.0, 55.0, 58.0, 75.0, 78.0, 100.0)
LEVELS = (1.0, 1.0, 1.8, 1.8, 0.0, 0.0, 1.8, 1.8, 1.0, 1.0)
OPENS_S, CLOSES_S = 33.0, 55.0
"""Times between which the aircraft is weightless."""

AXES = np.array([0.6, -0.48, 0.64])
"""Direction of the vertical in the sensor's axes."""


def acceleration(parabolas: int = 2, seed: int = 0) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """Return times [s] and acceleration [g]: noise of a MEMS sensor, and the engines' vibration of 0.15 g at 23 Hz."""
    rng, cycle = np.random.default_rng(seed), CORNERS_S[-1]
    t = np.arange(round(parabolas * cycle * RATE_HZ)) / RATE_HZ
    level = np.interp(t % cycle, CORNERS_S, LEVELS)
    shaken = 0.15 * np.sin(2.0 * np.pi * 23.0 * t)
    return t, level[:, None] * AXES + shaken[:, None] * np.array([0.0, 0.8, 0.6]) + rng.normal(0.0, 0.01, (len(t), 3))
