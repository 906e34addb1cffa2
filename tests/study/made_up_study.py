"""Study without participants, as tidy tables. The deviations follow a law that each test can state."""

from collections.abc import Callable, Mapping

import numpy as np

from exograv.study.dataset.tables import Tables, frame
from exograv.study.folder.columns import PARTICIPANTS, SESSIONS, TOUCHES, WINDOWS
from exograv.study.folder.settings import AS_PUBLISHED, StudySettings
from exograv.study.measures.selecting import keys as keys_of
from exograv.study.measures.study_data import StudyData
from exograv.study.measures.table import SESSION, measures_of
from exograv.study.measures.traces import TIMES_S, TRACES

PITCH_MM = 0.25
PROTOCOLS = {"trained": {"training": 3, "flight": 1}, "untrained": {"familiarisation": 2, "flight": 1}}
"""Sessions by group and protocol."""

Law = Callable[[str, str, int, int, int, np.random.Generator], tuple[float, float]]
"""Deviation right and down [px] by group, protocol, session, window and number of the touch in it, from 0."""


def shrinking(group: str, protocol: str, session: int, window: int, k: int, rng: np.random.Generator):
    """Return scatter about the target, which trained people reduce from session to session."""
    size = 40.0 if (group, protocol) == ("trained", "flight") else 100.0 * 0.8 ** (session - 1)
    x, y = size * rng.normal(size=2)
    return float(x), float(y)


def made_up_study(
    people: Mapping[str, int] | None = None,
    protocols: Mapping[str, Mapping[str, int]] = PROTOCOLS,
    windows: int = 4,
    touches: int = 8,
    law: Law = shrinking,
    pitch_mm: float | None = PITCH_MM,
    is_sealed: bool = False,
    is_simulated: bool = True,
    rest_s: Callable[[int], float] = lambda window: 158.0,
) -> Tables:
    """Return tables with people per group, each with these sessions; a rest of `rest_s` follows each window."""
    rng = np.random.default_rng(1001)
    rows: dict[str, list[dict]] = {name: [] for name in ("touches", "windows", "sessions", "participants")}
    for group, n in (people or {"trained": 3, "untrained": 3}).items():
        for person in range(n):
            code = f"{group[0].upper()}{person + 1}QX"
            rows["participants"].append({"participant": code, "group": None if is_sealed else group})
            for protocol, sessions in protocols[group].items():
                for session in range(1, sessions + 1):
                    key = {"participant": code, "protocol": protocol, "session": session}
                    opened = 60.0
                    for window in range(1, windows + 1):
                        rows["windows"].append(_window(key, window, opened, touches, protocol))
                        for k in range(touches):
                            x, y = law(group, protocol, session, window, k, rng)
                            rows["touches"].append(_touch(key, window, k, opened, (x, y), pitch_mm, touches))
                        opened += 22.0 + rest_s(window)
                    rows["sessions"].append(_session(key, windows, touches, pitch_mm, is_simulated, opened))
    return Tables(
        frame(TOUCHES, rows["touches"]),
        frame(WINDOWS, rows["windows"]),
        frame(SESSIONS, rows["sessions"]),
        frame(PARTICIPANTS, rows["participants"]),
    )


def study_data(tables: Tables, settings: StudySettings = AS_PUBLISHED) -> StudyData:
    """Return a study with measures and traces: level 0 in windows, 1 outside, and joints that move in windows only."""
    keys = [dict(zip(SESSION, key, strict=True)) for key in keys_of(tables.sessions, SESSION)]
    inside = (TIMES_S >= 0.0) & (TIMES_S <= 22.0)
    moments = [
        (float(t), 0.0 if is_in else 1.0, 1.5 if is_in else 0.0) for t, is_in in zip(TIMES_S, inside, strict=True)
    ]
    traces = [
        {**key, "t_s": t, "felt_level": level, "joint_speed_rad_per_s": speed}
        for key in keys
        for t, level, speed in moments
    ]
    return StudyData(settings, tables, measures_of(tables), frame(TRACES, traces))


def _window(key: dict, window: int, opened: float, touches: int, protocol: str) -> dict:
    return {
        **key, "window": window, "attempt": 1, "opened_s": opened, "closed_s": opened + 22.0, "closed_by": "clock",
        "opened_by": "aircraft" if protocol == "flight" else "clock", "is_complete": True, "marks": "",
        "gravity_level": 1.0 if protocol == "familiarisation" else 0.0, "touches": touches, "rejected": 0,
    }  # fmt: skip


def _touch(
    key: dict, window: int, k: int, opened: float, off: tuple[float, float], pitch: float | None, touches: int
) -> dict:
    x, y = off
    mm = {} if pitch is None else {
        "deviation_x_mm": pitch * x, "deviation_y_mm": pitch * y, "deviation_mm": pitch * float(np.hypot(x, y))
    }  # fmt: skip
    return {
        **key, **mm, "window": window, "attempt": 1, "sequence": window * touches + k, "page": "a",
        "t_s": opened + 22.0 * (k + 1) / (touches + 1), "is_accepted": True, "x_px": 960 + x, "y_px": 540 + y,
        "deviation_x_px": x, "deviation_y_px": y, "deviation_px": float(np.hypot(x, y)), "contact_px": 30.0,
        "interval_s": 22.0 / (touches + 1), "pace": "right", "gravity_level": 0.0,
    }  # fmt: skip


def _session(key: dict, windows: int, touches: int, pitch: float | None, is_simulated: bool, duration_s: float) -> dict:
    code, protocol, session = key.values()
    return {
        **key, "source": f"sourcedata/{code}/{protocol}-{session:02d}/{code}.csv", "sha256": "0" * 64, "kind": "csv",
        "is_simulated": is_simulated, "is_complete": True, "duration_s": duration_s, "pitch_x_mm": pitch,
        "pitch_y_mm": pitch, "windows_planned": windows, "windows_complete": windows, "touches": windows * touches,
        "rejected": 0, "ticks": 0, "clock_jumps": 0, "stops": 0, "software": "exograv 0.1.0; code 8a5c65d3",
        "exo": "active" if protocol == "training" else "passive", "protocol_sha256": "e0" * 32,
        "calibration_sha256": "ca" * 32,
    }  # fmt: skip
