"""Digest of values by their content: the same in every process, unlike a pickle, which depends on sets and caches."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from hashlib import blake2b
from pathlib import PurePath

import numpy as np

PLAIN = (type(None), bool, int, float, str, bytes)


def content_digest(values: Iterable[object]) -> str | None:
    """Digest of values made of numbers, texts, arrays, containers and records; None if one is of another type."""
    digest = blake2b(digest_size=20)
    try:
        for part in _parts(tuple(values)):
            digest.update(b"%d:" % len(part))
            digest.update(part)
    except TypeError:
        return None
    return digest.hexdigest()


def _parts(value: object) -> Iterator[bytes]:
    """Yield parts that tell this value from every other value.

    Raises:
        TypeError: The content of this type is not known.
    """
    kind = type(value)
    yield f"{kind.__module__}.{kind.__qualname__}".encode()
    if isinstance(value, Enum):
        yield value.name.encode()
    elif isinstance(value, PLAIN):
        yield repr(value).encode()
    elif isinstance(value, PurePath):
        yield str(value).encode()
    elif isinstance(value, np.ndarray | np.generic) and value.dtype != object:
        yield f"{value.dtype.str} {value.shape}".encode()
        yield value.tobytes()
    else:
        content = list(_members(value))
        yield str(len(content)).encode()
        for member in content:
            yield from _parts(member)


def _members(value: object) -> Iterable[object]:
    if isinstance(value, Mapping):
        return [part for item in value.items() for part in item]
    if isinstance(value, tuple | list):
        return value
    if isinstance(value, set | frozenset):
        return sorted(value, key=repr)
    if is_dataclass(value):
        return [getattr(value, field.name) for field in fields(value)]
    names = getattr(type(value), "model_fields", None)  # the fields of a settings class of pydantic
    if isinstance(names, Mapping):
        return [getattr(value, name) for name in names]
    raise TypeError(f"The content of a {type(value).__name__} is not known.")
