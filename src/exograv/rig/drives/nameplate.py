"""A value that a drive or its controller says of itself is held against `drives.toml`."""

import math

from exograv.errors import ConfigError

SAME = 1e-3
"""Relative tolerance: a float of four bytes, or six printed places, is the same number as the file's."""


def refuse_other_value(what: str, said: float, key: str, stated: float, unit: str, tolerance: float = SAME) -> None:
    """Refuse a drive that is not what the file says.

    Args:
        what: Quantity and whose it is.
        said: By the drive.
        key: Of `drives.toml`.
        stated: There.
        unit: Of both.
        tolerance: Relative.

    Raises:
        ConfigError: They differ; names both values.
    """
    if not math.isclose(said, stated, rel_tol=tolerance):
        raise ConfigError(
            f"The {what} is {said:g} {unit} by its own settings, and {key} in drives.toml is {stated:g} {unit}. Find "
            "out which is right by the data sheet and correct the other; nothing was switched on."
        )
