"""Files of a data set, with the same bytes for the same content: tab-separated tables, JSON, and rows of numbers."""

import gzip
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from jaxtyping import Float

MISSING = "n/a"
"""Notation of BIDS for a missing value."""


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a sidecar without the entries that are None."""
    kept = {name: value for name, value in content.items() if value is not None}
    _write_text(path, json.dumps(kept, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def write_table(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a table with a header; a value that a row lacks is `n/a`."""
    lines = ["\t".join(columns), *("\t".join(cell(row.get(name)) for name in columns) for row in rows)]
    _write_text(path, "\n".join(lines) + "\n")


def cell(value: Any) -> str:
    """Format a value for a table. Tabs and line breaks become spaces, because they would separate cells."""
    if value is None or value is pd.NA or (isinstance(value, float) and not math.isfinite(value)):
        return MISSING
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{round(float(value), 6):.10g}"
    return " ".join(str(value).split()) or MISSING


def write_text(path: Path, text: str) -> None:
    """Write a text page."""
    _write_text(path, text)


def _write_text(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def number_rows(columns: Sequence[Float[np.ndarray, " row"]], decimals: Sequence[int]) -> bytes:
    """Format rows of numbers as text, without header; a value that is not finite is `n/a`."""
    texts = list[Any]()
    for values, digits in zip(columns, decimals, strict=True):
        rounded = np.round(values, digits) + 0.0  # Adding 0.0 turns -0.0 into 0.0.
        known = pa.array(rounded, mask=~np.isfinite(rounded))
        whole = pc.cast(known, pa.int64()) if digits == 0 else known
        texts.append(pc.fill_null(pc.cast(whole, pa.string()), MISSING))
    lines = pc.call_function("binary_join_element_wise", [*texts, "\t"])
    return "\n".join([*lines.to_pylist(), ""]).encode()


@contextmanager
def packed(path: Path) -> Iterator[gzip.GzipFile]:
    """Open a file that is compressed while it is written.

    Time and name are left out, so that its bytes are reproducible.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as raw, gzip.GzipFile("", "wb", compresslevel=6, fileobj=raw, mtime=0) as file:
        yield file
