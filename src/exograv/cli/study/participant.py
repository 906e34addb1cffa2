"""Command `exograv study participant`: participants of a study by code."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from exograv.errors import ConfigError
from exograv.options import Acts
from exograv.results import json_value

if TYPE_CHECKING:
    from exograv.study.folder.study_folder import StudyFolder


NEW = Acts(lambda all_: all_.action == "new", "with the action `new`")
UNSEALED = Acts(lambda all_: all_.action == "unseal", "with the action `unseal`")
ERASED = Acts(lambda all_: all_.action == "erase", "with the action `erase`")


@dataclass(frozen=True)
class Participant:
    """Options of `exograv study participant`."""

    study: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Folder of the study."""

    action: Annotated[Literal["new", "list", "unseal", "erase"], tyro.conf.Positional] = "list"
    """Action on the participants."""

    code: Annotated[str | None, tyro.conf.Positional] = None
    """Code of the participant to erase; for `new` a code of an allocation that was drawn before."""

    group: Annotated[str, NEW] = "sealed"
    """Group of the study for a new participant."""

    consent: Annotated[str | None, NEW] = None
    """Version of the signed consent."""

    age: Annotated[float | None, NEW] = None
    """Age [years]. Age, height and mass are stored as bands of ten."""

    height: Annotated[float | None, NEW] = None
    """Body height [cm]."""

    mass: Annotated[float | None, NEW] = None
    """Body mass [kg]."""

    sex: Annotated[Literal["f", "m", "x"] | None, NEW] = None
    """Sex, as stated by the participant."""

    hand: Annotated[Literal["right", "left", "both"] | None, NEW] = None
    """Handedness, as stated by the participant."""

    allocation: Annotated[Path | None, UNSEALED] = None
    """File with the sealed list of groups, for `unseal`."""

    confirm: Annotated[str | None, ERASED] = None
    """Repetition of the code, for scripts that erase."""


def run_participant(command: Participant) -> dict[str, Any]:
    """Add a participant, list all, unseal the groups, or erase a participant with a proof."""
    from exograv.study.folder.study_folder import StudyFolder

    actions: dict[str, Callable[[Participant, StudyFolder], dict[str, Any]]] = {
        "new": _new,
        "list": _list,
        "unseal": _unseal,
        "erase": _erase,
    }
    return actions[command.action](command, StudyFolder(command.study))


def _new(command: Participant, folder: "StudyFolder") -> dict[str, Any]:
    from exograv.study.dataset.making import refresh
    from exograv.study.folder.journal import alone, note
    from exograv.study.participants.participant_record import band
    from exograv.study.participants.register import new_participant

    told = {
        "consent": command.consent,
        "age_band": band("age", command.age),
        "sex": command.sex,
        "height_band_cm": band("height", command.height),
        "mass_band_kg": band("mass", command.mass),
        "handedness": command.hand,
    }
    with alone(folder):
        row = new_participant(folder, command.group, command.code, **told)
        refresh(folder)
        note(folder, "new participant", f"Participant {row.code}.", participant=row.code)
    print(row.code)
    return {"participant": row.code}


def _list(_command: Participant, folder: "StudyFolder") -> dict[str, Any]:
    from exograv.study.folder.settings import read_settings
    from exograv.study.participants.register import read_register

    read_settings(folder)
    rows = read_register(folder)
    for row in rows:
        print(f"{row.code}  {row.group}  consent {row.consent or 'not told'}")
    print(f"{len(rows)} participants")
    return {"participants": [row.model_dump() for row in rows]}


def _unseal(command: Participant, folder: "StudyFolder") -> dict[str, Any]:
    from exograv.study.dataset.making import refresh
    from exograv.study.dataset.unsealing import unseal
    from exograv.study.folder.journal import alone, note

    if command.allocation is None:
        raise ConfigError("--allocation is missing: give the list of groups that was drawn before the study.")
    with alone(folder):
        codes = unseal(folder, command.allocation)
        refresh(folder)
        note(folder, "unsealed", f"Groups of {len(codes)} participants are open.")
    print(f"Groups of {len(codes)} participants are open.")
    return {"unsealed": list(codes)}


def _erase(command: Participant, folder: "StudyFolder") -> dict[str, Any]:
    from exograv.study.dataset.erasing import erase
    from exograv.study.participants.codes import typed_code

    if command.code is None:
        raise ConfigError("The code is missing: exograv study participant STUDY erase CODE.")
    code = typed_code(command.code)
    again = command.confirm
    if again is None:
        if not sys.stdin.isatty():
            raise ConfigError(
                "Standard input is not a terminal, so the erasure cannot be confirmed. In a script give --confirm CODE."
            )
        again = input(f"All data of {code} in the study will be erased for good. Type the code to continue: ")
    if again.strip().upper() != code:
        raise ConfigError("The typed text is not the code. Nothing was erased.")
    receipt = erase(folder, code)
    print(receipt.sentence)
    return json_value(receipt) | {"ok": receipt.is_proved}
