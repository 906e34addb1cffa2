"""A session starts from the file of an earlier donning, but not from an estimate that disagreed with its check."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.interface import Estimate, Joints, Outcome
from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import put_together
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.controller_knowledge import MOTION_S
from exograv.procedures.identification.estimator_session import Identification, build_method
from exograv.procedures.identification.options import ParticipantOptions
from exograv.procedures.identification.participant_session import KeptParticipant, ParticipantRun
from exograv.procedures.identification.sample_observers import HeldOutError
from exograv.procedures.identification.warm_start import FROM_FILE_S
from exograv.storage.participant_file import read_participant

NOW = datetime(2026, 11, 27, 12, 0, tzinfo=UTC)
BODY = Body(1.75, 75.0, "male")
ASSEMBLY: Assembly = put_together(load_rig("recupera_like"), BODY)
MACHINE: CalibratedMachine = nominal_machine(ASSEMBLY.description, ASSEMBLY.exo.phi)


class NoError(HeldOutError):
    """Prediction error of a motion that nobody moved."""

    def __init__(self):
        pass

    @property
    def rms(self) -> Joints:
        return np.zeros(4)

    @property
    def window_s(self) -> float:
        return 0.0


def kept(folder: Path, outcome: Outcome) -> tuple[Path, KeptParticipant]:
    """Keep the table's arm under this outcome."""
    mean, covariance = prior(ASSEMBLY, MACHINE)
    path = folder / "p.toml"
    run = ParticipantRun(ParticipantOptions(keep=path, code="P-07"), ASSEMBLY, "serial 7", BODY, NOW)
    run._held_out = NoError()
    found = Identification(build_method("anthropometric", ASSEMBLY, MACHINE), mean, covariance, outcome=outcome)
    found.estimates.append(Estimate(59.8, mean, covariance, 0.0, 1.0))
    found.predicted.append(np.full(4, 0.1))
    written = run.keep(found, MACHINE, "designed", "")
    assert isinstance(written, KeptParticipant)
    return path, written


def returning(path: Path) -> ParticipantRun:
    return ParticipantRun(ParticipantOptions(participant=path), ASSEMBLY, "serial 7", BODY, NOW)


@pytest.mark.parametrize("outcome", [Outcome.CONVERGED, Outcome.UNCHECKED, Outcome.EXHAUSTED])
def test_a_file_is_the_start_of_a_short_check(tmp_path: Path, outcome: Outcome):
    path, written = kept(tmp_path, outcome)
    run = returning(path)
    assert written.warning == run.warning == ""
    assert run.motion_s == FROM_FILE_S
    assert run.belief(MACHINE) is not None


def test_an_estimate_that_disagreed_is_kept_with_its_outcome_and_a_warning(tmp_path: Path):
    path, written = kept(tmp_path, Outcome.DISAGREES)
    assert read_participant(path).identified.outcome == Outcome.DISAGREES.value
    assert "disagrees with its check" in written.warning


def test_the_next_session_says_so_and_identifies_from_the_table_with_a_motion_that_ends_with_a_check(tmp_path: Path):
    path, _ = kept(tmp_path, Outcome.DISAGREES)
    run = returning(path)
    assert "P-07" in run.warning
    assert run.motion_s == MOTION_S
    assert run.belief(MACHINE) is None
    assert run.returning is None
