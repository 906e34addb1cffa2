"""Gravity levels by name, and their rate limit."""

from typing import Literal

LevelName = Literal["weightless", "moon", "mars", "earth", "hyper"]
LEVELS: dict[LevelName, float] = {"weightless": 0.0, "moon": 0.165, "mars": 0.38, "earth": 1.0, "hyper": 1.8}
"""Share of Earth weight that is felt [-]. Moon, Mars: surface gravity 1.62 and 3.7 m/s². Pull-up: parabolas of the A310
(Pletser, doi 10.5772/intechopen.93464), which fly the Moon at 0.16."""

EARTH = LEVELS["earth"]

RATE_MAX_PER_S = 0.2
"""Rate limit of a level that a machine makes [1/s]: from 1 to 0 in five seconds (docs/explanation/safety.md)."""


def slewed(level: float, target: float, seconds: float) -> float:
    """Level after `seconds` on the way to `target`, at the rate limit."""
    way = RATE_MAX_PER_S * max(seconds, 0.0)
    return target if abs(target - level) <= way else level + (way if target > level else -way)


def slewing_s(level: float, target: float) -> float:
    """Time from `level` to `target` at the rate limit [s]."""
    return abs(target - level) / RATE_MAX_PER_S
