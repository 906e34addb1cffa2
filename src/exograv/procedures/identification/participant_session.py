"""Participant's file: a run starts from it and writes it."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.interface import Estimate, Outcome
from exograv.identification.core.left_over import TARGET_NM
from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.recording import RecordingWriter
from exograv.recording.rounding import rounded
from exograv.storage.calibration_file import identity_of
from exograv.storage.participant_file import (
    new_code,
    read_participant,
    refuse_other,
    refuse_other_body,
    refuse_other_than_participant,
    refuted_text,
    write_participant,
)
from exograv.storage.participant_schema import (
    SCHEMA_VERSION,
    Identified,
    StoredParticipant,
    StoredPerson,
    parameter_rows,
    prior_hash,
)
from exograv.storage.sealed_file import sealed
from exograv.storage.session_checkpoint import CheckedArm, KeptArm

from .controller_knowledge import MOTION_S
from .estimator_session import Belief, Identification
from .identify import Identifier
from .options import ParticipantOptions
from .sample_observers import HeldOutError
from .warm_start import FROM_FILE_S, WarmStart, belief_today

NOT_KEPT = (Outcome.NOT_RELAXED, Outcome.NOT_EXCITED)
"""Outcomes after which no file is written, because the estimate is not a relaxed arm."""

DISAGREED = (
    "The file says that this estimate disagrees with its check. The next session does not start from it: it identifies "
    "the arm again."
)

NOTHING_LEARNED = "Not kept. No rest has given an estimate of a relaxed arm."
KEPT_BEFORE = "Not kept. The file holds an estimate of this donning that states a smaller residual torque."


def motion_needed_s(before: StoredParticipant | None, unknown_s: float = MOTION_S) -> float:
    """Duration of the motion that a person needs [s]: `unknown_s` unless there is a file that may be used."""
    return unknown_s if before is None or refuted_text(before) else FROM_FILE_S


@dataclass(frozen=True)
class KeptParticipant:
    """Result of writing a participant's file, with the warning for its next session; empty without one."""

    file: Path
    code: str
    hash: str
    donnings: int
    held_out_error_Nm: list[float]
    bytes: int
    warning: str = ""

    @classmethod
    def of(cls, path: Path, whole: StoredParticipant) -> "KeptParticipant":
        """Describe a file that was just written."""
        how, warning = whole.identified, DISAGREED if refuted_text(whole) else ""
        size = path.stat().st_size
        return cls(path, whole.person.code, whole.content_sha256, how.donnings, how.held_out_error_Nm, size, warning)


@dataclass(frozen=True)
class NotKept:
    """Reason why no file was written."""

    file: None
    why: str


