"""File of a participant: written completely or not at all, sealed by a hash, refused where it does not belong."""

import secrets
from datetime import datetime
from pathlib import Path

from exograv.errors import ConfigError
from exograv.identification.core.interface import Outcome
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly

from .calibration_file import CLOCK_ERROR, identity_of, refuse_other_machine
from .participant_schema import StoredParticipant, StoredPerson, parameter_names
from .sealed_file import read_sealed, refuse_other_kind, write_sealed

AGAIN = "Identify the person again: `exograv arm identify --keep FILE`."
GIVE = "Give a file that `exograv arm identify --keep FILE` has written."
HEAD = """\
# One participant in one machine, written by `exograv arm identify --keep` (docs/howto/participants.md). `covariance`
# of a parameter is with the parameters before it and with itself. Personal data: protect this file like the key to the
# codes. Do not edit: a changed file is refused.
"""
HEIGHT_M, MASS_KG, LENGTH_M = 0.03, 6.0, 0.02
"""Largest differences of body data from the file's (assumed).

Scales and tapes differ from one day to the next, and a person's mass also changes between sessions.
"""


def new_code() -> str:
    """Return a random code of six digits that tells nothing about the person."""
    return f"P-{secrets.randbelow(1_000_000):06d}"


def write_participant(path: Path, whole: StoredParticipant) -> None:
    """Write the file, or leave the old one as it was.

    Raises:
        ConfigError: The file cannot be written.
    """
    write_sealed(path, whole, HEAD, "--keep")


def refuse_other_than_participant(path: Path, option: str = "--keep") -> None:
    """Check before a run that its participant's file will not replace another kind of file. `option` sets its place.

    Raises:
        ConfigError: There is a file of another kind.
    """
    refuse_other_kind(path, StoredParticipant, HEAD, option)


def read_participant(path: Path) -> StoredParticipant:
    """Read a participant's file.

    Raises:
        ConfigError: The file cannot be read, is of another version, or its values do not match its hash.
    """
    whole = read_sealed(path, StoredParticipant, GIVE, AGAIN)
    for i, row in enumerate(whole.parameters):
        if len(row.covariance) != i + 1:
            raise ConfigError(
                f"{path} is damaged: {row.name} has {len(row.covariance)} covariances, not {i + 1}. {AGAIN}"
            )
    return whole


def refuted_text(whole: StoredParticipant) -> str:
    """State that the check of the stored estimate disagreed, and what the session does about it; "" if it did not."""
    how = whole.identified
    if how.outcome != Outcome.DISAGREES.value:
        return ""
    return (
        f"The stored estimate of {whole.person.code} ({how.at_utc:%Y-%m-%d %H:%M} UTC) disagreed with its check at "
        "unused postures, so it is not used: the arm is identified from the body table, with a new check."
    )


def refuse_other(path: Path, whole: StoredParticipant, assembly: Assembly, machine: str, now: datetime) -> None:
    """Refuse a file of another machine, side or arm, or from the future.

    Raises:
        ConfigError: The file does not belong to this machine or arm, or is from the future.
    """
    present = identity_of(assembly.description, machine)
    refuse_other_machine(path, whole.machine, present, f"Give a file of this machine with --participant. {AGAIN}")
    names = parameter_names(assembly)
    if [row.name for row in whole.parameters] != names:
        raise ConfigError(f"{path} has other parameters than the {len(names)} of this arm. {AGAIN}")
    if whole.identified.at_utc - now > CLOCK_ERROR:
        raise ConfigError(
            f"{path} is from the future: identified at {whole.identified.at_utc:%Y-%m-%d %H:%M} UTC, now it is "
            f"{now:%Y-%m-%d %H:%M} UTC. Set the clock. {AGAIN}"
        )


def refuse_other_body(path: Path, whole: StoredParticipant, told: Body) -> None:
    """Refuse a file of a person of another size, before anything moves.

    Raises:
        ConfigError: The body data entered now differ from those in the file.
    """
    differs = other_body(whole.person, told)
    if differs is not None:
        raise ConfigError(f"{path} is of another person: {differs}. Give this person's own file, or none.")


def other_body(person: StoredPerson, told: Body) -> str | None:
    """Return the first measure that differs from the body data entered now; None if all are within tape and scale."""
    lengths = told.lengths_m or {}
    pairs = [
        ("height", "m", person.height_m, told.height_m, HEIGHT_M),
        ("mass", "kg", person.mass_kg, told.mass_kg, MASS_KG),
        *(
            (f"{name.replace('_', ' ')} length", "m", length, lengths.get(name, length), LENGTH_M)
            for name, length in person.lengths_m.items()
        ),
    ]
    for name, unit, stored, present, allowed in pairs:
        if abs(stored - present) > allowed:
            far = f"{name} {stored:g} {unit} in the file, {present:.4g} {unit} entered now"
            return f"{far}; up to {allowed:g} {unit} of difference is allowed"
    return None if person.sex == told.sex else f"{person.sex} in the file, {told.sex} entered now"
