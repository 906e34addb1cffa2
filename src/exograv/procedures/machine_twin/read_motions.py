"""Recordings of a machine from several sources: exograv's MCAP, CSV with named columns, ROS, LeRobot.

All are of the empty machine, but exograv's own may also hold the identification of an arm.
"""

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError, RecordingError
from exograv.identification.machine_twin.measured_motion import MeasuredMotion
from exograv.model.description import RigDescription
from exograv.procedures.calibration.empty_run import WARMTH_EVENT
from exograv.recording.joint_states import Wrenches, is_ros_recording, read_joint_states, read_wrenches
from exograv.recording.lerobot import is_lerobot, read_lerobot
from exograv.recording.reader import Recording, read_recording

from .read_csv import read_csv
from .recorded_columns import RecordedColumns, WornMotion, hung_row, no_weight, refuse_wrong_mass, torque_per_current

PERIOD_MAX_S = 0.01
"""Largest time between two ticks [s]: the sample filter has a corner of 7 Hz, and the delay is some milliseconds."""

GAP_PERIODS = 5.0
"""Time between two ticks that divides a recording, in periods [-]."""

LOWERING_S = 1.2
"""Time before the event of a weight in which it is lowered or lifted, and hangs in part [s]."""

PIECE_LEAST_S = 2.0
"""Shortest piece between two gaps that is used [s]."""

WORN = frozenset(
    {
        "take arm", "check arm", "rest", "identify", "verify", "check session", "learn in rest", "float", "lay down",
        "weigh",
    }
)  # fmt: skip
"""Phases of a recording in which an arm is in the machine; their ticks are left out."""

IDENTIFIES = "identify"
"""Phase in which the machine moves a relaxed arm to identify it."""

VIDEO = ".mp4"
"""Ending of the videos of a LeRobot dataset, which do not belong to the fitted data."""

ANGLE_MOST = 4.0 * np.pi
"""Largest range of a joint that is plausible in radians [rad]."""


@dataclass(frozen=True)
class ReadRecording:
    """Content of one recording."""

    path: Path
    motions: tuple[MeasuredMotion, ...]
    """Pieces of the empty machine without a gap; none in a recording that holds an identification of an arm only."""

    sha256: str
    is_simulated: bool
    """True if the recording states that its machine is simulated."""
    worn_s: float = 0.0
    """Time with an arm in the machine [s]. The fit of the empty machine leaves it out."""

    worn: WornMotion | None = None
    """Identification of an arm in this recording; None without one."""

    force_frame: str | None = None
    """Frame at which the recording says that its force sensor measures; None if it says nothing."""

    @property
    def seconds(self) -> float:
        """Length of all pieces [s]."""
        return sum(float(motion.t[-1] - motion.t[0]) for motion in self.motions)


def read_motions(
    description: RigDescription,
    paths: Sequence[Path],
    weights: Mapping[str, tuple[str, float]],
    *,
    is_torque: bool,
    is_degrees: bool = False,
) -> tuple[ReadRecording, ...]:
    """Read recordings of the empty machine, and identifications of an arm in them.

    Args:
        description: The machine.
        paths: The recordings.
        weights: Mount and mass [kg] of the known weight that hangs during a whole recording, by its path as given.
        is_torque: True if the efforts of ROS recordings are torques, and not currents.
        is_degrees: True if the positions of CSV files and LeRobot tables are in degrees.

    Raises:
        ConfigError: A mount is not one of the machine, or a weight is stated for a recording that is not given.
        RecordingError: A recording cannot be read, or lacks a column, or is too slow.
    """
    if not paths:
        raise ConfigError("No recording is given. Give one or more, as in `exograv twin fit RIG out/empty.mcap`.")
    unknown = set(weights) - {str(path) for path in paths}
    if unknown:
        raise ConfigError(
            f"--weight names '{sorted(unknown)[0]}', which is none of the recordings: {', '.join(map(str, paths))}."
        )
    found = tuple(_read(description, path, weights.get(str(path)), is_torque, is_degrees) for path in paths)
    if not any(one.motions for one in found):
        raise RecordingError(
            f"{paths[0]} has no tick of an empty machine: an arm is in it. Give a recording of a calibration too, such "
            "as the one that `exograv demo` writes."
        )
    return found


