"""Verify command: wrong options are refused before motion, and on the twin the interval is compared with the truth."""

import json
from pathlib import Path

import pytest

import exograv.procedures.verification
from exograv.errors import ConfigError
from exograv.laboratory.verification_command import run_verification
from exograv.procedures.verification.options import LATER_MAX_MIN, VerifyOptions
from exograv.procedures.verification.postures import POSTURES
from exograv.results import json_value

MOTION_MAX_S = 240.0
"""Longest motion [s]: a few minutes, which fit between two windows of a task."""


def silent(_text: str, _share: float) -> None:
    """Ignore progress."""


@pytest.mark.parametrize("options", [{"level": 5}, {"seed": -1}, {"later_min": -1.0}, {"later_min": LATER_MAX_MIN + 1}])
def test_what_cannot_be_verified_is_refused(options: dict):
    with pytest.raises(ConfigError, match="allowed"):
        VerifyOptions(**options)


def test_a_former_result_that_is_none_is_refused_before_anything_moves(tmp_path: Path):
    with pytest.raises(ConfigError, match="cannot be read"):
        run_verification(VerifyOptions(before=tmp_path / "none.json"), silent)


def test_no_estimate_sees_the_truth():
    package = Path(exograv.procedures.verification.__path__[0])
    others = [file for file in package.glob("*.py") if file.name != "run.py"]
    assert len(others) > 5
    for file in others:
        text = file.read_text(encoding="utf-8")
        assert not {word for word in ("rig.twin", "examine", "virtual", "truth") if f"{word} import" in text}, file


@pytest.mark.slow
def test_an_hour_later_a_twin_says_in_minutes_what_is_left_over_and_what_changed(tmp_path: Path):
    first = json_value(run_verification(VerifyOptions(level=1, seed=1000), silent))
    file = tmp_path / "before.json"
    file.write_text(json.dumps(first))
    options = VerifyOptions(level=1, seed=1000, before=file, later_min=60.0)
    later = json_value(run_verification(options, silent))
    for result in (first, later):
        assert len(result["postures"]) == POSTURES
        assert result["motion_s"] < MOTION_MAX_S
        assert result["relaxed"]
        held = [low <= truth <= high for (low, high), truth in zip(result["ci95"], result["truth_Nm"], strict=True)]
        # One of four may be missed by chance, more may not.
        assert sum(held) >= len(held) - 1, result
    assert not any(later["before"]["more_than_chance"]), later["before"]
