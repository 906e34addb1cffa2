"""Comparison of a value that a drive or controller reports with the value in `drives.toml`."""

import math

from exograv.errors import ConfigError

SAME = 1e-3
"""Relative tolerance: a four-byte float, or a number with six printed digits, equals the number in the file."""


def refuse_other_value(what: str, said: float, key: str, stated: float, unit: str, tolerance: float = SAME) -> None:
    """Refuse a drive whose reported value differs from the file.

    Args:
        what: Quantity, and the drive or joint that it belongs to.
        said: Value that the drive reports.
        key: Key in `drives.toml`.
        stated: Value in `drives.toml`.
        unit: Unit of both values.
        tolerance: Relative tolerance.

    Raises:
        ConfigError: The values differ; the message names both.
    """
    if not math.isclose(said, stated, rel_tol=tolerance):
        raise ConfigError(
            f"The {what} is {said:g} {unit} in its own settings, and {key} in drives.toml is {stated:g} {unit}. Find "
            "the right value in the data sheet and correct the other one; no motor was switched on."
        )
