"""Selection of rows and columns of tables, with types that a type checker knows (pandas alone returns a union)."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import pandas as pd


def rows(table: pd.DataFrame, is_chosen: Any) -> pd.DataFrame:
    """Select the rows of a table for which the condition is true."""
    return cast(pd.DataFrame, table[is_chosen])


def column(table: pd.DataFrame, name: str) -> pd.Series:
    """Return one column of a table as a series."""
    return cast(pd.Series, table[name])


def columns(table: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
    """Return several columns of a table as a table."""
    return cast(pd.DataFrame, table[list(names)])


def middle(table: pd.DataFrame, name: str) -> float:
    """Return the median of a column without NA; NaN for an empty column."""
    known = column(table, name).dropna().to_numpy(float)
    return float(np.median(known)) if len(known) else float("nan")


def people(table: pd.DataFrame) -> int:
    """Return the number of different participants."""
    return len(set(column(table, "participant")))


def keys(table: pd.DataFrame, names: Sequence[str]) -> list[tuple[Any, ...]]:
    """Return one tuple per row."""
    return list(zip(*(column(table, name).tolist() for name in names), strict=True))
