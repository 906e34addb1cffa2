"""Columns of a CSV log: by name from its header, by the user's choice, or in the usual order."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from exograv.errors import RecordingError

NAMES = {
    "time": ("t", "time", "times", "timestamp", "time_s", "sec"),
    "positions": ("q", "position", "pos", "actual_q", "q_actual", "q_measured", "joint_position"),
    "velocities": ("v", "qd", "dq", "velocity", "vel", "actual_qd", "qd_actual", "joint_velocity"),
    "currents": ("i", "current", "actual_current", "motor_current", "joint_current"),
    "torques": ("tau", "torque", "effort", "tau_measured", "actual_torque", "measured_torque", "joint_torque"),
}
"""Usual names of columns, without the number or name of the joint."""

USUAL = "time [s], positions [rad], velocities [rad/s] and currents [A] or torques [N·m], one each per joint"


@dataclass(frozen=True)
class Columns:
    """Places of the needed columns, counted from 0."""

    places: tuple[int, ...]
    """Time, then positions, velocities and efforts of all joints."""


def usual_columns(joints: int) -> Columns:
    """Time, positions, velocities and efforts, in this order from the first column on."""
    return Columns(tuple(range(1 + 3 * joints)))


def chosen_columns(choice: str, header: Sequence[str] | None, joints: Sequence[str], path: Path) -> Columns:
    """Columns that the user chose.

    Args:
        choice: Four words for time, positions, velocities and efforts, separated by commas. A number is the first
            column of a group, counted from 1. A name may contain `*`: the name of the joint, or its number from 0 or 1.
        header: Names of the columns; None if the log has no header.
        joints: Names of the joints.
        path: Path of the log, for messages.

    Raises:
        RecordingError: The choice has another form, or names columns that the log does not have.
    """
    words = [word.strip() for word in choice.split(",")]
    if len(words) != 4:
        raise RecordingError(
            f"--columns is '{choice}'; give four words for time, positions, velocities and efforts, as 1,2,8,14 for "
            "their first columns, or t,q*,v*,i* for the names of a header."
        )
    places: list[int] = []
    for word, count in zip(words, (1, *[len(joints)] * 3), strict=True):
        if word.isdecimal() and int(word) > 0:
            places += range(int(word) - 1, int(word) - 1 + count)
            continue
        found = None if header is None else named_columns(header, (word,), joints if count > 1 or "*" in word else None)
        if found is None:
            there = "it has no header" if header is None else f"columns there: {', '.join(header)}"
            raise RecordingError(f"{path}: no columns '{word}' for {count} joints; {there}.")
        places += found
    return Columns(tuple(places))


def header_columns(header: Sequence[str], joints: Sequence[str], is_torque: bool) -> Columns | None:
    """Columns by the usual names of a header; None if the header does not name all of them."""
    efforts = NAMES["torques" if is_torque else "currents"]
    groups = [named_columns(header, NAMES["time"], None)]
    groups += [named_columns(header, names, joints) for names in (NAMES["positions"], NAMES["velocities"], efforts)]
    if any(group is None for group in groups):
        return None
    return Columns(tuple(place for group in groups if group is not None for place in group))


def named_columns(header: Sequence[str], stems: Sequence[str], joints: Sequence[str] | None) -> list[int] | None:
    """Return the places of the columns with one of these stems, one per joint; of one column if `joints` is None."""
    plain = [_plain(name) for name in header]
    for stem in stems:
        if joints is None:
            if _plain(stem) in plain:
                return [plain.index(_plain(stem))]
            continue
        for endings in (joints, range(len(joints)), range(1, len(joints) + 1)):
            wanted = [_plain(_joined(stem, str(ending))) for ending in endings]
            if all(name in plain for name in wanted):
                return [plain.index(name) for name in wanted]
    return None


def _joined(stem: str, ending: str) -> str:
    return stem.replace("*", ending) if "*" in stem else stem + ending


def _plain(name: str) -> str:
    """Return a name without units, spaces, underscores and brackets, in small letters."""
    without_unit = re.sub(r"\s*[\[(][^\d\])]*[\])]\s*$", "", name.strip())
    return re.sub(r"[\s_.\-\[\]()/]", "", without_unit).lower()
