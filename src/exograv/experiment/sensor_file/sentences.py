"""Sentences of a VectorNav sensor, in the manner of NMEA 0183: `$VNIMU,…*66` with a checksum and without a time.

Source: VectorNav VN-200 user manual, messages VNACC, VNIMU, VNYMR and VNMAR; acceleration in m/s², gravity included.
"""

from functools import reduce
from operator import xor

import numpy as np

from exograv.errors import RecordingError

from .series import STANDARD_GRAVITY, Series, checked

FIRST_FIELD = {"VNACC": 0, "VNIMU": 3, "VNMAR": 3, "VNYMR": 6}
"""Place of the acceleration along the first axis, by kind of sentence."""

MARK = "$VN"


def read_sentences(text: str, rate_Hz: float | None) -> Series:
    """Read the acceleration in recorded sentences.

    Raises:
        RecordingError: The rate is missing, or no sentence is sound.
    """
    if rate_Hz is None:
        raise RecordingError("The sentences of this sensor hold no time. Give their rate with --rate.")
    found = list[tuple[float, tuple[float, float, float]]]()
    refused = count = 0
    for line in text.splitlines():
        _, mark, sentence = line.partition("$")
        kind = sentence.partition(",")[0]
        if not mark or kind not in FIRST_FIELD:
            continue
        g = _acceleration(sentence, kind)
        # A damaged sentence keeps its place in time.
        if g is None:
            refused += 1
        else:
            found.append((count / rate_Hz, g))
        count += 1
    if not found:
        raise RecordingError(
            f"The file holds no sound sentence {', '.join(FIRST_FIELD)}; {refused} have a wrong checksum or no numbers."
        )
    t, g = zip(*found, strict=True)
    return checked(np.array(t), np.array(g), refused)


def _acceleration(sentence: str, kind: str) -> tuple[float, float, float] | None:
    """Return the acceleration [g] in a sentence without its `$`; None if the sentence is damaged."""
    content, star, check = sentence.strip().partition("*")
    try:
        if not star or reduce(xor, content.encode(), 0) != int(check, 16):
            return None
        first = FIRST_FIELD[kind] + 1
        x, y, z = (float(field) / STANDARD_GRAVITY for field in content.split(",")[first : first + 3])
    except ValueError:
        return None
    return x, y, z
