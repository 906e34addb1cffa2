"""Encrypted file with the identity behind each code, stored apart from the study.

Format: a line that names the format, a line of JSON with the parameters, then the content, encrypted and authenticated
by AES-256-GCM with a key that scrypt derives from a passphrase. The two lines are authenticated too. The content is
JSON, padded to whole blocks, so that its length reveals little.
"""

import json
import secrets
from base64 import b64decode, b64encode
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Literal

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from cryptography.hazmat.primitives.kdf.scrypt import Scrypt
from pydantic import Field, ValidationError

from exograv.errors import ConfigError
from exograv.files import write_whole
from exograv.model.rig_settings import Settings
from exograv.study.folder.journal import LOCK, locked

MARK = b"exograv identities 1\n"
COST = 2**17
"""Cost parameter N of scrypt: 128 MB and some tenths of a second for each guess. Source: OWASP Password Storage,
N = 2^17, r 8, p 1.
"""

BLOCK_BYTES = 4096
PASSPHRASE_MIN = 12
"""Least number of characters of a passphrase. Shorter passphrases can be guessed."""

Identities = Mapping[str, Mapping[str, str]]
"""Identities by code: name, contact and further entries."""


class _Header(Settings):
    kdf: Literal["scrypt"] = "scrypt"
    n: Annotated[int, Field(ge=2**10, le=2**20)] = COST
    """Cost parameter N of scrypt. A larger value would need more memory than a laptop has."""

    r: Annotated[int, Field(ge=8, le=8)] = 8
    p: Annotated[int, Field(ge=1, le=1)] = 1
    salt: Annotated[str, Field(max_length=64)]
    cipher: Literal["AES-256-GCM"] = "AES-256-GCM"
    nonce: Annotated[str, Field(max_length=64)]


def write_identities(path: Path, passphrase: str, identities: Identities, cost: int = COST) -> None:
    """Encrypt the identities with a fresh salt and nonce; only the file's owner can read the file.

    Raises:
        ConfigError: The passphrase is too short.
        RecordingError: The file cannot be written.
    """
    if len(passphrase) < PASSPHRASE_MIN:
        raise ConfigError(f"The passphrase has {len(passphrase)} characters; at least {PASSPHRASE_MIN} are required.")
    salt, nonce = secrets.token_bytes(16), secrets.token_bytes(12)
    header = _Header(n=cost, salt=b64encode(salt).decode(), nonce=b64encode(nonce).decode())
    head = MARK + header.model_dump_json().encode() + b"\n"
    content = json.dumps({code: dict(who) for code, who in identities.items()}, ensure_ascii=False).encode()
    content += b" " * (-len(content) % BLOCK_BYTES)
    sealed = AESGCM(_key(passphrase, salt, cost)).encrypt(nonce, content, head)
    write_whole(path, head + sealed, is_private=True)


@contextmanager
def changed_identities(path: Path, passphrase: str) -> Iterator[dict[str, dict[str, str]]]:
    """Lock the file, read it, and write it again as the caller has changed it; an error leaves the file as it was.

    Raises:
        ConfigError: Another command is changing the file, or it cannot be read; see `read_identities`.
        RecordingError: The file cannot be written.
    """
    busy = f"Another exograv command is changing {path}. Try again when that command has ended."
    path.parent.mkdir(parents=True, exist_ok=True)
    with locked(path.parent, busy, path.name + LOCK):
        known = read_identities(path, passphrase) if path.exists() else {}
        yield known
        write_identities(path, passphrase, known)


def read_identities(path: Path, passphrase: str) -> dict[str, dict[str, str]]:
    """Decrypt the identities.

    Raises:
        ConfigError: There is no such file, the file is damaged, or the passphrase is wrong.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}. Give it with --identities.") from error
    mark, end = len(MARK), content.find(b"\n", len(MARK)) + 1
    if not content.startswith(MARK) or not end:
        raise ConfigError(f"{path} is not a file of identities of this version. Give the right file with --identities.")
    try:
        header = _Header.model_validate_json(content[mark:end])
        salt, nonce = b64decode(header.salt, validate=True), b64decode(header.nonce, validate=True)
        opened = AESGCM(_key(passphrase, salt, header.n)).decrypt(nonce, content[end:], content[:end])
    except InvalidTag:
        raise ConfigError(
            f"{path} cannot be decrypted: the passphrase is wrong, or the file was changed. The file was left as it is."
        ) from None
    except (ValidationError, ValueError):
        raise ConfigError(f"{path} is damaged in its first lines. Restore its last copy.") from None
    found: dict[str, Any] = json.loads(opened)
    return found


def _key(passphrase: str, salt: bytes, cost: int) -> bytes:
    return Scrypt(salt=salt, length=32, n=cost, r=8, p=1).derive(passphrase.encode())