def _read(
    description: RigDescription, path: Path, weight: tuple[str, float] | None, is_torque: bool, is_degrees: bool
) -> ReadRecording:
    if not path.exists():
        raise RecordingError(f"The recording {path} does not exist. Check its path.")
    if is_lerobot(path):
        columns = _of_lerobot(description, path, is_degrees)
    elif path.suffix.lower() in (".csv", ".txt", ".tsv"):
        columns = read_csv(description, path, is_degrees)
    elif is_ros_recording(path) and not _is_ours(path):
        columns = _of_ros(description, path, is_torque)
    else:
        columns = _of_exograv(description, path)
    if weight is not None:
        refuse_wrong_mass(path, np.array([weight[1]]))
        columns.hung[:] = hung_row(description, *weight)
    _refuse_degrees(path, columns.q)
    pieces = _pieces(path, columns) if len(columns.t) else ()
    return ReadRecording(
        path, pieces, _digest(path), columns.is_simulated, columns.worn_s, columns.worn, columns.force_frame
    )


def _refuse_degrees(path: Path, q: Float[np.ndarray, "tick joint"]) -> None:
    """Refuse a motion that is too large for radians."""
    known = q[np.isfinite(q).all(axis=1)]
    most = float(np.ptp(known, axis=0).max()) if len(known) else 0.0
    if most > ANGLE_MOST:
        raise RecordingError(
            f"{path}: a joint moves by {most:.0f} rad. If its positions are degrees, give --degrees (CSV and LeRobot), "
            "or convert them to radians. Positions that LeRobot scales to ±100 cannot be used."
        )


def _digest(path: Path) -> str:
    files = sorted(one for one in path.rglob("*") if one.is_file() and one.suffix != VIDEO) if path.is_dir() else [path]
    digest = hashlib.sha256()
    for file in files:
        with file.open("rb") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()


def _is_ours(path: Path) -> bool:
    """Return True if the file has the format of exograv's recordings."""
    if path.is_dir() or path.suffix != ".mcap":
        return False
    with path.open("rb") as stream:
        head = stream.read(200)
    return b"exograv recording" in head


def _of_exograv(description: RigDescription, path: Path) -> RecordedColumns:
    recording = read_recording(path)
    if recording.joints != description.joints:
        raise RecordingError(
            f"{path} has the joints {', '.join(recording.joints)}; {description.name} has "
            f"{', '.join(description.joints)}. Give the machine of the recording."
        )
    stated = recording.settings.get("rig")
    if isinstance(stated, str) and stated != description.name:
        raise RecordingError(f"{path} is a recording of '{stated}', not of '{description.name}'. Give its machine.")
    is_empty = _of_empty_machine(recording)
    worn, whole = _identification(recording, description), recording.ticks
    ticks = whole[is_empty]
    current, tau = ticks["current"], ticks["tau_measured"].astype(float)
    if not np.isfinite(current).any():
        current = tau / description.nominal_gain
    # A calibrated machine converts by its own gains, and both torques of a tick have been converted by the same.
    gain = torque_per_current(tau, current, description.nominal_gain) if len(ticks) else description.nominal_gain
    return RecordedColumns(
        ticks["t"].copy(), ticks["q_measured"].copy(), current.copy(), ticks["tau_commanded"] / gain,
        _hung(description, recording, ticks["t"]), recording.is_simulated,
        ticks["q_motor"].copy() if np.isfinite(ticks["q_motor"]).any() else None, _warmth(recording, ticks["t"]),
        float((~is_empty).sum() * np.median(np.diff(whole["t"]))) if len(whole) > 1 else 0.0, worn,
    )  # fmt: skip


