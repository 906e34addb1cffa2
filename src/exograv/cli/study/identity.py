"""Command `exograv study identity`: identities behind codes, in an encrypted file outside the study."""

import getpass
import json
import os
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from exograv.errors import ConfigError

PASSPHRASE = "EXOGRAV_IDENTITIES_PASSPHRASE"
"""Environment variable with the passphrase."""

FIELDS = ("name", "contact", "note")
"""Fields that the command asks for at the terminal."""


@dataclass(frozen=True)
class Identity:
    """Options of `exograv study identity`."""

    study: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Folder of the study."""

    action: Annotated[Literal["add", "show", "list", "remove"], tyro.conf.Positional] = "list"
    """Action on the identities."""

    code: Annotated[str | None, tyro.conf.Positional] = None
    """Code of the participant."""

    identities: Path | None = None
    """Encrypted file; by default the file beside the study's folder that has its name."""

    key_file: Path | None = None
    """File with the passphrase. Otherwise it is read from EXOGRAV_IDENTITIES_PASSPHRASE, or asked for."""


def run_identity(command: Identity) -> dict[str, Any]:
    """Store names behind codes. Personal data come from the terminal or standard input, never from the command line."""
    from exograv.study.folder.settings import read_settings
    from exograv.study.folder.study_folder import StudyFolder
    from exograv.study.participants.codes import typed_code
    from exograv.study.participants.identities import changed_identities, read_identities
    from exograv.study.participants.register import read_register

    folder = StudyFolder(command.study)
    read_settings(folder)
    place = folder.path.absolute()
    # The whole name counts: studies called flight.2026 and flight.2027 have different files.
    path = command.identities or place.with_name(f"{place.name}.identities")
    passphrase = _passphrase(command.key_file)
    known = read_identities(path, passphrase) if path.exists() or command.action != "add" else {}
    if command.action == "list":
        print("\n".join([*sorted(known), f"{len(known)} identities"]))
        return {"codes": sorted(known)}
    if command.code is None:
        raise ConfigError(f"The code is missing: exograv study identity STUDY {command.action} CODE.")
    code = typed_code(command.code)
    if command.action == "show":
        who = _of(known, code)
        print("\n".join(f"{name}: {value}" for name, value in who.items()))
        return {"participant": code}
    if command.action == "remove":
        with changed_identities(path, passphrase) as known:
            _of(known, code)
            del known[code]
        print(f"The identity of {code} is removed from this file. Copies of the file elsewhere still have it.")
        return {"participant": code}
    if code not in {row.code for row in read_register(folder)}:
        raise ConfigError(f"{code} is not in the study. `exograv study participant STUDY new` draws a code.")
    _refuse_known(known, code)
    who = _asked()
    # Meanwhile another command may have added an identity: the file is read again under its lock.
    with changed_identities(path, passphrase) as known:
        _refuse_known(known, code)
        known[code] = who
    print(f"The identity is stored in {path}. Keep this file and its passphrase apart from the study.")
    return {"participant": code}


def _refuse_known(known: dict[str, dict[str, str]], code: str) -> None:
    if code in known:
        raise ConfigError(f"{code} has an identity already. Remove it first if it is wrong.")


def _of(known: dict[str, dict[str, str]], code: str) -> dict[str, str]:
    if code not in known:
        raise ConfigError(f"{code} has no identity in this file.")
    return known[code]


def _asked() -> dict[str, str]:
    """Read an identity from the terminal, or as JSON from a script."""
    if sys.stdin.isatty():
        return {name: value for name in FIELDS if (value := input(f"{name}: ").strip())}
    try:
        told = json.loads(sys.stdin.read())
    except json.JSONDecodeError:
        told = None
    if not isinstance(told, dict) or not told or not all(isinstance(v, str) for v in told.values()):
        raise ConfigError('Standard input holds no identity. A script gives JSON: {"name": "…", "contact": "…"}.')
    return {str(name): value for name, value in told.items()}


def _passphrase(key_file: Path | None) -> str:
    if key_file is not None:
        try:
            return key_file.read_text(encoding="utf-8").strip()
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigError(f"--key-file {key_file} cannot be read as text. Give another file.") from error
    if passphrase := os.environ.get(PASSPHRASE):
        return passphrase
    if not sys.stdin.isatty():
        raise ConfigError(f"No passphrase: set {PASSPHRASE}, or give --key-file.")
    return getpass.getpass("Passphrase of the identities: ")