@dataclass
class ParticipantRun:
    """Reading and writing of a participant's file in one identification."""

    options: ParticipantOptions
    assembly: Assembly
    serial: str
    """Serial number of the machine."""
    told: Body
    now: datetime
    before: StoredParticipant | None = None
    returning: WarmStart | None = None
    keep_option: str = "--keep"
    """Name of the option with the path of the file to write, for error messages."""
    is_of_donning: bool = False
    """True if the file holds an estimate of the present donning. A new estimate then counts no further donning."""
    _held_out: HeldOutError | None = None

    def __post_init__(self):
        """Read the file of an earlier donning, and check the place of the new one.

        Raises:
            ConfigError: A file is damaged, belongs to another machine or person, or is of another kind.
        """
        if self.options.keep is not None:
            refuse_other_than_participant(self.options.keep, self.keep_option)
        path = self.options.participant
        if path is None:
            return
        self.before = read_participant(path)
        refuse_other(path, self.before, self.assembly, self.serial, self.now)
        refuse_other_body(path, self.before, self.told)

    def belief(self, machine: CalibratedMachine) -> Belief | None:
        """Belief from the file, in the machine as calibrated today; None without a file that may be used."""
        path, before = self.options.participant, self.before
        if path is None or before is None or self.warning:
            return None
        belief, table = belief_today(before, self.assembly, machine, self.now)
        self.returning = WarmStart(path, before.person.code, belief, table, self.assembly, machine)
        return belief

    @property
    def warning(self) -> str:
        """Sentence on a file whose estimate disagreed with its check; empty without one."""
        return "" if self.before is None else refuted_text(self.before)

    @property
    def motion_s(self) -> float:
        """Duration of the motion that this person needs [s]."""
        return motion_needed_s(self.before)

    def warn(self, recording: RecordingWriter | None, t: float) -> None:
        """Record the warning at rig time `t` [s], if there is one."""
        if recording is not None and self.warning:
            recording.write("/event", t, {"kind": "warning", "text": self.warning})

    def listen(self, identifier: Identifier) -> None:
        """Add the observers of the file before the motion begins."""
        method = identifier.result.method
        if self.options.keep is not None:
            self._held_out = HeldOutError(identifier.model.again(), lambda: method.estimate().x)
            identifier.followers.append(self._held_out)
        if self.returning is not None:
            self.returning.begin(identifier.model)
            identifier.followers.append(self.returning)

    @property
    def hashes(self) -> dict[str, str]:
        """Hash of the file that was read."""
        return {} if self.before is None else {"participant": self.before.content_sha256}

    def note(self, estimate: Estimate, predicted: np.ndarray | None) -> None:
        """Judge the present estimate, once a second."""
        if self.returning is not None:
            self.returning.note(estimate, predicted)

    def keep(
        self, found: Identification, machine: CalibratedMachine, motion: str, calibration_sha256: str
    ) -> KeptParticipant | NotKept | None:
        """Write the file, if it was requested; return None otherwise.

        Raises:
            ConfigError: The file cannot be written.
        """
        path, covariance = self.options.keep, found.last.covariance
        if path is None or covariance is None or self._held_out is None:
            return None
        if found.outcome in NOT_KEPT:
            return NotKept(None, f"Not kept. {found.outcome.value}")
        predicted = found.predicted[-1]
        learned = CheckedArm(
            **KeptArm.of(found.last.x, covariance).model_dump(),
            motion_s=found.last.t,
            outcome=found.outcome.value,
            predicted_left_over_Nm=[] if predicted is None else predicted.tolist(),
            held_out_error_Nm=self._held_out.rms.tolist(),
            held_out_s=self._held_out.window_s,
        )
        return self._written(path, learned, machine, found.method.name, motion, calibration_sha256)

    def keep_learned(self, learned: CheckedArm | None, machine: CalibratedMachine) -> KeptParticipant | NotKept | None:
        """Write the file with an estimate from rests, if a file was requested; return None otherwise.

        A second call with the same estimate finds the file written. Then it does not count another donning. An estimate
        of the same donning is replaced only by one that states a smaller residual torque, or that disagrees with its
        check, so that the next session does not start from it.

        Raises:
            ConfigError: The file cannot be written.
        """
        path, before = self.options.keep, self.before
        if path is None:
            return None
        if learned is None:
            return NotKept(None, NOTHING_LEARNED)
        if before is not None and before.parameters == parameter_rows(self.assembly, *learned.arrays):
            return KeptParticipant.of(path, before)
        if before is not None and self.is_of_donning and not self._is_to_replace(before, learned):
            return NotKept(None, KEPT_BEFORE)
        return self._written(path, learned, machine, "recursive", "rests", "")

    def _is_to_replace(self, before: StoredParticipant, learned: CheckedArm) -> bool:
        """Return True if an estimate of the same donning takes the place of the one in the file."""
        stated = before.identified.predicted_left_over_Nm
        if refuted_text(before) or learned.outcome == Outcome.DISAGREES.value or not stated:
            return True
        target = np.array([TARGET_NM[place] for place in self.assembly.description.places])
        new, old = (np.square(np.array(one) / target).sum() for one in (learned.predicted_left_over_Nm, stated))
        return bool(new < old)

    def _written(
        self,
        path: Path,
        learned: CheckedArm,
        machine: CalibratedMachine,
        method: str,
        motion: str,
        calibration_sha256: str,
    ) -> KeptParticipant:
        identified = Identified(
            at_utc=self.now,
            donnings=1 if self.before is None else self.before.identified.donnings + (not self.is_of_donning),
            method=method,
            prior_sha256=prior_hash(self.assembly, prior(self.assembly, machine)),
            motion=motion,
            motion_s=round(learned.motion_s, 3),
            calibration_sha256=calibration_sha256,
            outcome=learned.outcome,
            predicted_left_over_Nm=rounded(np.array(learned.predicted_left_over_Nm)),
            held_out_error_Nm=rounded(np.array(learned.held_out_error_Nm)),
            held_out_s=round(learned.held_out_s, 2),
        )
        person = StoredPerson.of(self.code, self.told)
        whole = stored_person(person, self.assembly, self.serial, identified, learned.arrays)
        write_participant(path, whole)
        return KeptParticipant.of(path, whole)

    @property
    def code(self) -> str:
        """Code for the file: the requested one, that of the file before, or a random one."""
        if self.options.code is not None:
            return self.options.code
        return new_code() if self.before is None else self.before.person.code


def stored_person(
    person: StoredPerson, assembly: Assembly, serial: str, identified: Identified, found: Belief
) -> StoredParticipant:
    """Return the sealed file of an identified person in the machine with this serial number."""
    return sealed(
        StoredParticipant(
            schema_version=SCHEMA_VERSION,
            person=person,
            machine=identity_of(assembly.description, serial),
            identified=identified,
            parameters=parameter_rows(assembly, *found),
        )
    )
