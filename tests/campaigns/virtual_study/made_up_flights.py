"""Invented flights without any simulation: errors follow a law that each test can state."""

from collections.abc import Mapping

import numpy as np

from exograv.campaigns.virtual_study.flight import FAMILIARISED, FlownTouch, Group, VirtualFlight

PITCH_MM = 0.277
ERRORS_MM = {1: 24.0, 2: 31.0, 3: 40.0, 4: 28.0, 5: 35.0, 6: 22.0}
"""First error after familiarisation, by person [mm]."""


def touch(window: int, number: int, up_mm: float, right_mm: float = 0.0) -> FlownTouch:
    mm = float(np.hypot(right_mm, up_mm))
    return FlownTouch(window, number, right_mm, up_mm, mm / PITCH_MM, mm)


def flight(
    person: int,
    condition: str,
    share: float = 1.0,
    group: Group = "comparison",
    error_mm: float | None = None,
    left_over_Nm: float | None = None,
    friction_Nm: float | None = None,
    sessions: int = 4,
    windows: tuple[int, ...] = (1, 2, 3),
) -> VirtualFlight:
    """Flight with five touches per window: `share` of the person's error in the first, half of it in each next one."""
    error = share * (ERRORS_MM[person] if error_mm is None else error_mm)
    touches = tuple(touch(w, k, error * 0.5 ** (w - 1)) for w in windows for k in range(1, 6))
    return VirtualFlight(person, condition, group, sessions, left_over_Nm, friction_Nm, touches)


def comparison(shares: Mapping[str, float], people: int = 4, **other) -> list[VirtualFlight]:
    """Flights of all people familiarised, and after each training with its share of the error left."""
    return [
        flight(person, name, share, **other)
        for person in range(1, people + 1)
        for name, share in {FAMILIARISED: 1.0, **shares}.items()
    ]


def main_study(people: int = 3, share: float = 0.4) -> list[VirtualFlight]:
    """Flights of trained people 1, 2 … and of untrained people after them."""
    trained = [flight(k, "dam", share, "trained", sessions=16) for k in range(1, people + 1)]
    return trained + [flight(k + people, FAMILIARISED, 1.0, "untrained") for k in range(1, people + 1)]
