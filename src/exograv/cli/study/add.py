"""`exograv study add`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.cli.shell.base_options import Common
from exograv.errors import ConfigError


@dataclass(frozen=True)
class Add(Common):
    """Add recordings, CSV files of touches, XDF files, or folders of them."""

    study: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Folder of the study."""

    files: Annotated[tuple[Path, ...], tyro.conf.Positional] = ()
    """What is to be added."""

    participant: str | None = None
    """Code, where the files do not say it."""

    protocol: str | None = None
    """Its name, where the files do not say it."""

    session: int | None = None
    """Which one of this protocol it is, where the files do not say it."""

    acquired: str | None = None
    """Date and time, ISO 8601: recordings hold none."""

    new_code: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """OLD=CODE, for files that were made under another code; once for each."""

    gravity_level: float | None = None
    """Felt share of the arm's weight, for touches that say none."""

    mapping: Path | None = None
    """TOML file that says where touches are in XDF of somebody else."""

    replace: bool = False
    """A session that is there already is put aside in quarantine."""


def run_add(command: Add) -> dict[str, Any]:
    """Add them."""
    from exograv.study.dataset.adding import AddOptions, add_files, worst
    from exograv.study.folder.settings import read_toml
    from exograv.study.folder.study_folder import StudyFolder
    from exograv.study.importers.imported_session import Said
    from exograv.study.importers.xdf_mapping import XdfMapping
    from exograv.study.participants.codes import typed_code

    if not command.files:
        raise ConfigError("No file was named. Give recordings, CSV or XDF files, or folders of them, after the study.")
    said = Said(
        None if command.participant is None else typed_code(command.participant), command.protocol, command.session
    )
    mapping = None if command.mapping is None else read_toml(command.mapping, XdfMapping)
    options = AddOptions(
        said, command.acquired, _new_codes(command.new_code), command.gravity_level, mapping, command.replace
    )
    outcomes = add_files(StudyFolder(command.study), command.files, options)
    counts = dict[str, int]()
    for one in outcomes:
        counts[one.what] = counts.get(one.what, 0) + 1
        if one.what != "ignored":
            print(f"{one.file}: {one.what}. {one.sentence}" + (f" {one.remark}" if one.remark else ""))
    print(", ".join(f"{count} {what}" for what, count in counts.items()) or "Nothing was found.")
    files = [
        {"file": one.file, "what": one.what, "sentence": one.sentence, "remark": one.remark}
        | ({} if one.key is None else one.key._asdict())
        for one in outcomes
    ]
    return {"counts": counts, "files": files, "ok": not worst(outcomes)}


def _new_codes(pairs: tuple[str, ...]) -> dict[str, str]:
    from exograv.study.participants.codes import typed_code

    codes = dict[str, str]()
    for pair in pairs:
        old, equals, new = pair.partition("=")
        if not (old and equals):
            raise ConfigError("--new-code takes OLD=CODE, such as P-02=K7MR4XX.")
        codes[old] = typed_code(new)
    return codes
