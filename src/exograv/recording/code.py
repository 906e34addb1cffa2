"""Which state of exograv has written a file: two states may have the same version."""

import hashlib
from functools import cache
from pathlib import Path

import exograv


@cache
def code_sha256() -> str:
    """Of every module of exograv."""
    folder, digest = Path(exograv.__file__).parent, hashlib.sha256()
    for path in sorted(folder.glob("**/*.py")):
        digest.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return digest.hexdigest()
