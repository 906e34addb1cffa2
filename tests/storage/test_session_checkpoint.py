"""A run is stored completely or not at all, comes back to the last bit, and is refused for other options."""

import json
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ConfigError, RecordingError
from exograv.loop.replay_log import read_machine
from exograv.model.description import load_rig
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.storage.session_checkpoint import SESSION_FILE, KeptSession, KnownPerson, read_kept, refuse_kept

OPTIONS = {"protocol": "training", "participant": "P-01", "seed": 1014, "windows": None}


def kept(**changes: object) -> KeptSession:
    whole = {"options": OPTIONS, "t": 12.5, "run": "{}", "person": None, "before": {}}
    return KeptSession.model_validate(whole | changes)


def test_a_stored_run_comes_back(tmp_path: Path):
    path = tmp_path / "run.json"
    SESSION_FILE.write(path, kept())
    SESSION_FILE.write(path, kept(t=13.0))
    assert read_kept(path, OPTIONS) == kept(t=13.0)
    assert [one.name for one in tmp_path.iterdir()] == ["run.json"]


def test_the_person_comes_back_to_the_last_bit(tmp_path: Path):
    description = load_rig("recupera_like")
    machine = nominal_machine(description, np.linspace(0.1, 1.0, 40).reshape(4, 10) / 3.0)
    x, covariance = np.random.default_rng(1).standard_normal(7) / 3.0, np.eye(7) / 3.0
    path = tmp_path / "run.json"
    SESSION_FILE.write(path, kept(person=KnownPerson.of(machine, x, covariance)))
    person = read_kept(path, OPTIONS).person
    assert person is not None
    np.testing.assert_array_equal(np.array(person.x), x)
    np.testing.assert_array_equal(np.array(person.covariance), covariance)
    again = read_machine(person.machine)
    np.testing.assert_array_equal(again.phi, machine.phi)
    np.testing.assert_array_equal(again.actuators.gain, machine.actuators.gain)


@pytest.mark.parametrize(("name", "value"), [("seed", 1015), ("participant", "P-02"), ("windows", 3)])
def test_a_run_with_other_options_is_not_resumed(tmp_path: Path, name: str, value: str | int):
    path = tmp_path / "run.json"
    SESSION_FILE.write(path, kept())
    with pytest.raises(ConfigError, match=f"--{name} is {value}, and the run"):
        read_kept(path, OPTIONS | {name: value})


@pytest.mark.parametrize("content", ["", "{", "[]", '{"schema_version": 2}', json.dumps({"t": 1.0})])
def test_a_damaged_file_is_refused(tmp_path: Path, content: str):
    path = tmp_path / "run.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(ConfigError, match="is damaged"):
        read_kept(path, OPTIONS)


def test_resuming_without_a_stored_run_is_refused(tmp_path: Path):
    with pytest.raises(ConfigError, match="There is no run to go on with"):
        read_kept(tmp_path / "run.json", OPTIONS)


def test_a_second_start_overwrites_no_run(tmp_path: Path):
    path = tmp_path / "run.json"
    refuse_kept(path)
    SESSION_FILE.write(path, kept())
    with pytest.raises(ConfigError, match="--resume"):
        refuse_kept(path)


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path):
    with pytest.raises(RecordingError, match="cannot be written"):
        SESSION_FILE.write(tmp_path / "nowhere" / "run.json", kept())
