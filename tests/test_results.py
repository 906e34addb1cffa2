"""A typed result and its JSON object hold the same values in the same order."""

import json
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

import numpy as np
import pytest

from exograv.results import MERGED, OPTIONAL, json_value


class Colour(Enum):
    """Colours of the test."""

    RED = "red"


@dataclass(frozen=True)
class Inner:
    """Part of a result."""

    mass_kg: float
    ci95_kg: np.ndarray


@dataclass(frozen=True)
class Outer:
    """Result of the test."""

    verdict: Colour
    arm: Inner = field(metadata=MERGED)
    weights: tuple[Inner, ...] = ()
    file: Path | None = None
    note: str | None = field(default=None, metadata=OPTIONAL)
    other: Inner | None = field(default=None, metadata=MERGED)


ARM = Inner(3.0, np.array([2.5, 3.5]))


def test_fields_keep_their_order_and_merged_members_stand_between_them():
    made = json_value(Outer(Colour.RED, ARM, (ARM,)))
    assert list(made) == ["verdict", "mass_kg", "ci95_kg", "weights", "file"]
    assert json.loads(json.dumps(made)) == made


def test_none_is_null_unless_the_field_is_optional():
    made = json_value(Outer(Colour.RED, ARM))
    assert made["file"] is None
    assert "note" not in made
    named = json_value(Outer(Colour.RED, ARM, file=Path("a/b"), note="x"))
    assert (named["file"], named["note"]) == ("a/b", "x")


def test_a_merged_member_that_is_none_adds_nothing():
    made = json_value(Outer(Colour.RED, ARM, other=None))
    assert list(made) == ["verdict", "mass_kg", "ci95_kg", "weights", "file"]


def test_keys_of_an_object_are_text_and_numpy_values_are_plain():
    assert json_value({1: np.float64(0.5), "two": np.arange(2)}) == {"1": 0.5, "two": [0, 1]}


def test_a_value_without_a_json_form_is_refused():
    with pytest.raises(TypeError, match="object has no JSON form"):
        json_value(object())
