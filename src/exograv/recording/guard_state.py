"""State of a guard as the text of a message: 64-bit numbers, packed by zlib, in base 64."""

import base64
import binascii
import zlib

import numpy as np
from jaxtyping import Float

from exograv.errors import RecordingError

from .fields import Message

EVERY_S = 2.0
"""Time between two states of the guard in a recording [s]."""

MOST_NUMBERS = 100_000
"""Size above which no text is unpacked: far more than a guard of sixteen joints has."""


def guard_message(now: float, persons: int, version: int, numbers: Float[np.ndarray, " number"]) -> dict[str, object]:
    """Return a message of `/guard` without its time."""
    packed = base64.b64encode(zlib.compress(numbers.astype("<f8").tobytes(), 1)).decode()
    return {"now": now, "persons": persons, "version": f"{version:08x}", "state": packed}


def state_in(message: Message) -> Float[np.ndarray, " number"]:
    """Return the numbers in a message of `/guard`.

    Raises:
        RecordingError: They cannot be unpacked.
    """
    try:
        unpacking, packed = zlib.decompressobj(), base64.b64decode(message["state"], validate=True)
        data = unpacking.decompress(packed, 8 * MOST_NUMBERS)
        if unpacking.eof and len(data) % 8 == 0:
            return np.frombuffer(data, "<f8")
    except (binascii.Error, zlib.error):
        pass
    raise RecordingError(
        f"The state of the guard at {message['now']:.3f} s cannot be unpacked: the file is damaged. Use another copy."
    )
