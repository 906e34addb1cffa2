"""Recordings of a machine from several sources: exograv's MCAP, CSV with named columns, ROS, LeRobot.

All are of the empty machine, but exograv's own may also hold the identification of an arm.
"""

import csv
import hashlib
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError, RecordingError
from exograv.identification.machine_twin.measured_motion import MeasuredMotion
from exograv.model.description import RigDescription
from exograv.procedures.calibration.empty_run import WARMTH_EVENT
from exograv.recording.joint_states import Wrenches, is_ros_recording, read_joint_states, read_wrenches
from exograv.recording.lerobot import is_lerobot, read_lerobot
from exograv.recording.log_columns import NAMES, named_columns
from exograv.recording.reader import Recording, read_recording

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

ASKED_TORQUES = ("tau_commanded", "torque_commanded", "commanded_torque", "tau_cmd", "target_torque", "tau_desired")
ASKED_CURRENTS = ("current_commanded", "i_commanded", "current_asked", "commanded_current", "i_cmd", "target_current")
TEMPERATURES = ("temperature", "motor_temperature", "winding_temperature", "temperature_c", "temp")
MOTOR_POSITIONS = ("q_motor", "motor_position", "actual_motor_q", "motor_q")
FORCES = ("force", "f", "ft_force", "wrench_force")
MOMENTS = ("moment", "m", "ft_torque", "wrench_torque")
"""Names of the columns of a force sensor, which end in `_x`, `_y` and `_z`."""

AXES = "x", "y", "z"

HUNG = ("weight_kg", "hung_kg", "known_weight_kg", "payload_kg")
"""Names of columns of a CSV recording, without the number or name of the joint."""

VIDEO = ".mp4"
"""Ending of the videos of a LeRobot dataset, which do not belong to the fitted data."""

ANGLE_MOST = 4.0 * np.pi
"""Largest range of a joint that is plausible in radians [rad]."""

MASS_MOST_KG = 100.0
"""Largest weight that a recording may state [kg]: a larger number is in grams."""

NEEDED = "time, q of each joint, and current or tau of each joint"


@dataclass(frozen=True)
class WornMotion:
    """Identification of an arm in a recording."""

    wearer: Mapping[str, Any]
    """Body data of the person, as the recording states them; empty if it does not."""

    period_s: float
    """Time between two ticks [s]."""

    q: Float[np.ndarray, "tick joint"]
    """Measured positions [rad]."""

    current: Float[np.ndarray, "tick joint"]
    """Measured currents [A]."""

    pieces: tuple[tuple[int, int], ...]
    """First tick and tick after the last one of each piece without a gap."""

    @property
    def seconds(self) -> float:
        """Length of all pieces [s]."""
        return self.period_s * sum(end - begin for begin, end in self.pieces)


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


@dataclass(frozen=True)
class _Columns:
    """Columns of a recording as they are stored, one row per tick."""

    t: Float[np.ndarray, " tick"]
    q: Float[np.ndarray, "tick joint"]
    current: Float[np.ndarray, "tick joint"]
    current_asked: Float[np.ndarray, "tick joint"]
    hung: Float[np.ndarray, "tick hanging"]
    is_simulated: bool = False
    q_motor: Float[np.ndarray, "tick joint"] | None = None
    temperature: Float[np.ndarray, "tick joint"] | None = None
    worn_s: float = 0.0
    worn: WornMotion | None = None
    is_own: bool = True
    """True for a recording of exograv, which has one row for each command."""
    wrench: Float[np.ndarray, "tick 6"] | None = None
    force_frame: str | None = None


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


def hung_row(description: RigDescription, mount: str, mass_kg: float) -> Float[np.ndarray, " hanging"]:
    """Return a weight at a mount in the form of `Sweeps.hung` [-].

    Raises:
        ConfigError: The machine has no such mount.
    """
    if mount not in description.mounts:
        raise ConfigError(f"No mount '{mount}' in {description.name}. Mounts: {', '.join(description.mounts)}.")
    weights = description.calibration.weights_kg
    row = np.zeros(len(description.mounts) * len(weights))
    row[description.mounts.index(mount) * len(weights)] = mass_kg / weights[0]
    return row


def _read(
    description: RigDescription, path: Path, weight: tuple[str, float] | None, is_torque: bool, is_degrees: bool
) -> ReadRecording:
    if not path.exists():
        raise RecordingError(f"The recording {path} does not exist. Check its path.")
    if is_lerobot(path):
        columns = _of_lerobot(description, path, is_degrees)
    elif path.suffix.lower() in (".csv", ".txt", ".tsv"):
        columns = _of_csv(description, path, is_degrees)
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


