"""CSV recordings with named columns."""

import csv
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.errors import RecordingError
from exograv.model.description import RigDescription
from exograv.recording.log_columns import NAMES, named_columns

from .recorded_columns import RecordedColumns, hung_row, no_weight, refuse_wrong_mass, torque_per_current

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

NEEDED = "time, q of each joint, and current or tau of each joint"


def read_csv(description: RigDescription, path: Path, is_degrees: bool) -> RecordedColumns:
    """Read a CSV recording by the names of its columns.

    Raises:
        RecordingError: The file is no such CSV, or lacks a column.
    """
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
        by = gain if current is None or tau is None else torque_per_current(tau, current, gain)
        asked = np.full_like(q, np.nan) if asked_tau is None else asked_tau / by
    hung, q_motor = no_weight(description, len(q)), group(MOTOR_POSITIONS)
    weight = named_columns(names, HUNG, None)
    if weight is not None:
        masses = values[:, weight[0]]
        refuse_wrong_mass(path, masses)
        hung[:] = np.outer(masses, hung_row(description, description.calibration.mount, 1.0))
    if is_degrees:
        q, q_motor = np.deg2rad(q), None if q_motor is None else np.deg2rad(q_motor)
    return RecordedColumns(
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
