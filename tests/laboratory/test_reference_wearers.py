"""A run is compared only with wearers of the same machine, level and settings, and never with itself."""

import json
from pathlib import Path

import pytest

from exograv.laboratory import reference_wearers
from exograv.laboratory.options import DemoOptions
from exograv.laboratory.reference_wearers import ReferenceKey, compare, reference_path
from exograv.model.description import load_rig

JOINTS = ("shoulder_flexion", "elbow_flexion")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with a reference of three wearers and one that broke off."""
    monkeypatch.setattr(reference_wearers, "FOLDER", tmp_path)
    key = ReferenceKey.of(DemoOptions())
    wearers = [
        {"seed": 100, "left_over_Nm": [0.1, 0.3], "time_to_target_s": None},
        {"seed": 101, "left_over_Nm": [0.2, 0.05], "time_to_target_s": 20.0},
        {"seed": 102, "left_over_Nm": [0.4, 0.07], "time_to_target_s": 30.0},
        {"seed": 103, "broke_off": "The envelope stopped the run."},
    ]
    content = {"key": vars(key), "date": "2026-01-01", "wearers": wearers}
    reference_path(key).write_text(json.dumps(content))
    return tmp_path


@pytest.mark.usefixtures("folder")
def test_a_run_is_placed_among_the_others_joint_by_joint():
    found = compare(DemoOptions(), True, JOINTS, [0.3, 0.06])
    assert (found.lower, found.reached, len(found.others_Nm or [])) == ([2, 1], 2, 3)
    assert "against 3 other simulated wearers at level 2" in found.text
    assert "elbow flexion 0.06 N·m (1 was lower)" in found.text


@pytest.mark.usefixtures("folder")
def test_a_wearer_of_the_reference_is_not_compared_with_itself():
    found = compare(DemoOptions(seed=101), True, JOINTS, [0.2, 0.05])
    assert (found.lower, len(found.others_Nm or [])) == ([1, 0], 2)


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("other", [{"level": 3}, {"method": "gradient"}, {"seconds": 30.0}, {"rig": "recupera_two"}])
def test_other_settings_have_no_comparison_and_the_sentence_names_machine_and_level(other: dict):
    options = DemoOptions(**other)
    found = compare(options, True, JOINTS, [0.3, 0.06])
    assert found.others_Nm is None
    assert f"on {options.rig} at level {options.level} with these settings" in found.text


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(("options", "is_fresh"), [(DemoOptions(), False), (DemoOptions(donning=1), True)])
def test_a_run_that_did_not_start_afresh_has_no_comparison(options: DemoOptions, is_fresh: bool):
    found = compare(options, is_fresh, JOINTS, [0.3, 0.06])
    assert found.others_Nm is None
    assert found.text.startswith("This run has no comparison.")


def test_the_reference_of_the_default_demo_ships_with_the_package():
    key = ReferenceKey.of(DemoOptions())
    content = json.loads(reference_path(key).read_text(encoding="utf-8"))
    assert content["key"] == vars(key)
    assert content["joints"] == list(load_rig(key.rig, None).joints)
    seeds = [row["seed"] for row in content["wearers"]]
    assert len(set(seeds)) == len(seeds) >= 30
    assert min(seeds) >= 100
    assert all(content[name] for name in ("source", "date", "exograv"))
