"""Hash of the code that writes a file; two states of the code may have the same version."""

import hashlib
from functools import cache
from pathlib import Path

import exograv


@cache
def code_sha256() -> str:
    """SHA-256 of all modules of exograv."""
    folder, digest = Path(exograv.__file__).parent, hashlib.sha256()
    for path in sorted(folder.glob("**/*.py")):
        digest.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return digest.hexdigest()
