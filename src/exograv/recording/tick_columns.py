"""Ticks of a chunk packed by column, without loss, in less than half of the space of rows.

A general compressor finds little in rows, because the neighbours of a value are other quantities. In a column they are
the values of the ticks before. Each value becomes an integer in the order of the values, differences of
these integers are small where a signal is smooth, and bytes of the same weight lie side by side for the compressor.
Integers wrap around, so every step can be undone to the last bit, for NaN too.
"""

import struct
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float32, Int, Shaped

from .encoding import CDR_HEADER, tick_dtype
from .schema import SCHEMA_VERSION, TICK

COLUMNS_TOPIC = "/tick_columns"
COLUMNS_ENCODING = "exograv-columns"
COLUMNS_SCHEMA = "exograv/TickColumns"

VIEWED_EVERY = 10
"""Step of the plain `/tick` messages in a packed recording, for viewers that cannot unpack columns [ticks]."""

HEAD = struct.Struct("<III")
"""Ticks, joints and the version of the table of `/tick`."""

ORDERS = 7
"""Differences from order 0 to 6; with higher ones the rounding of smooth signals grows faster than they shrink."""

TRIED = 400
"""Number of values in the middle of a chunk on which the methods of a column are compared."""

OF_OTHER = 7
"""Method of `tau_commanded`: difference to `tau_desired` of the same tick, which the guard seldom changes."""

OF_CURRENT = 8
"""Method of `tau_measured`: difference to `current` times a factor, rounded to float32."""

Column = Shaped[np.ndarray, " tick"]
Columns = Int[np.ndarray, "column tick"]


def pack(ticks: np.ndarray) -> bytes:
    """Pack ticks (tick,) of `tick_dtype`.

    The message is `HEAD`, one byte per column with its method, one float64 per joint with the factor of `OF_CURRENT`,
    and the columns in the order of the table, joint by joint, each as its bytes of lowest weight first.
    """
    n, n_joints = len(ticks), ticks["current"].shape[1]
    factors = _factors(ticks)
    methods, planes = bytearray(), list[bytes]()
    of_columns = _methods(ticks, factors)
    for which in _columns(n_joints):
        method, numbers = of_columns[which], _integers(_column(ticks, *which))
        if method >= ORDERS:
            numbers, order = numbers - dict(_predicted(ticks, *which, factors))[method], 0
        else:
            order = method
        for _ in range(order):
            numbers = _differences(numbers)
        methods.append(method)
        planes.append(_unsigned(numbers).view(np.uint8).reshape(n, -1).T.tobytes())
    return b"".join([HEAD.pack(n, n_joints, SCHEMA_VERSION), bytes(methods), factors.tobytes(), *planes])


NEEDS = {"tau_commanded": "tau_desired", "tau_measured": "current"}
"""Field from which another one may be predicted."""


OF_METHOD = {"tau_commanded": OF_OTHER, "tau_measured": OF_CURRENT}
"""Method of the prediction from another field."""


def unpack(data: bytes, fields: Sequence[str] | None = None) -> np.ndarray:
    """Return the ticks (tick,) of a message that `pack` has made.

    Args:
        data: The message.
        fields: Fields to unpack; all without it. The array then has these fields, and those that they need.

    Raises:
        ValueError: The message is not complete, or has an unknown method.
    """
    n, n_joints, version = HEAD.unpack_from(data)
    if len(data) != packed_size(n, n_joints, version):  # checked first: a small message must not ask for much memory
        raise ValueError(f"{n} ticks of {n_joints} joints do not have {len(data)} bytes.")
    kind = tick_dtype(n_joints, version)
    if fields is not None:
        wanted = {*fields, *(NEEDS[name] for name in fields if name in NEEDS)}
        kind = np.dtype([(name, kind[name]) for name in kind.names or () if name in wanted])
    ticks = np.zeros(n, kind)
    if fields is None:
        ticks["cdr_header"] = np.frombuffer(CDR_HEADER, np.uint8)
    columns = list(_columns(n_joints))
    methods = data[HEAD.size : HEAD.size + len(columns)]
    start = HEAD.size + len(columns)
    factors, start = np.frombuffer(data, "<f8", n_joints, start), start + 8 * n_joints
    sizes = _sizes(version)
    for (name, joint), method in zip(columns, methods, strict=True):
        size = sizes[name]
        if method >= ORDERS and OF_METHOD.get(name if joint is not None else "") != method:
            raise ValueError(f"Column {name} has the unknown method {method}.")
        if name in (kind.names or ()):
            planes = np.frombuffer(data, np.uint8, n * size, start).reshape(size, n)
            _unpack_column(ticks, (name, joint), method, planes, factors)
        start += n * size
    return ticks


def packed_size(n: int, n_joints: int, version: int) -> int:
    """Return the size of a message with `n` ticks [byte].

    Raises:
        ValueError: The version of the table is unknown, or lacks a field of the present one.
    """
    if not max(field.since for field in TICK.fields) <= version <= SCHEMA_VERSION:
        raise ValueError(f"Columns cannot have version {version} of the table.")
    counts, sizes = {field.name: n_joints if field.size else 1 for field in TICK.fields}, _sizes(version)
    row = sum(sizes[name] * count for name, count in counts.items())
    return HEAD.size + sum(counts.values()) + 8 * n_joints + n * row


def _sizes(version: int) -> dict[str, int]:
    """Return the size of a value of each field [byte]."""
    one = tick_dtype(1, version)
    return {field.name: one[field.name].base.itemsize for field in TICK.fields}


