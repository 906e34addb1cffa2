"""Command `exograv study add`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.errors import ConfigError
from exograv.study.dataset.options import AddOptions


@dataclass(frozen=True)
class Files:
    """Study, and files to add."""

    study: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Folder of the study."""

    files: Annotated[tuple[Path, ...], tyro.conf.Positional] = ()
    """Files or folders to add."""


def run_add(given: Files, options: AddOptions) -> dict[str, Any]:
    """Add recordings, CSV files of touches, XDF files, or folders of them."""
    from exograv.cli.shell.progress import FIRST_LINE_S, bars
    from exograv.study.dataset.adding import add_files, worst
    from exograv.study.folder.study_folder import StudyFolder

    if not given.files:
        raise ConfigError("No file was named. Give recordings, CSV or XDF files, or folders of them, after the study.")
    with bars(FIRST_LINE_S) as progress:
        progress("Adding files to the study", 0.0)
        outcomes = add_files(StudyFolder(given.study), given.files, options)
    counts = dict[str, int]()
    for one in outcomes:
        counts[one.what] = counts.get(one.what, 0) + 1
        if one.what != "ignored":
            print(f"{one.file}: {one.what}. {one.sentence}" + (f" {one.remark}" if one.remark else ""))
    print(", ".join(f"{count} {what}" for what, count in counts.items()) or "No file was found.")
    if counts.keys() == {"ignored"}:
        print(outcomes[0].sentence)
    files = [
        {"file": one.file, "what": one.what, "sentence": one.sentence, "remark": one.remark}
        | ({} if one.key is None else one.key._asdict())
        for one in outcomes
    ]
    return {"counts": counts, "files": files, "ok": not worst(outcomes)}
