"""Identification on drives (`exograv arm identify --drives`): one live run, and the file of the arm."""

from dataclasses import dataclass
from pathlib import Path

from exograv.errors import ConfigError
from exograv.live.live_figures import LiveFigures
from exograv.live.options import MOTION_S, LiveOptions, PersonForm
from exograv.loop.pilot import Progress
from exograv.options import WornOptions
from exograv.procedures.identification.options import ParticipantOptions
from exograv.procedures.identification.participant_session import KeptParticipant, NotKept
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.recording.rounding import rounded
from exograv.storage.participant_file import refuse_other_than_participant

from .connection import Say
from .float_command import Procedure, fly_on_drives

FLOATS_S = 5.0
"""Time for which the arm floats after the identification [s]."""


@dataclass(frozen=True)
class IdentifiedOnDrives:
    """Result of an identification on drives."""

    ok: bool
    """True if the arm was identified, and its file was written if one was asked for."""
    from_file: bool
    """True if the identification started from a participant's file."""
    predicted_left_over_Nm: list[float] | None
    """Left over per joint by the uncertainty of the estimate."""
    person: KeptParticipant | NotKept | None
    """File of the arm; None if none was asked for, or the identification did not finish."""
    live: LiveFigures


def identify_on_drives(
    worn: WornOptions,
    seconds: float,
    files: ParticipantOptions,
    person: PersonForm,
    folder: Path,
    progress: Progress,
    say: Say,
    wearer: SimulatedWearer | None = None,
) -> IdentifiedOnDrives:
    """Identify the arm in a machine on drives with `seconds` of motion, and keep it.

    A person with a file needs only the motion of a check.

    Raises:
        ExogravError: The machine is not ready, or a file or an option cannot be used.
        IdentificationError: The motion contradicts the file of the person.
    """
    if seconds < MOTION_S[0]:
        raise ConfigError(f"--seconds is {seconds:g}; allowed on drives: {MOTION_S[0]:g} to {MOTION_S[1]:g} s.")
    if files.keep is not None:
        refuse_other_than_participant(files.keep)
    live = LiveOptions(
        rig=worn.rig, side=worn.side, level=worn.level, world=worn.world, seed=worn.seed, drives=worn.drives,
        simulate=worn.simulate, real_time=worn.real_time, calibration=worn.calibration, seconds=FLOATS_S,
        identify_s=seconds,
    )  # fmt: skip
    procedure = Procedure("arm identify", files=files)
    run = fly_on_drives(live, person, folder, progress, say, wearer, procedure)
    predicted, kept = run.flown.predicted, run.figures.person
    return IdentifiedOnDrives(
        ok=run.flown.learned is not None and not isinstance(kept, NotKept),
        from_file=run.from_file,
        predicted_left_over_Nm=None if predicted is None else rounded(predicted),
        person=kept,
        live=run.figures,
    )