def _identification(recording: Recording, description: RigDescription) -> WornMotion | None:
    """Return the ticks in which the machine identifies an arm; None if there are none."""
    numbers = [k for k, phase in enumerate(recording.messages("/phase"), start=1) if phase["name"] == IDENTIFIES]
    ticks = recording.ticks[np.isin(recording.ticks["phase"], numbers)]
    if len(ticks) < 2:
        return None
    t, q, current = ticks["t"], ticks["q_measured"].astype(float), ticks["current"].astype(float)
    if not np.isfinite(current).any():
        current = ticks["tau_measured"].astype(float) / description.nominal_gain
    kept = np.flatnonzero(np.isfinite(q).all(axis=1) & np.isfinite(current).all(axis=1))
    period_s = float(np.median(np.diff(t)))
    ends = np.flatnonzero(np.diff(t[kept]) > 1.5 * period_s) + 1
    starts, stops = [0, *ends.tolist()], [*ends.tolist(), len(kept)]
    pieces = tuple(
        (begin, end) for begin, end in zip(starts, stops, strict=True) if (end - begin) * period_s >= PIECE_LEAST_S
    )
    wearer = recording.settings.get("wearer") or {}
    return WornMotion(wearer, period_s, q[kept], current[kept], pieces) if pieces else None


def _of_empty_machine(recording: Recording) -> np.ndarray:
    """Return True for each tick outside the phases of an arm in the machine."""
    numbers = [k for k, phase in enumerate(recording.messages("/phase"), start=1) if phase["name"] in WORN]
    is_carrying = recording.ticks["arm_share"] > 0.0  # NaN where no arm is carried
    return ~(np.isin(recording.ticks["phase"], numbers) | is_carrying)


def _hung(description: RigDescription, recording: Recording, t: np.ndarray) -> np.ndarray:
    """Return the known weights by the recording's events; NaN while one is lowered or lifted."""
    hung = np.zeros((len(t), len(description.mounts) * len(description.calibration.weights_kg)))
    for event in recording.messages("/event"):
        told = re.fullmatch(r"(\d+\.?\d*) kg (?:at|on) (\S+)", event["text"])
        if told is not None:
            hung[t >= event["t"]] = hung_row(description, told[2], float(told[1]))
            hung[(event["t"] - LOWERING_S <= t) & (t < event["t"])] = np.nan
    return hung


def _warmth(recording: Recording, t: np.ndarray) -> np.ndarray | None:
    """Return the temperatures of the windings [°C] by the recording's events, which are some seconds apart."""
    told = [event for event in recording.messages("/event") if event["kind"] == WARMTH_EVENT]
    rows = [[float(word) for word in event["text"].split()] for event in told]
    if not rows or {len(row) for row in rows} != {len(recording.joints)}:
        return None
    times = [event["t"] for event in told]
    return np.column_stack([np.interp(t, times, column) for column in np.array(rows).T])


def _of_ros(description: RigDescription, path: Path, is_torque: bool) -> RecordedColumns:
    states = read_joint_states(path, description.joints)
    current = states.effort / description.nominal_gain if is_torque else states.effort
    hung, none = no_weight(description, len(states.t)), np.full_like(current, np.nan)
    forces = read_wrenches(path)
    if forces is None:
        return RecordedColumns(states.t, states.q, current, none, hung, is_own=False)
    wrench = _wrench_at(path, forces, states.start_s + states.t)
    return RecordedColumns(
        states.t, states.q, current, none, hung, is_own=False, wrench=wrench, force_frame=forces.frame
    )


