"""Manifest with the SHA-256 of every file of a data set, in the format of `sha256sum --check`."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from exograv.study.dataset.sources import sha256_of

from .files import write_text
from .pages import TIDY

MANIFEST = TIDY / "manifest.sha256"


def files_of(root: Path) -> Iterator[str]:
    """Yield the paths of all files from the root, without the manifest itself."""
    for path in sorted(root.rglob("*")):
        name = path.relative_to(root).as_posix()
        if not path.is_dir() and name != MANIFEST.as_posix():
            yield name


def write_manifest(root: Path, known: Mapping[str, str]) -> dict[str, str]:
    """Hash every file, except those whose hash is known, and write the manifest."""
    found = {name: known.get(name) or sha256_of(root / name) for name in files_of(root)}
    write_text(root / MANIFEST, "".join(f"{sha256}  {name}\n" for name, sha256 in sorted(found.items())))
    return found


def read_manifest(root: Path) -> dict[str, str]:
    """Read the hashes by path; empty without a manifest."""
    path = root / MANIFEST
    if not path.is_file():
        return {}
    pairs = (line.partition("  ") for line in path.read_text(encoding="utf-8").splitlines())
    return {name: sha256 for sha256, _, name in pairs}
