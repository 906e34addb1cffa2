"""A replayed run in lock-step decides the same as the run, and differently only where it should."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv.cli.recordings.replaying import run_replay
from exograv.errors import ConfigError, RecordingError
from exograv.loop.replay.reasons import other_versions
from exograv.loop.replay.what_if import ReplayOverrides
from exograv.loop.replay_log import versions, written_rig
from exograv.model.description import load_rig
from exograv.recording import Recording, RecordingWriter, read_recording
from exograv.recording.machine_files import unpacked_machine
from exograv.recording.schema import CHANNELS, TICK
from exograv.results import json_value

from .conftest import Flown, nothing


def replayed(path: Path, folder: Path | None = None, **instead: Any) -> dict[str, Any]:
    return json_value(run_replay(path, folder, nothing, ReplayOverrides(**instead)))


def rewritten(flown: Flown, path: Path, ticks: np.ndarray, change: Any = lambda _topic, message: message) -> Path:
    """Write the same recording with other ticks, messages or settings."""
    source: Recording = read_recording(flown.path)
    settings = {k: v for k, v in source.settings.items() if k not in ("schema_version", "joints")}
    with RecordingWriter(path, source.joints, change("/settings", json.loads(json.dumps(settings)))) as recording:
        for topic in CHANNELS:
            for message in source.messages(topic) if topic not in ("/settings", TICK.topic) else ():
                changed = change(topic, dict(message))
                recording.write(topic, changed.pop("t"), changed)
        recording.ticks(ticks)
    return path


@pytest.fixture(scope="module")
def same(flown: Flown, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return replayed(flown.path, tmp_path_factory.mktemp("same"))


def test_every_torque_is_the_recorded_one_to_the_last_bit(same: dict[str, Any]):
    assert same["bit_identical"] == {"tau_desired": True, "tau_commanded": True}
    assert same["first_difference"] is None
    assert same["compared"]["tau_commanded"] == same["ticks"]
    assert same["ok"]


def test_the_stop_comes_at_the_same_time_for_the_same_reason(same: dict[str, Any]):
    (stop,) = same["stops"]["replayed"]
    assert same["stops"]["recorded_s"] == [stop["t"]]
    assert stop["cause"] == "A joint did not follow its path."
    assert same["safe_state_differs"]["ticks"] == 0


def test_only_the_torque_of_a_controller_that_cannot_be_rebuilt_is_given(same: dict[str, Any]):
    assert same["given"] == 100
    assert same["compared"]["tau_desired"] == same["ticks"] - 100
    assert [phase["name"] for phase in same["phases"]] == ["calibrate", "identify", "float"]


def test_nothing_is_to_be_said_of_a_run_that_was_recorded_here_and_now(same: dict[str, Any]):
    assert same["circumstances"] == []


def test_the_figure_is_a_picture(same: dict[str, Any]):
    assert Path(same["figure"]).read_bytes().startswith(b"\x89PNG")


def test_a_torque_that_was_altered_is_the_first_difference_and_lost_ticks_are_none(flown: Flown, tmp_path: Path):
    ticks = read_recording(flown.path).ticks.copy()
    ticks["tau_desired"][500, 2] += 1e-5
    found = replayed(rewritten(flown, tmp_path / "a.mcap", np.delete(ticks, np.r_[700:720])))
    first = found["first_difference"]
    assert (first["tick"], first["what"], first["joint"]) == (500, "tau_desired", "shoulder_rotation")
    assert first["Nm"] == pytest.approx(-1e-5)
    assert not found["ok"]
    assert found["gaps"] == [{"t": ticks["t"][720], "lost": 20}]
    assert "20 ticks are missing" in " ".join(found["circumstances"])
    # Filters restart at the gap, and ticks are not compared until they agree. A hand-over and a friction spring
    # continue with other states.
    assert len(ticks) - 20 - found["compared"]["tau_commanded"] == pytest.approx(500, abs=2)
    assert 0.0 < max(found["difference_Nm"]["tau_commanded"]["max"]) < 0.5


@pytest.mark.slow
def test_parameters_that_were_altered_show_from_the_tick_that_they_are_in_force(flown: Flown, tmp_path: Path):
    source = read_recording(flown.path)

    def heavier(topic: str, message: dict[str, Any]) -> dict[str, Any]:
        if topic == "/control" and message["act"] == "publish" and message["taken"]:
            message["x"] = (1.1 * np.array(message["x"])).tolist()
        return message

    found = replayed(rewritten(flown, tmp_path / "a.mcap", source.ticks, heavier))
    acts = source.messages("/control")
    number = next(k for k, message in enumerate(acts, start=1) if message["act"] == "publish")
    assert found["first_difference"]["tick"] == int(np.argmax(source.ticks["control"] >= number))
    assert max(found["phases"][0]["tau_commanded"]["max"]) == 0.0
    assert max(found["phases"][1]["tau_commanded"]["rms"]) > 0.01


def test_a_recording_that_was_cut_is_replayed_up_to_there(flown: Flown, tmp_path: Path):
    content = flown.path.read_bytes()
    (tmp_path / "a.mcap").write_bytes(content[: content.rfind(b"\x28\xb5\x2f\xfd") + 100])
    found = replayed(tmp_path / "a.mcap")
    assert found["bit_identical"] == {"tau_desired": True, "tau_commanded": True}
    assert "The part before that was replayed" in found["circumstances"][0]


def test_another_gravity_level_shows_only_where_an_arm_is_carried(flown: Flown):
    found = replayed(flown.path, gravity_level=1.0)
    empty, identified, floated = found["phases"]
    assert max(empty["tau_commanded"]["max"]) == 0.0
    assert min(max(phase["tau_commanded"]["rms"]) for phase in (identified, floated)) > 1.0
    assert found["ok"]
    assert found["circumstances"] == ["1.0 took the place of the recorded gravity level."]


@pytest.mark.parametrize("level", [-0.1, 1.8, float("nan")])
def test_a_gravity_level_that_nobody_may_fly_is_refused(level: float):
    with pytest.raises(ConfigError, match=r"--gravity-level is .*; allowed"):
        ReplayOverrides(gravity_level=level)


def test_a_recording_of_an_older_version_is_refused_with_what_to_do():
    old = Path(__file__).parents[2] / "recording" / "data" / "version_2.mcap"
    with pytest.raises(RecordingError, match=r"version 2 of the recording format.* record the run again"):
        replayed(old)


def test_a_recording_that_says_nothing_of_control_is_refused(tmp_path: Path):
    with RecordingWriter(tmp_path / "a.mcap", ("elbow",), {"seed": 1}) as recording:
        names = [field.name for field in TICK.fields if field.size and field.default is None]
        recording.tick(0.0, closure_slope=0.0, tick_us=1.0, **dict.fromkeys(names, np.zeros(1)))
    with pytest.raises(RecordingError, match=r"does not hold settings\.rig_files"):
        replayed(tmp_path / "a.mcap")


def broken(what: str, topic: str, message: dict[str, Any]) -> dict[str, Any]:
    """Change one message to content that exograv never writes."""
    if topic == "/settings" and what == "escape":
        message["settings"]["rig_files"] = {"x/../../rig.toml": "name = 'x'"}
    if topic == "/settings" and what == "absolute":
        message["settings"]["rig_files"] = {"/rig.toml": "name = 'x'"}
    if topic == "/settings" and what == "no rig":
        message["settings"]["rig_files"] = {}
    if topic == "/settings" and what == "body":
        message["settings"]["told"]["body"] = {"age": 7}
    if topic == "/control" and what == "parameters" and "x" in message:
        message["x"] = [1.0]
    if topic == "/control" and what == "controller" and message["act"] == "fly":
        message["controller"] = 99
    return message


@pytest.mark.parametrize(
    ("what", "says"),
    [
        ("escape", "outside of its folder"),
        ("absolute", "outside of its folder"),
        ("no rig", "No machine"),
        ("body", "height_m' is missing"),
        ("parameters", "does not write"),
        ("controller", "does not write"),
    ],
)
def test_content_that_no_exograv_writes_is_a_readable_error(flown: Flown, tmp_path: Path, what: str, says: str):
    ticks = read_recording(flown.path).ticks
    path = rewritten(flown, tmp_path / "a.mcap", ticks, lambda topic, message: broken(what, topic, message))
    with pytest.raises((RecordingError, ConfigError), match=says):
        replayed(path)
    assert not (tmp_path.parent / "rig.toml").exists()


def test_a_machine_whose_urdf_is_its_neighbours_is_unpacked_with_it(tmp_path: Path):
    """The URDF of recupera_like_qdd has the links of recupera_like."""
    description = load_rig("recupera_like_qdd")
    machine = unpacked_machine(tmp_path / "a.mcap", written_rig(description), tmp_path)
    assert load_rig(str(machine), description.side).sha256 == description.sha256


@pytest.mark.parametrize("name", ["../../../rig.toml", "../beside/right.urdf", "inner/rig.toml"])
def test_no_file_of_a_machine_is_unpacked_outside_of_the_folder_for_it(tmp_path: Path, name: str):
    inside = tmp_path / "for it"
    inside.mkdir()
    unpacked_machine(tmp_path / "a.mcap", {name: "text", "rig.toml": "name"}, inside)
    assert [path for path in tmp_path.rglob("*") if path.is_file() and inside not in path.parents] == []
    assert sum(path.is_file() for path in inside.rglob("*")) == 2


def test_other_versions_and_changed_code_are_named():
    now = versions()
    assert other_versions(now, now) == []
    assert other_versions(now | {"numpy": "1.0"}, now) == [f"numpy was 1.0, now it is {now['numpy']}."]
    (changed,) = other_versions(now | {"code": "0" * 64}, now)
    assert "has been changed since" in changed
    older = other_versions(now | {"exograv": "0.0.9", "code": "0" * 64}, now)
    assert older == [f"exograv was 0.0.9, now it is {now['exograv']}."]


@pytest.mark.slow
def test_a_machine_that_was_another_then_is_named_and_flown_as_it_was(flown: Flown, tmp_path: Path):
    def older(topic: str, message: dict[str, Any]) -> dict[str, Any]:
        if topic == "/settings":
            message["settings"]["rig_files"]["rig.toml"] += "\n# as it was then\n"
        return message

    ticks = read_recording(flown.path).ticks
    found = replayed(rewritten(flown, tmp_path / "a.mcap", ticks[:1000], older))
    assert "do not match the hash" in " ".join(found["circumstances"])
    assert found["bit_identical"]["tau_desired"]
