"""Stream of an XDF file, as LabRecorder writes them, with the stamps that pyxdf has synchronised."""

import contextlib
import gzip
import logging
import warnings
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyxdf

from exograv.errors import RecordingError

NOT_THERE = "No matching streams"
"""Part of pyxdf's message for a sound file that has other streams only."""

MARK = b"XDF:"

UNPACKED_BYTES_MAX, PIECE_BYTES = 1_000_000_000, 1 << 22
"""Largest size of an unpacked `.xdfz` file [byte], and of the pieces in which it is measured.

A file of a few megabytes can unpack to more than the memory. An hour of 64 channels at 1 kHz takes 1 GB.
"""


@dataclass(frozen=True)
class XdfStream:
    """Stream of one device."""

    name: str
    stamps: np.ndarray
    """Stamps on the clock of the recording computer [s]."""

    values: Sequence[Any]
    """Row of values per sample."""

    labels: tuple[str, ...]
    """Labels of the channels; empty if the device states none."""

    units: tuple[str, ...]
    rate_Hz: float
    """Nominal rate [Hz]; 0 for events."""


class _Counting(logging.Handler):
    """Log handler that counts the warnings of pyxdf. Their text is dropped, because it may hold names of streams."""

    count = 0

    def emit(self, record: logging.LogRecord) -> None:
        self.count += 1


def load_stream(path: Path, name: str, otherwise: str) -> tuple[XdfStream, int]:
    """Load one stream, and count the reader's warnings.

    Args:
        path: The file.
        name: Name of the stream.
        otherwise: Advice if the file does not hold exactly one such stream.

    Raises:
        RecordingError: The file is not XDF, is too large, or does not hold exactly one such stream with samples.
    """
    _refuse_too_large(path)
    counting, log = _Counting(logging.WARNING), logging.getLogger("pyxdf")
    log.addHandler(counting)
    propagates, log.propagate = log.propagate, False
    try:
        _refuse_other(path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            streams, _ = pyxdf.load_xdf(
                str(path), select_streams=[{"name": name}], dejitter_timestamps=False, synchronize_clocks=True
            )
    except ValueError as error:
        if NOT_THERE not in str(error):
            raise _unreadable(name, error) from None
        streams = []
    except Exception as error:  # noqa: BLE001  pyxdf lets whatever a damaged file provokes through
        raise _unreadable(name, error) from None
    finally:
        log.removeHandler(counting)
        log.propagate = propagates
    if len(streams) != 1 or not len(streams[0]["time_stamps"]):
        raise RecordingError(
            f"{len(streams)} streams in the file are named '{name}'; exactly one with samples is needed. {otherwise}"
        )
    info = streams[0]["info"]
    rate = float((info.get("nominal_srate") or ["0"])[0] or 0.0)
    stamps, values = np.array(streams[0]["time_stamps"]), list(streams[0]["time_series"])
    stated = (_stated(info, "label"), _stated(info, "unit"))
    return XdfStream(name, stamps, values, *stated, rate), counting.count


def _refuse_too_large(path: Path) -> None:
    """Refuse a packed file that would take the whole memory.

    Raises:
        RecordingError: The file is larger than `UNPACKED_BYTES_MAX` when it is unpacked.
    """
    if path.suffix.lower() != ".xdfz":
        return
    size = 0
    with contextlib.suppress(OSError, EOFError, zlib.error), gzip.open(path) as file:
        while size <= UNPACKED_BYTES_MAX and (piece := file.read(PIECE_BYTES)):
            size += len(piece)
    if size > UNPACKED_BYTES_MAX:
        raise RecordingError(
            f"The file holds more than {1e-9 * UNPACKED_BYTES_MAX:g} GB when it is unpacked. Save the stream of the "
            "touches without the others, and add that file."
        )


def _refuse_other(path: Path) -> None:
    """Refuse other files before pyxdf opens them: pyxdf does not close a file that it refuses."""
    with gzip.open(path) if path.suffix.lower() == ".xdfz" else path.open("rb") as file:
        if file.read(len(MARK)) != MARK:
            raise ValueError("The file does not begin with the mark of XDF.")


def _unreadable(name: str, error: Exception) -> RecordingError:
    kind = type(error).__name__
    return RecordingError(
        f"The file is not XDF with a readable stream '{name}' ({kind}). Try another copy of the file."
    )


def _stated(info: Mapping[str, Any], what: str) -> tuple[str, ...]:
    """Return one entry of the description of each channel."""
    try:
        channels = info["desc"][0]["channels"][0]["channel"]
        return tuple(str((channel.get(what) or [""])[0]) for channel in channels)
    except (KeyError, IndexError, TypeError, AttributeError):
        return ()
