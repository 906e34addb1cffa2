"""Identification of an arm from recorded arrays, and the estimate of its parameters."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout, names_and_units
from exograv.errors import ConfigError
from exograv.identification.calibration.empty_machine import Calibration
from exograv.identification.core import interface as core
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.carried_arm import CarriedArm
from exograv.identification.core.interface import Outcome
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.core.muscle_signals import MuscleSignals
from exograv.identification.core.prior import prior
from exograv.identification.recursive.previous_session import kept_part
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription
from exograv.procedures.identification.estimator_session import EstimatorSession, arm_to_carry
from exograv.procedures.identification.method_names import MethodName
from exograv.procedures.identification.participant_session import stored_person
from exograv.recording.rounding import rounded
from exograv.storage.participant_file import new_code, read_participant, refuse_other, write_participant
from exograv.storage.participant_schema import Identified, StoredPerson, prior_hash

from .arm_in_machine import arm_in_machine

if TYPE_CHECKING:
    import pandas as pd

PERIOD_S = (0.0002, 0.01)
"""Range of sampling periods, at least and at most [s]."""

FILTER_PERIOD_S = 0.001
"""Longest period of the estimator's filter [s], which holds its input over a period. The error of its acceleration
grows with the square of the period; it is 0.03 1/s times the velocity at 1 ms."""

SHARE_MAX = 3.0
"""Largest share of a maximum voluntary contraction that a signal may reach [-]: a reference contraction is often too
weak, and per cent or microvolts are an error of the unit."""

SHORTEST_S = 2.0
"""Shortest motion from which `identify` makes an estimate [s]."""


@dataclass(frozen=True)
class Estimate:
    """Estimated parameters of an arm in a machine, with their covariance."""

    person: Body
    """Body data that the estimate started from."""
    assembly: Assembly
    """Model of machine and arm."""
    machine: CalibratedMachine
    """Calibration of the machine, or the values of its data sheets."""
    x: Float[np.ndarray, " parameter"]
    """Parameters in the order of `to_pandas`, SI units."""
    covariance: Float[np.ndarray, "parameter parameter"] | None
    """Covariance of `x`; None for a method that states no uncertainty."""
    outcome: str
    """Verdict of the stop rule, as a sentence."""
    method: str = "recursive"
    """Name of the identification method."""
    motion_s: float = 0.0
    """Length of the motion that was used [s]."""
    why: str = ""
    """Figures behind the outcome and the decision to float, as sentences."""

    @property
    def rig(self) -> RigDescription:
        """Machine in which the arm was identified."""
        return self.assembly.description

    @property
    def sd(self) -> Float[np.ndarray, " parameter"]:
        """Standard deviation of each parameter; NaN where the method states none."""
        if self.covariance is None:
            return np.full_like(self.x, np.nan)
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def left_over(self) -> Float[np.ndarray, " joint"]:
        """Predict the left over: RMS residual gravity torque over the task workspace, per joint [N·m].

        The prediction comes from the covariance; it is valid if the model's form is right. `Flight.left_over_true` of
        a simulated flight is the true value.
        """
        if self.covariance is None:
            return np.full(self.assembly.n, np.nan)
        return LeftOverPrediction(ArmModel(self.assembly, self.machine), self.x).rms(self.covariance)

    def carried(self) -> CarriedArm:
        """Decide how much of the estimate a machine carries when it floats the arm: `x`, `share` per joint, and bounds.

        Slip of the cuffs is not part of an estimate that was loaded.
        """
        return arm_to_carry(
            core.Estimate(self.motion_s, self.x, self.covariance, 0.0, 1.0), self.assembly, self.machine
        )

    def to_pandas(self) -> "pd.DataFrame":
        """Return a table with one row per parameter: unit, estimate, standard deviation, 95 % interval."""
        import pandas as pd

        rows = list(names_and_units(self.assembly))
        table = pd.DataFrame(
            {"unit": [unit for _, unit in rows], "estimate": self.x, "sd": self.sd}, index=[name for name, _ in rows]
        )
        return table.assign(low95=self.x - 1.96 * self.sd, high95=self.x + 1.96 * self.sd)

    def save(self, path: str | Path, code: str | None = None, machine: str = "") -> Path:
        """Write the person's parameters to a file that `load` and `--participant` read.

        Args:
            path: File to write.
            code: Code that stands for the person, such as P-07, never a name; a random one if None.
            machine: Serial number of the machine, as its calibration states it.

        Raises:
            ConfigError: The method states no uncertainty, the code is not allowed, or the file cannot be written.
        """
        if self.covariance is None:
            raise ConfigError(f"Method '{self.method}' states no uncertainty, and a file needs one. Use 'recursive'.")
        identified = Identified(
            at_utc=datetime.now(UTC).replace(microsecond=0),
            donnings=1,
            method=self.method,
            prior_sha256=prior_hash(self.assembly, prior(self.assembly, self.machine)),
            motion="arrays",
            motion_s=round(self.motion_s, 3) or SHORTEST_S,
            calibration_sha256="",
            outcome=self.outcome,
            predicted_left_over_Nm=rounded(self.left_over()),
            held_out_error_Nm=[],
            held_out_s=0.0,
        )
        person = StoredPerson.of(code or new_code(), self.person)
        write_participant(
            Path(path), stored_person(person, self.assembly, machine, identified, (self.x, self.covariance))
        )
        return Path(path)

    @classmethod
    def load(
        cls, path: str | Path, rig: RigDescription, calibration: Calibration | None = None, machine: str = ""
    ) -> "Estimate":
        """Read a file that `save` or `exograv arm identify --keep` wrote.

        Friction and rotors come from `calibration`, or from the data sheets; the file holds the person's parameters.

        Args:
            path: File to read.
            rig: Machine in which the person was identified.
            calibration: Calibration of the machine.
            machine: Serial number of the machine, as its calibration states it.

        Raises:
            ConfigError: The file cannot be read, is damaged, or belongs to another machine.
        """
        stored = read_participant(Path(path))
        told = stored.person
        person = Body(told.height_m, told.mass_kg, told.sex, dict(told.lengths_m) or None)
        assembly, known = arm_in_machine(rig, person, calibration)
        refuse_other(Path(path), stored, assembly, machine, datetime.now(UTC))
        x, covariance = prior(assembly, known)
        kept = kept_part(ParameterLayout.of(assembly))
        x[kept] = stored.mean
        covariance[kept, :] = covariance[:, kept] = 0.0
        covariance[kept, kept] = stored.covariance
        how = stored.identified
        return cls(person, assembly, known, x, covariance, how.outcome, how.method, how.motion_s)


def identify(  # noqa: PLR0913 - measured arrays by name
    rig: RigDescription,
    person: Body,
    q: ArrayLike,
    tau: ArrayLike,
    dt: float,
    *,
    v: ArrayLike | None = None,
    muscles: ArrayLike | None = None,
    calibration: Calibration | None = None,
    method: MethodName = "recursive",
) -> Estimate:
    """Identify an arm from recorded joint positions and torques of a relaxed arm that the machine moves.

    Without `calibration`, friction and torque constants are those of the data sheets; the intervals then hold only if
    `tau` was measured by torque sensors or calibrated motors.

    Args:
        rig: Machine, by `load_rig`.
        person: Body data of the person in the machine.
        q: Joint positions (sample, joint), joints in the order of `rig.joints` [rad].
        tau: Joint torques of the motors (sample, joint), friction included, positive along the joint axis [N·m].
        dt: Sampling period, constant [s].
        v: Joint velocities (sample, joint), without delay against `q` [rad/s]; differentiated from `q` if None.
        muscles: Envelopes of the muscles' EMG (sample, channel): their size above rest, as a share of a maximum
            voluntary contraction [-], at the times of `q`. Which muscle a channel belongs to need not be known. Only
            the method 'recursive' uses them.
        calibration: Calibration of the machine; the values of its data sheets if None.
        method: Name of the identification method.

    Raises:
        ConfigError: An array has another shape than (sample, joint), a value that is not finite, or is too short.
        ModelError: The machine does not fit the person.
    """
    position, torque = _checked("q", q, rig, dt), _checked("tau", tau, rig, dt)
    velocity = None if v is None else _checked("v", v, rig, dt)
    signals = None if muscles is None else _checked_signals(muscles, method)
    for name, other in (("tau", torque), ("v", velocity), ("muscles", signals)):
        if other is not None and len(other) != len(position):
            raise ConfigError(f"{name} has {len(other)} samples and q has {len(position)}; give arrays of one length.")
    assembly, machine = arm_in_machine(rig, person, calibration)
    steps = max(1, round(dt / FILTER_PERIOD_S))
    position, torque = _between(position, steps), _between(torque, steps)
    velocity = None if velocity is None else _between(velocity, steps)
    signals = None if signals is None else _between(signals, steps)
    of_muscles = None if signals is None else MuscleSignals(signals.shape[1])
    session = EstimatorSession(assembly, machine, method, dt / steps, muscles=of_muscles)
    for k in range(len(position)):
        seen = (None if values is None else values[k] for values in (velocity, signals))
        x = session.take(position[k], torque[k], None, *seen)
        if x is not None and session.is_to_note:
            session.judge(session.estimate())
    session.judge(session.last())
    found = session.close()
    last = found.last
    verdict = found.outcome if found.stop_s is None or found.outcome is not Outcome.RUNNING else Outcome.TIME_IS_UP
    return Estimate(person, assembly, machine, last.x, last.covariance, verdict.value, method, last.t, found.why)


def _checked_signals(values: ArrayLike, method: MethodName) -> Float[np.ndarray, "sample channel"]:
    array = np.asarray(values, dtype=float)
    if method != "recursive":
        raise ConfigError(f"muscles are given, and the method '{method}' has no use for them. Use 'recursive'.")
    if array.ndim != 2 or array.shape[1] == 0:
        raise ConfigError(f"muscles has shape {array.shape}; it must be (sample, channel).")
    if not np.isfinite(array).all():
        row, column = np.argwhere(~np.isfinite(array))[0]
        raise ConfigError(f"muscles[{row}, {column}] is {array[row, column]}; all values must be finite numbers.")
    if np.abs(array).max() > SHARE_MAX:
        raise ConfigError(
            f"muscles reaches {np.abs(array).max():.3g}; allowed: up to {SHARE_MAX:g}. Give each channel's envelope "
            "above rest as a share of a maximum voluntary contraction, not in microvolts or per cent."
        )
    return array


def _between(values: Float[np.ndarray, "sample column"], steps: int) -> Float[np.ndarray, "filtered column"]:
    """Interpolate linearly, `steps` periods of the filter in each sampling period."""
    at = np.arange((len(values) - 1) * steps + 1) / steps
    return np.column_stack([np.interp(at, np.arange(len(values)), column) for column in values.T])


def _checked(name: str, values: ArrayLike, rig: RigDescription, dt: float) -> Float[np.ndarray, "sample joint"]:
    array = np.asarray(values, dtype=float)
    least, most = PERIOD_S
    if not least <= dt <= most:
        raise ConfigError(f"dt is {dt} s; allowed: {least} to {most} s. Resample the data, or check the unit.")
    if array.ndim != 2 or array.shape[1] != len(rig.joints):
        raise ConfigError(
            f"{name} has shape {array.shape}; it must be (sample, {len(rig.joints)}), joints in the order "
            f"{', '.join(rig.joints)}."
        )
    if not np.isfinite(array).all():
        row, column = np.argwhere(~np.isfinite(array))[0]
        raise ConfigError(f"{name}[{row}, {column}] is {array[row, column]}; all values must be finite numbers.")
    if len(array) * dt < SHORTEST_S:
        raise ConfigError(f"{name} lasts {len(array) * dt:.2f} s; at least {SHORTEST_S:g} s of motion are needed.")
    return array
