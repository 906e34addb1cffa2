"""Touches of people with given differences, as tidy tables."""

import numpy as np
import pandas as pd

from exograv.study.dataset.tables import frame
from exograv.study.folder.columns import PARTICIPANTS, TOUCHES

GROUPS = ("trained", "untrained")


def made_up_touches(
    people: tuple[int, int] = (3, 3),
    log_difference: float = -0.7,
    person_sd: float = 0.35,
    touch_sd: float = 0.6,
    windows: int = 5,
    touches: int = 8,
    seed: int = 1000,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return tables of touches and participants: T1, T2 … trained, U1, U2 … untrained with a median of 100 px."""
    rng = np.random.default_rng(seed)
    rows, persons = [], []
    for group, n in zip(GROUPS, people, strict=True):
        for k in range(n):
            code = f"{group[0].upper()}{k + 1}"
            persons.append({"participant": code, "group": group})
            own = np.log(100.0) + (log_difference if group == GROUPS[0] else 0.0) + person_sd * rng.normal()
            for window in range(1, windows + 1):
                deviations = np.exp(own + touch_sd * rng.normal(size=touches)).tolist()
                rows += [touch_row(code, window, touch, value) for touch, value in enumerate(deviations)]
    return frame(TOUCHES, rows), frame(PARTICIPANTS, persons)


def touch_row(code: str, window: int | None, touch: int, deviation: float, **other) -> dict:
    """Return one accepted touch, right of the target."""
    return {
        "participant": code, "protocol": "flight", "session": 1, "window": window, "attempt": 1,
        "sequence": 100 * (window or 0) + touch, "page": "a", "t_s": 180.0 * (window or 0) + 2.75 * touch,
        "is_accepted": True, "x_px": 960.0 + deviation, "y_px": 540.0, "deviation_x_px": deviation,
        "deviation_y_px": 0.0, "deviation_px": deviation, "deviation_mm": 0.25 * deviation, **other,
    }  # fmt: skip
