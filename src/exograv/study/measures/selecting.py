"""Rows and columns of tables, each with one type: what pandas selects may be anything, for all a type checker knows."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import pandas as pd


def rows(table: pd.DataFrame, is_chosen: Any) -> pd.DataFrame:
    """Of a table, those for which this is true."""
    return cast(pd.DataFrame, table[is_chosen])


def column(table: pd.DataFrame, name: str) -> pd.Series:
    """One column."""
    return cast(pd.Series, table[name])


def columns(table: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
    """Some columns."""
    return cast(pd.DataFrame, table[list(names)])


def middle(table: pd.DataFrame, name: str) -> float:
    """Median of a column, without what is NA; NaN of none."""
    known = column(table, name).dropna().to_numpy(float)
    return float(np.median(known)) if len(known) else float("nan")


def people(table: pd.DataFrame) -> int:
    """Different participants."""
    return len(set(column(table, "participant")))


def keys(table: pd.DataFrame, names: Sequence[str]) -> list[tuple[Any, ...]]:
    """One tuple a row."""
    return list(zip(*(column(table, name).tolist() for name in names), strict=True))
