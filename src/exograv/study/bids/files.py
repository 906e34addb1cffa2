"""Files of a data set, the same bytes for the same content: tab-separated tables, JSON, and rows of numbers."""

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
"""BIDS's word for a value that is not there."""


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """A sidecar; what is None is left out."""
    kept = {name: value for name, value in content.items() if value is not None}
    _write_text(path, json.dumps(kept, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def write_table(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """A table with a header; what a row lacks is `n/a`."""
    lines = ["\t".join(columns), *("\t".join(cell(row.get(name)) for name in columns) for row in rows)]
    _write_text(path, "\n".join(lines) + "\n")


def cell(value: Any) -> str:
    """A value in a table. Tabs and breaks of lines become blanks, because they would be read as the next cell."""
    if value is None or value is pd.NA or (isinstance(value, float) and not math.isfinite(value)):
        return MISSING
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{round(float(value), 6):.10g}"
    return " ".join(str(value).split()) or MISSING


def write_text(path: Path, text: str) -> None:
    """A page."""
    _write_text(path, text)


def _write_text(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def number_rows(columns: Sequence[Float[np.ndarray, " row"]], decimals: Sequence[int]) -> bytes:
    """Rows of numbers as text, without header; what is not finite is `n/a`."""
    texts = list[Any]()
    for values, digits in zip(columns, decimals, strict=True):
        rounded = np.round(values, digits) + 0.0  # no minus before a zero
        known = pa.array(rounded, mask=~np.isfinite(rounded))
        whole = pc.cast(known, pa.int64()) if digits == 0 else known
        texts.append(pc.fill_null(pc.cast(whole, pa.string()), MISSING))
    lines = pc.call_function("binary_join_element_wise", [*texts, "\t"])
    return "\n".join([*lines.to_pylist(), ""]).encode()


@contextmanager
def packed(path: Path) -> Iterator[gzip.GzipFile]:
    """A file that is compressed while it is written, without time and name in it, so that its bytes are the same."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as raw, gzip.GzipFile("", "wb", compresslevel=6, fileobj=raw, mtime=0) as file:
        yield file