def _of_exograv(description: RigDescription, path: Path) -> _Columns:
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
    gain = _ratio(tau, current, description.nominal_gain) if len(ticks) else description.nominal_gain
    return _Columns(
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


def _of_ros(description: RigDescription, path: Path, is_torque: bool) -> _Columns:
    states = read_joint_states(path, description.joints)
    current = states.effort / description.nominal_gain if is_torque else states.effort
    hung, none = _no_weight(description, len(states.t)), np.full_like(current, np.nan)
    forces = read_wrenches(path)
    if forces is None:
        return _Columns(states.t, states.q, current, none, hung, is_own=False)
    wrench = _wrench_at(path, forces, states.start_s + states.t)
    return _Columns(states.t, states.q, current, none, hung, is_own=False, wrench=wrench, force_frame=forces.frame)


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


def _of_lerobot(description: RigDescription, path: Path, is_degrees: bool) -> _Columns:
    table, gain = read_lerobot(path, description.joints), description.nominal_gain
    q = np.deg2rad(table.q) if is_degrees else table.q
    by = gain if table.current is None or table.torque is None else _ratio(table.torque, table.current, gain)
    current = table.current if table.torque is None or table.current is not None else table.torque / gain
    assert current is not None
    asked = table.current_asked
    if asked is None:
        asked = np.full_like(q, np.nan) if table.torque_asked is None else table.torque_asked / by
    hung = _no_weight(description, len(q))
    return _Columns(table.t, q, current, asked, hung, temperature=table.temperature, is_own=False)


def _no_weight(description: RigDescription, ticks: int) -> np.ndarray:
    return np.zeros((ticks, len(description.mounts) * len(description.calibration.weights_kg)))


def _of_csv(description: RigDescription, path: Path, is_degrees: bool) -> _Columns:
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            head = stream.readline()
            dialect = ";" if head.count(";") > head.count(",") else "\t" if "\t" in head else ","
            names = next(csv.reader([head], delimiter=dialect), [])
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # of a file without numbers, which is refused below
                values = np.loadtxt(stream, delimiter=dialect, ndmin=2)
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise RecordingError(f"{path} is no CSV with one line of names and numbers below: {error}.") from error
    if not names or not values.size:
        raise RecordingError(f"{path} has no row of numbers. Give a CSV with one line of names and numbers below.")
    if values.shape[1] != len(names):
        raise RecordingError(
            f"{path} has {len(names)} names of columns, and {values.shape[1]} columns of numbers. Both must agree."
        )
    joints, gain = description.joints, description.nominal_gain

    def group(stems: Sequence[str]) -> np.ndarray | None:
        places = named_columns(names, stems, joints)
        return None if places is None else values[:, places]

    time, q, current, tau = named_columns(names, NAMES["time"], None), group(NAMES["positions"]), None, None
    current, tau = group(NAMES["currents"]), group(NAMES["torques"])
    there = {"time": time is not None, "q": q is not None, "current or tau": not (current is None and tau is None)}
    if time is None or q is None or (current is None and tau is None):
        raise RecordingError(
            f"{path} lacks {' and '.join(name for name, is_there in there.items() if not is_there)}: needed are "
            f"{NEEDED}, for the joints {', '.join(joints)}. Columns there: {', '.join(names)}. Name them as "
            f"q_{joints[0]} or q_1."
        )
    used = tau / gain if current is None and tau is not None else current
    assert used is not None
    asked_tau, asked = group(ASKED_TORQUES), group(ASKED_CURRENTS)
    if asked is None:
        # As in exograv's own recordings, both torques are converted by the same gains.
        by = gain if current is None or tau is None else _ratio(tau, current, gain)
        asked = np.full_like(q, np.nan) if asked_tau is None else asked_tau / by
    hung, q_motor = _no_weight(description, len(q)), group(MOTOR_POSITIONS)
    weight = named_columns(names, HUNG, None)
    if weight is not None:
        masses = values[:, weight[0]]
        refuse_wrong_mass(path, masses)
        hung[:] = np.outer(masses, hung_row(description, description.calibration.mount, 1.0))
    if is_degrees:
        q, q_motor = np.deg2rad(q), None if q_motor is None else np.deg2rad(q_motor)
    return _Columns(
        values[:, time[0]], q, used, asked, hung, q_motor=q_motor, temperature=group(TEMPERATURES), is_own=False,
        wrench=_csv_wrench(path, names, values),
    )  # fmt: skip


def _csv_wrench(path: Path, names: Sequence[str], values: Float[np.ndarray, "tick column"]) -> np.ndarray | None:
    """Return the wrench of a force sensor (tick, 6) by its columns; None without them."""
    force, moment = (_axis_columns(names, stems) for stems in (FORCES, MOMENTS))
    if force is None:
        if moment is not None:
            raise RecordingError(
                f"{path} has moments of a force sensor, but no forces. Name them force_x, force_y and force_z [N]."
            )
        return None
    return np.hstack([values[:, force], np.zeros((len(values), 3)) if moment is None else values[:, moment]])


def _axis_columns(names: Sequence[str], stems: Sequence[str]) -> list[int] | None:
    """Return the places of the columns of the three axes; numbers do not stand for axes."""
    found = [named_columns(names, [f"{stem}_{axis}" for stem in stems], None) for axis in AXES]
    places = [one[0] for one in found if one is not None]
    return places if len(places) == len(AXES) else None


def refuse_wrong_mass(path: Path, masses_kg: Float[np.ndarray, " tick"]) -> None:
    """Refuse weights that are negative or cannot be kilograms.

    Raises:
        RecordingError: A mass is not between 0 and `MASS_MOST_KG`.
    """
    low, high = float(np.nanmin(masses_kg)), float(np.nanmax(masses_kg))
    if not 0.0 <= low <= high <= MASS_MOST_KG:
        raise RecordingError(
            f"{path}: the weights are {low:g} to {high:g} kg; allowed: 0 to {MASS_MOST_KG:g} kg. Give kilograms."
        )


def _ratio(tau: np.ndarray, current: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """Torque per current of each joint by the recording itself; the nominal one where there is no current."""
    large = (np.abs(current) > 0.1 * np.nanmax(np.abs(current), axis=0)) & np.isfinite(tau)
    ratio = nominal.copy()
    for joint, rows in enumerate(large.T):
        if rows.any():
            ratio[joint] = np.median(tau[rows, joint] / current[rows, joint])
    return ratio


def _pieces(path: Path, columns: _Columns) -> tuple[MeasuredMotion, ...]:
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


def _even(name: str, columns: _Columns, part: np.ndarray, period_s: float) -> MeasuredMotion:
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
