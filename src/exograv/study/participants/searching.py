"""Search of a folder for words: in file names, in bytes, and in packed files (Parquet, MCAP, gzip, zip, PDF)."""

import contextlib
import gzip
import re
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from exograv.errors import RecordingError
from exograv.recording.contents import Contents, messages_in
from exograv.recording.file_content import read_content
from exograv.recording.schema import TICK

PIECE_BYTES = 1 << 22
RAW_MIN = 6
"""Letters that a word needs to be searched in packed bytes and inside longer words. A shorter word occurs there by
chance.
"""


def files_with(folder: Path, words: Sequence[str]) -> Iterator[tuple[Path, str]]:
    """Find files that contain one of these words, in upper or lower case, and say where.

    Args:
        folder: Folder of which all files are searched.
        words: Words to search for, such as codes.
    """
    sought = [word.encode() for word in words]
    for path in sorted(folder.rglob("*")):
        if _is_in(str(path.relative_to(folder)).encode(), sought):
            yield path, "name"
        elif path.is_file() and (where := _where(path, sought)):
            yield path, where


def has_word(text: str, words: Sequence[str]) -> bool:
    """Return True if one of the words occurs in the text."""
    return _is_in(text.encode(), [word.encode() for word in words])


def _where(path: Path, words: Sequence[bytes]) -> str | None:
    """Return where in the file one of the words occurs."""
    is_packed = path.suffix.lower() in UNPACKED
    if _is_in_pieces(_raw(path), [word for word in words if len(word) >= RAW_MIN or not is_packed]):
        return "bytes"
    if is_packed:
        try:
            if _is_in_pieces(UNPACKED[path.suffix.lower()](path), words):
                return "packed content"
        except (OSError, RecordingError, zlib.error, EOFError, zipfile.BadZipFile, pa.ArrowException):
            return None  # The file cannot be unpacked, but its bytes were searched.
    return None


def _is_in_pieces(pieces: Iterable[bytes], words: Sequence[bytes]) -> bool:
    longest, before = max(map(len, words), default=1), b""
    for piece in pieces:
        if _is_in(before + piece, words):
            return True
        before = piece[-longest:]
    return False


def _is_in(content: bytes, words: Sequence[bytes]) -> bool:
    # Codes consist of upper-case letters and digits; a file name may have been converted to lower case.
    return any(_stands(form, content) for word in words for form in {word, word.lower()})


def _stands(word: bytes, content: bytes) -> bool:
    if word not in content:
        return False
    # A short word such as A1 occurs in many numbers, so it has to stand alone.
    alone = rb"(?<![0-9A-Za-z])" + re.escape(word) + rb"(?![0-9A-Za-z])"
    return len(word) >= RAW_MIN or re.search(alone, content) is not None


def _raw(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while piece := file.read(PIECE_BYTES):
            yield piece


def _parquet(path: Path) -> Iterator[bytes]:
    file = pq.ParquetFile(path)
    yield str(file.schema_arrow).encode() + b"\n".join(
        b"%s=%s" % pair for pair in (file.metadata.metadata or {}).items()
    )
    # Only numeric columns are left out. The kind of a text or list column depends on the program that wrote the file.
    texts = [field.name for field in file.schema_arrow if not pa.types.is_primitive(field.type)]
    for batch in file.iter_batches(columns=texts) if texts else ():
        for column in batch.columns:
            yield "\n".join({str(value) for value in column.to_pylist()}).encode()


def _mcap(path: Path) -> Iterator[bytes]:
    with read_content(path) as content:
        for topic, data in messages_in(content, Contents()):
            if topic != TICK.topic:
                yield data


def _gzip(path: Path) -> Iterator[bytes]:
    with gzip.open(path) as file:
        while piece := file.read(PIECE_BYTES):
            yield piece


def _zip(path: Path) -> Iterator[bytes]:
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            yield name.encode()
            with archive.open(name) as file:
                while piece := file.read(PIECE_BYTES):
                    yield piece


def _pdf(path: Path) -> Iterator[bytes]:
    for found in re.finditer(rb"stream\r?\n(.*?)\r?\nendstream", path.read_bytes(), re.DOTALL):
        unpacker, packed = zlib.decompressobj(), found[1]
        with contextlib.suppress(zlib.error):
            while packed:  # in pieces: a small stream can unpack to more than the memory
                yield unpacker.decompress(packed, PIECE_BYTES)
                packed = unpacker.unconsumed_tail


UNPACKED: dict[str, Callable[[Path], Iterator[bytes]]] = {
    ".parquet": _parquet,
    ".mcap": _mcap,
    ".gz": _gzip,
    ".xdfz": _gzip,
    ".svgz": _gzip,
    ".zip": _zip,
    ".pdf": _pdf,
}
"""Readers of packed files by suffix. Files with other suffixes are searched as they are."""
