"""Logs of other robots (CSV, ROS recordings): read, cleaned and cut to the motion, with each loss counted."""

import csv
from array import array
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.errors import RecordingError

from .joint_states import is_ros_recording, read_joint_states
from .log_columns import USUAL, Columns, chosen_columns, header_columns, usual_columns

SHARE_OF_SPEED = 0.01
"""Speed above which a robot moves, as a share of the log's fast speed (95th percentile over its rows) [-].

A share is used because the apparent speed of an encoder's noise differs by a factor of 100 between robots.
"""

REST_S = 0.5
"""Time below that speed that ends a motion [s]; reversals of a joint are much shorter."""

SKIPPED_SHARE_MAX = 0.1
"""Largest share of skipped rows [-]; with more, the file has other columns than assumed."""

PERIOD_MAX_S = 0.2
"""Largest time between samples [s]; above it accelerations are guesses, or time is not in seconds."""


@dataclass(frozen=True)
class MotionLog:
    """Motion in a log, one row per sample and one column per joint."""

    t: Float[np.ndarray, " sample"]
    """Time on the robot's clock, strictly rising [s]."""

    q: Float[np.ndarray, "sample joint"]
    """Joint positions [rad]."""

    v: Float[np.ndarray, "sample joint"]
    """Joint velocities [rad/s]."""

    effort: Float[np.ndarray, "sample joint"]
    """Motor currents [A], or joint torques [N·m]."""

    skipped: int
    """Number of rejected rows between the first and the last used line.

    A row is rejected if it is incomplete, not numeric, or not later than the row before.
    """

    rows: tuple[int, int]
    """First and last line used, counted from 1 as in an editor."""


def read_log(
    path: Path, joints: Sequence[str], rows: str | None = None, columns: str | None = None, *, is_torque: bool = False
) -> MotionLog:
    """Read the motion of a log: time, positions, velocities, and currents or torques.

    A CSV log has the usual order of columns, unless its header names them or `columns` chooses them. A ROS recording
    (MCAP, or the folder of a ROS 2 bag) is read by the names of the joints; each message counts as a row.

    Args:
        path: The log.
        joints: Names of the robot's joints; positions, velocities and efforts have as many columns each.
        rows: Lines to use, "first:last", counted from 1; without it, the longest motion between two rests.
        columns: Choice of columns, as in `log_columns.chosen_columns`.
        is_torque: True if the efforts are torques.

    Raises:
        RecordingError: The file is missing, has other columns, too many bad rows, no running time, or no motion.
    """
    path, n_joints = Path(path), len(joints)
    lines, values, bad = _states(path, joints) if is_ros_recording(path) else _lines(path, joints, columns, is_torque)
    if rows:
        first, last = _chosen(rows, path)
        inside = (first <= lines) & (lines <= last)
        lines, values = lines[inside], values[inside]
    later = values[:, 0] > np.maximum.accumulate(np.concatenate([[-np.inf], values[:-1, 0]]))
    bad = np.concatenate([bad, lines[~later]])
    lines, values = lines[later], values[later]
    _refuse_other_clocks(path, values[:, 0], rows)
    if not rows:
        speed = np.abs(values[:, 1 + n_joints : 1 + 2 * n_joints]).max(axis=1)
        motion = _longest_motion(path, values[:, 0], speed)
        lines, values = lines[motion], values[motion]
    used = (int(lines[0]), int(lines[-1]))
    skipped = int(np.count_nonzero((used[0] <= bad) & (bad <= used[1])))
    _refuse_many_skipped(path, skipped, used, n_joints)
    return MotionLog(values[:, 0], *np.split(values[:, 1:], 3, axis=1), skipped=skipped, rows=used)