def _unpack_column(
    ticks: np.ndarray, which: tuple[str, int | None], method: int, planes: np.ndarray, factors: np.ndarray
) -> None:
    column = _column(ticks, *which)
    numbers = _signed(np.ascontiguousarray(planes.T).view(f"<u{len(planes)}")[:, 0])
    if method < ORDERS:
        for _ in range(method):
            numbers = np.cumsum(numbers, dtype=numbers.dtype)
    else:
        numbers = numbers + dict(_predicted(ticks, *which, factors))[method]
    column[:] = _values(numbers, column.dtype)


def _columns(n_joints: int) -> Iterator[tuple[str, int | None]]:
    for field in TICK.fields:
        yield from ((field.name, joint) for joint in (range(n_joints) if field.size else (None,)))


def _column(ticks: np.ndarray, name: str, joint: int | None) -> Column:
    return ticks[name] if joint is None else ticks[name][:, joint]


def _factors(ticks: np.ndarray) -> np.ndarray:
    """Return the factor from current to measured torque that fits the ticks best, per joint; NaN without a current."""
    with np.errstate(all="ignore"):
        current, tau = ticks["current"], ticks["tau_measured"].astype(float)
        return np.ascontiguousarray((current * tau).sum(0) / (current * current).sum(0), "<f8")


def _predicted(
    ticks: np.ndarray, name: str, joint: int | None, factors: np.ndarray
) -> Iterator[tuple[int, np.ndarray]]:
    """Yield method and integers of the values that other columns predict for this one."""
    if joint is not None and name == "tau_commanded":
        yield OF_OTHER, _integers(_column(ticks, "tau_desired", joint))
    elif joint is not None and name == "tau_measured":
        with np.errstate(all="ignore"):
            torque = (factors[joint] * ticks["current"][:, joint]).astype("<f4")
        yield OF_CURRENT, _integers(torque)


def _methods(ticks: np.ndarray, factors: np.ndarray) -> dict[tuple[str, int | None], int]:
    """Return the method of each column that leaves the fewest bits in the middle of the chunk."""
    begin = max(0, (len(ticks) - TRIED) // 2)
    ticks = ticks[begin : begin + TRIED]
    columns = list(_columns(ticks["current"].shape[1]))
    kinds = [ticks[name].dtype.base for name, _ in columns]
    found = dict[tuple[str, int | None], int]()
    # Columns of one type together: on so few values, a call of NumPy takes longer than its work.
    for kind in dict.fromkeys(kinds):
        alike = [which for which, one in zip(columns, kinds, strict=True) if one == kind]
        numbers = _integers(np.array([_column(ticks, *which) for which in alike]))
        orders, least = _best_orders(numbers)
        for which, column, order, bits in zip(alike, numbers, orders.tolist(), least, strict=True):
            others = [(_bits(_unsigned(column - of)), method) for method, of in _predicted(ticks, *which, factors)]
            found[which] = next((method for left, method in others if left <= bits), order)
    return found


def _best_orders(numbers: Columns) -> tuple[Int[np.ndarray, " column"], Float32[np.ndarray, " column"]]:
    """Return the order of difference that leaves the fewest bits, and these bits, of each column."""
    before = _bits(_unsigned(numbers))
    least, orders, tried = before.copy(), np.zeros(len(numbers), int), np.arange(len(numbers))
    for order in range(1, ORDERS):
        numbers = _differences(numbers)
        now = _bits(_unsigned(numbers))
        is_less = now < least[tried]
        least[tried[is_less]], orders[tried[is_less]] = now[is_less], order
        if order > 1:
            goes_on = now <= before  # noise: each further difference is larger
            numbers, now, tried = numbers[goes_on], now[goes_on], tried[goes_on]
        before = now
    return orders, least


def _differences(numbers: np.ndarray) -> np.ndarray:
    """Return the first number, then the step from each number to the next, along the last axis."""
    steps = numbers.copy()
    steps[..., 1:] -= numbers[..., :-1]
    return steps


def _bits(numbers: np.ndarray) -> Any:
    """Estimate the bits that a compressor needs, along the last axis."""
    return np.log2(numbers.astype(np.float32) + np.float32(1.0)).sum(axis=-1)


def _integers(values: Shaped[np.ndarray, "*column tick"]) -> np.ndarray:
    """Return integers in the order of the values: from one number to the next it is a step of 1."""
    values = np.ascontiguousarray(values)
    integers = values.view(f"<i{values.dtype.itemsize}")
    return _in_order(integers) if values.dtype.kind == "f" else integers


def _values(integers: np.ndarray, kind: np.dtype) -> Column:
    """Restore the values from integers: the inverse of `_integers`."""
    return (_in_order(integers) if kind.kind == "f" else integers).view(kind)


def _in_order(integers: np.ndarray) -> np.ndarray:
    """Reverse the order of negative numbers, which have sign and magnitude as floats; twice gives them back."""
    bits = 8 * integers.itemsize
    return integers ^ ((integers >> (bits - 1)) & integers.dtype.type(2 ** (bits - 1) - 1))


def _unsigned(integers: np.ndarray) -> np.ndarray:
    """Return 0, 1, 2, 3, … for 0, −1, 1, −2, …, so that small numbers have zeros in their upper bytes."""
    return ((integers << 1) ^ (integers >> (8 * integers.itemsize - 1))).view(f"<u{integers.itemsize}")


def _signed(numbers: np.ndarray) -> np.ndarray:
    """Restore signed numbers: the inverse of `_unsigned`."""
    one = numbers.dtype.type(1)
    return ((numbers >> one) ^ (~(numbers & one) + one)).view(f"<i{numbers.itemsize}")
