"""Folder of a fitted twin: a copy of the machine's own files."""

import shutil
from collections.abc import Iterator
from pathlib import Path

from exograv.errors import ConfigError
from exograv.model.description import RigDescription
from exograv.storage.twin_file import NAME

RECORDED = frozenset(
    {".mcap", ".csv", ".tsv", ".parquet", ".db3", ".html", ".json", ".jsonl", ".png", ".svg", ".pickle"}
)
"""Endings of recordings and reports, which do not describe a machine."""


def copy_machine(description: RigDescription, folder: Path) -> None:
    """Copy the folder of a machine, without its twin, recordings and reports.

    A URDF beside the machine's folder is copied beside `folder`, because the file and its name belong to the machine's
    hash.

    Raises:
        ConfigError: A URDF is farther away, or another file has its place.
    """
    source = description.folder
    if folder.exists() and folder.samefile(source):
        return
    into = folder.resolve()
    for path in _own_files(source, into):
        _copy(path, folder / path.relative_to(source))
    urdf = description.settings.urdf
    for name in (str(getattr(urdf, side)) for side in urdf.sides):
        path, to = source / name, (folder / name).resolve()
        if Path(name).is_absolute() or not path.is_file() or to.is_relative_to(into):
            continue
        if not to.is_relative_to(into.parent):
            raise ConfigError(
                f"{source / 'rig.toml'} names the URDF '{name}', which is too far from its folder to be copied with "
                "it. Put the URDF into the folder of rig.toml, and give its new name there."
            )
        if to.exists() and to.read_bytes() != path.read_bytes():
            raise ConfigError(f"The URDF '{name}' has to be copied to {to}, where another file is. Give another --out.")
        _copy(path, to)


def _own_files(source: Path, into: Path) -> Iterator[Path]:
    """Files of a machine's folder that describe it, without those of the folder that contains the copy."""
    for path in sorted(source.iterdir()):
        if path.name.startswith(".") or into.is_relative_to(path.resolve()):
            continue
        if path.is_dir():
            yield from _own_files(path, into)
        elif path.name != NAME and path.suffix.lower() not in RECORDED:
            yield path


def _copy(path: Path, to: Path) -> None:
    to.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(path, to)
