"""Numbers, flags and names of an OpenSim file."""

from collections.abc import Sequence
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float

from exograv.errors import ModelError

LARGEST = 1e9
"""Largest absolute value of a number: beyond any length, mass or range, and without overflow in products."""


def text(element: Element, tag: str) -> str:
    """Return the text of a child, without blanks at its ends; empty if the child is absent."""
    return (element.findtext(tag) or "").strip()


def flag(element: Element, tag: str) -> bool:
    """Return True if the child says `true`."""
    return text(element, tag).lower() == "true"


def numbers(
    element: Element, tag: str, where: str, count: int | None, absent: Sequence[float] | None = None
) -> Float[np.ndarray, " n"]:
    """Return the numbers of a child.

    Args:
        element: Element with the child.
        tag: Name of the child.
        where: Place of the element, for the message.
        count: How many numbers it must have; any if None.
        absent: Numbers if the child is absent or empty; refused if None.

    Raises:
        ModelError: The child has other things than finite numbers, or another count of them.
    """
    words = text(element, tag).split()
    if not words and absent is not None:
        return np.array(absent, dtype=float)
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        values = np.array([np.nan])
    if not np.all(np.abs(values) <= LARGEST) or len(values) != (len(values) or 1 if count is None else count):
        wanted = "finite numbers" if count is None else "one finite number" if count == 1 else f"{count} finite numbers"
        raise ModelError(f"{where}: {tag} is '{' '.join(words)[:60]}'; it must be {wanted}. Correct it there.")
    return values