def _wrench_at(path: Path, forces: Wrenches, t: Float[np.ndarray, " tick"]) -> Float[np.ndarray, "tick 6"]:
    """Interpolate the wrench at times [s]; NaN outside the measurements and in their gaps.

    Raises:
        RecordingError: Fewer than two measurements lie in the recording.
    """
    inside = np.flatnonzero((forces.t >= t[0]) & (forces.t <= t[-1]))
    if len(inside) < 2:
        raise RecordingError(
            f"{path}: {len(inside)} wrenches lie within the time of the joint states. Stamp both by the same clock."
        )
    after = np.searchsorted(forces.t, t).clip(1, len(forces.t) - 1)
    apart, period_s = forces.t[after] - forces.t[after - 1], float(np.median(np.diff(forces.t[inside])))
    is_silent = (t < forces.t[0]) | (t > forces.t[-1]) | (apart > GAP_PERIODS * period_s)
    wrench = np.column_stack([np.interp(t, forces.t, column) for column in forces.wrench.T])
    return np.where(is_silent[:, None], np.nan, wrench)


def _of_lerobot(description: RigDescription, path: Path, is_degrees: bool) -> RecordedColumns:
    table, gain = read_lerobot(path, description.joints), description.nominal_gain
    q = np.deg2rad(table.q) if is_degrees else table.q
    by = (
        gain if table.current is None or table.torque is None else torque_per_current(table.torque, table.current, gain)
    )
    current = table.current if table.torque is None or table.current is not None else table.torque / gain
    assert current is not None
    asked = table.current_asked
    if asked is None:
        asked = np.full_like(q, np.nan) if table.torque_asked is None else table.torque_asked / by
    hung = no_weight(description, len(q))
    return RecordedColumns(table.t, q, current, asked, hung, temperature=table.temperature, is_own=False)


def _pieces(path: Path, columns: RecordedColumns) -> tuple[MeasuredMotion, ...]:
    """Divide a recording at its gaps, and put each piece on an even grid of time."""
    t = columns.t
    finite = np.isfinite(columns.q).all(axis=1) & np.isfinite(columns.current).all(axis=1) & np.isfinite(t)
    if columns.wrench is not None:
        finite &= np.isfinite(columns.wrench).all(axis=1)
    rising = np.concatenate([[True], t[1:] > np.maximum.accumulate(t)[:-1]])
    kept = np.flatnonzero(finite & rising)
    if len(kept) < 2:
        raise RecordingError(f"{path} has {len(kept)} complete rows with rising time; a motion is needed.")
    period_s = float(np.median(np.diff(t[kept])))
    if period_s > PERIOD_MAX_S:
        raise RecordingError(
            f"{path}: ticks are {1e3 * period_s:.3g} ms apart; at most {1e3 * PERIOD_MAX_S:g} ms are allowed. "
            "Record at 100 Hz or faster, with time in seconds."
        )
    ends = np.flatnonzero(np.diff(t[kept]) > GAP_PERIODS * period_s) + 1
    parts = [part for part in np.split(kept, ends) if t[part[-1]] - t[part[0]] >= PIECE_LEAST_S]
    if not parts:
        raise RecordingError(f"{path} has no piece of {PIECE_LEAST_S:g} s without a gap.")
    return tuple(_even(f"{path.name}, from {t[part[0]]:.1f} s", columns, part, period_s) for part in parts)


def _even(name: str, columns: RecordedColumns, part: np.ndarray, period_s: float) -> MeasuredMotion:
    t = columns.t[part]
    is_even = np.abs(np.diff(t) - period_s).max() < 0.02 * period_s
    grid = t if is_even else t[0] + period_s * np.arange(int((t[-1] - t[0]) / period_s) + 1)

    def cut(values: np.ndarray) -> np.ndarray:
        rows = values[part]
        return rows if is_even else np.column_stack([np.interp(grid, t, column) for column in rows.T])

    motor = None if columns.q_motor is None else cut(columns.q_motor)
    warmth = None if columns.temperature is None else cut(columns.temperature)
    wrench = None if columns.wrench is None else cut(columns.wrench)
    moved = cut(columns.q), cut(columns.current), cut(columns.current_asked), cut(columns.hung)
    return MeasuredMotion(
        name, grid, *moved, q_motor=motor, temperature=warmth, wrench=wrench, has_all_commands=columns.is_own
    )
