"""Files of the machine that a recording holds."""

from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from exograv.errors import RecordingError


def unpacked_machine(path: Path, files: Mapping[str, str], folder: Path) -> Path:
    """Write the machine's files. Its folder lies so deep in `folder` that neighbouring folders are inside too.

    Args:
        path: The recording, for messages.
        files: Text of each file by its path in the machine's folder.
        folder: Existing folder to write in.

    Raises:
        RecordingError: A file would lie outside of `folder`.
    """
    names = {name: PurePosixPath(name) for name in files}
    ups = {name: sum(part == ".." for part in parts.parts) for name, parts in names.items()}
    for name, inside in names.items():
        if inside.is_absolute() or ".." in inside.parts[ups[name] :]:
            raise RecordingError(f"{path} holds a machine file outside of its folder: '{name}'. Do not use the file.")
    machine = folder.joinpath(*["machine"] * (max(ups.values(), default=0) + 1))
    machine.mkdir(parents=True)
    for name, text in files.items():
        place = machine / names[name]
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding="utf-8")
    return machine
