"""Comparison of verifications: only changes larger than chance count, and only equal postures are compared."""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.procedures.verification.change import (
    CHANCE,
    ArmChange,
    changed_since,
    read_former,
    stored_verification,
)

SD, POSTURES, RUNS = 0.1, 12, 200


def result(seed: int, shift: float = 0.0, hour: int = 10) -> dict[str, Any]:
    """Return a result of a machine with two joints; the first gives `shift` [N·m] more."""
    beyond = SD * np.random.default_rng(seed).standard_normal((POSTURES, 2)) + [shift, 0.0]
    rows = [{"deg": [k, -k], "beyond_Nm": list(row), "beyond_sd_Nm": [SD, SD]} for k, row in enumerate(beyond)]
    at = f"2026-01-01T{hour}:00:00+00:00"
    return {"rig": "two", "joints": ["a", "b"], "at_utc": at, "left_over_Nm": [0.1, 0.1], "postures": rows}


def change(former: dict[str, Any], now: dict[str, Any]) -> ArmChange:
    return changed_since(stored_verification(former), stored_verification(now), now["joints"])


def test_chance_is_rarely_called_a_change():
    found = [change(result(2 * k), result(2 * k + 1)).more_than_chance for k in range(RUNS)]
    assert np.mean([any(joints) for joints in found]) < 2 * CHANCE


def test_a_change_is_named_by_its_joint_and_time():
    found = change(result(0), result(1, shift=3 * SD, hour=11))
    assert found.more_than_chance == [True, False]
    assert found.minutes == 60.0
    assert "a (" in found.why


def test_results_at_other_postures_are_not_compared():
    other = copy.deepcopy(result(1))
    other["postures"][3]["deg"] = [50.0, 50.0]
    with pytest.raises(ConfigError, match="other postures"):
        change(other, result(1))


@pytest.mark.parametrize(
    ("text", "said"), [("{", "cannot be read"), ("[]", "no 'rig'"), (json.dumps(result(0) | {"rig": "x"}), "to x, not")]
)
def test_a_file_that_is_no_former_result_is_refused_with_what_to_give(tmp_path: Path, text: str, said: str):
    file = tmp_path / "before.json"
    file.write_text(text)
    with pytest.raises(ConfigError, match=said) as error:
        read_former(file, "two")
    assert "exograv arm verify --json" in str(error.value)
