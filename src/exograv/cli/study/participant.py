"""`exograv study participant`: who takes part, by code."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from exograv.errors import ConfigError
from exograv.results import json_value

if TYPE_CHECKING:
    from exograv.study.folder.study_folder import StudyFolder


@dataclass(frozen=True)
class Participant:
    """Options of `exograv study participant`."""

    study: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Folder of the study."""

    action: Annotated[Literal["new", "list", "unseal", "erase"], tyro.conf.Positional] = "list"
    """What to do."""

    code: Annotated[str | None, tyro.conf.Positional] = None
    """Of whom to erase; for `new` a code of an allocation that was drawn before."""

    group: str = "sealed"
    """One of the study's."""

    consent: str | None = None
    """Version of the consent that was signed."""

    age: float | None = None
    """Years; kept as a band of ten, like height and mass."""

    height: float | None = None
    """Centimetres."""

    mass: float | None = None
    """Kilograms."""

    sex: Literal["f", "m", "x"] | None = None
    """As told."""

    hand: Literal["right", "left", "both"] | None = None
    """Handedness, as told."""

    allocation: Path | None = None
    """List of groups under seals, for `unseal`."""

    confirm: str | None = None
    """The code once more: for scripts that erase."""


def run_participant(command: Participant) -> dict[str, Any]:
    """New participants, a list of all, unsealed groups, and erasing somebody provably."""
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
        "height_band_cm": band("height_cm", command.height),
        "mass_band_kg": band("mass_kg", command.mass),
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
        raise ConfigError("--allocation is missing: the list of groups that was drawn before the study.")
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
            raise ConfigError("Nobody is there to confirm it. A script says --confirm CODE.")
        again = input(f"All that the study has of {code} goes, and does not come back. Type the code to go on: ")
    if again.strip().upper() != code:
        raise ConfigError("What was typed is not the code. Nothing was erased.")
    receipt = erase(folder, code)
    print(receipt.sentence)
    return json_value(receipt) | {"ok": receipt.is_proved}