def _states(path: Path, joints: Sequence[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return message numbers and values of a ROS recording, as `_lines` does."""
    states = read_joint_states(path, joints)
    values = np.column_stack([states.t, states.q, states.v, states.effort])
    good = np.isfinite(values).all(axis=1)
    numbers = np.arange(1, len(values) + 1)
    return numbers[good], values[good], numbers[~good]


def _lines(
    path: Path, joints: Sequence[str], choice: str | None, is_torque: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return line numbers and needed columns of the good rows, and line numbers of the bad ones."""
    header, lengths = None, Counter[int]()
    for _, cells in _cells(path):
        if not lengths and not _has_number(cells):
            header = cells
        lengths[len(cells)] += 1
    columns = _columns(path, header, joints, choice, is_torque)
    needed = 1 + max(columns.places)
    usual = lengths.most_common(1)[0][0] if lengths else 0
    if usual < needed:
        raise RecordingError(f"{path} has {usual} columns; {len(joints)} joints need {needed}: {USUAL}.")
    # The file is read a second time: its texts take ten times the memory of the needed numbers.
    lines, bad, values = array("q"), array("q"), array("d")
    for line, cells in islice(_cells(path), int(header is not None), None):
        numbers = _needed(cells, columns) if len(cells) == usual else None
        (bad if numbers is None else lines).append(line)
        values.extend(numbers or ())
    return np.array(lines, int), np.array(values).reshape(-1, len(columns.places)), np.array(bad, int)


def _columns(
    path: Path, header: list[str] | None, joints: Sequence[str], choice: str | None, is_torque: bool
) -> Columns:
    if choice is not None:
        return chosen_columns(choice, header, joints, path)
    named = None if header is None else header_columns(header, joints, is_torque)
    return named or usual_columns(len(joints))


def _needed(cells: list[str], columns: Columns) -> list[float] | None:
    return _numbers([cells[place] for place in columns.places])


def _cells(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the cells of each line that is not empty."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            yield from ((line, cells) for line, cells in enumerate(csv.reader(stream), start=1) if cells)
    except OSError as error:
        raise RecordingError(f"The log {path} cannot be read: {error.strerror}. Check its path.") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"The log {path} is no CSV text: {error}. Export it as comma-separated text.") from error


def _numbers(cells: list[str]) -> list[float] | None:
    try:
        numbers = [float(cell) for cell in cells]
    except ValueError:
        return None
    return numbers if np.isfinite(numbers).all() else None


def _has_number(cells: list[str]) -> bool:
    return any(_numbers([cell]) is not None for cell in cells)


def _chosen(rows: str, path: Path) -> tuple[int, int]:
    first, _, last = rows.partition(":")
    if not (first.isdecimal() and last.isdecimal() and 1 <= int(first) < int(last)):
        raise RecordingError(f"Rows '{rows}' of {path} are invalid. Write first:last, counted from 1, as in 100:2000.")
    return int(first), int(last)


def _refuse_other_clocks(path: Path, t: np.ndarray, rows: str | None) -> None:
    if len(t) < 2:
        raise RecordingError(f"{path} has {len(t)} usable rows in {rows or 'all its lines'}. Rows must have {USUAL}.")
    period = float(np.median(np.diff(t)))
    if period > PERIOD_MAX_S:
        raise RecordingError(
            f"{path}: samples are {period:g} s apart by the first column; at most {PERIOD_MAX_S} s is allowed. "
            "That column must be time in seconds."
        )


def _refuse_many_skipped(path: Path, skipped: int, rows: tuple[int, int], n_joints: int) -> None:
    if skipped > SKIPPED_SHARE_MAX * (rows[1] - rows[0] + 1):
        raise RecordingError(
            f"{path}: {skipped} of the lines {rows[0]}–{rows[1]} are cut short, not numbers or out of time order; "
            f"allowed is one in ten. Check that the columns are {USUAL}, for {n_joints} joints."
        )


def _longest_motion(path: Path, t: np.ndarray, speed: np.ndarray) -> slice:
    """Return the longest motion between two rests, as samples: robots drive to the start before, and home after."""
    moving = np.flatnonzero(speed > SHARE_OF_SPEED * np.percentile(speed, 95))
    if len(moving) < 2:
        raise RecordingError(f"Nothing moves in {path}: all velocities are zero. Check the columns: {USUAL}.")
    # A gap in the data is not a rest: samples must show that no joint moved.
    breaks = np.flatnonzero((np.diff(t[moving]) > REST_S) & (np.diff(moving) > 1))
    first = moving[np.concatenate([[0], breaks + 1])]
    last = moving[np.concatenate([breaks, [len(moving) - 1]])]
    longest = int(np.argmax(t[last] - t[first]))
    return slice(int(first[longest]), int(last[longest]) + 1)
