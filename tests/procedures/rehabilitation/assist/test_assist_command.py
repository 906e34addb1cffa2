"""Assist session: after Ctrl-C no decided block is lost, and the next call continues the session; without a machine."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from exograv.console.words import said_in
from exograv.errors import ConfigError
from exograv.laboratory.assist import assist_command as run
from exograv.laboratory.assist.assist_command import AssistResult
from exograv.procedures.rehabilitation.assist import session_files
from exograv.procedures.rehabilitation.assist.options import AssistOptions
from exograv.procedures.rehabilitation.assist.participant_record import AssistBlock, AssistSession
from exograv.procedures.rehabilitation.assist.words import AssistTexts
from exograv.recording import read_recording
from exograv.results import json_value
from exograv.task.assist_as_needed import SENTENCES

from .weak import Weak

WORDS = AssistTexts("en", {"en": SENTENCES, "de": said_in("de")})
OPTIONS = AssistOptions(participant="P-07", seed=1000)
SETTINGS = {"rig": "recupera_like_qdd", "side": "right", "command": "exograv run assist --simulate", "seed": 1000,
            "disturbance_level": 2}  # fmt: skip


class Flown(Weak):
    """Weak person with the counters of a flight."""

    rescues, seconds = 0, 1.0

    def carry_all(self) -> None:
        pass


@pytest.fixture
def no_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    description = SimpleNamespace(joints=("flexion", "abduction", "rotation", "elbow"))

    def prepared(_options: object, _progress: object) -> SimpleNamespace:
        laboratory, known = SimpleNamespace(description=description), SimpleNamespace(t=0.0)
        return SimpleNamespace(laboratory=laboratory, known=known, flight=lambda _seed, _recording: Flown(0.8))

    monkeypatch.setattr(run, "prepare_weak_participant", prepared)
    monkeypatch.setattr(run, "_settings", lambda *_: SETTINGS)
    monkeypatch.setattr(session_files, "write_assist_page", lambda path, _file, _words: path.write_text("page"))


def call(folder: Path, leaves_after: int = 0) -> AssistResult:
    def told(session: AssistSession, _block: AssistBlock) -> None:
        if len(session.blocks) == leaves_after:
            raise KeyboardInterrupt

    return run.run_assist(OPTIONS, folder, WORDS, told, lambda _text, _share: None)


def decided(path: Path) -> list[dict[str, Any]]:
    return [one["record"] for one in read_recording(path).messages("/task") if one["kind"] == "assist_decided"]


@pytest.mark.usefixtures("no_machine")
def test_a_session_that_was_left_goes_on_and_ends_as_one_that_was_not(tmp_path: Path):
    with pytest.raises(KeyboardInterrupt):
        call(tmp_path / "left", 2)
    assert (tmp_path / "left/assist_P-07.html").exists()
    gone_on, whole = call(tmp_path / "left"), call(tmp_path / "whole")
    same = ("session", "blocks", "support_percent", "next_percent", "supports_percent", "decisions", "reached", "tried")
    assert [getattr(gone_on.found, name) for name in same] == [getattr(whole.found, name) for name in same]
    first, second = (
        decided(tmp_path / "left" / name) for name in ("assist_P-07_01.mcap", "assist_P-07_01_from_3.mcap")
    )
    assert [one["block"] for one in first + second] == [1, 2, 3, 4, 5, 6]
    assert set(first[0]["text"]) == {"en", "de"}


@pytest.mark.usefixtures("no_machine")
def test_the_next_call_is_the_next_session_and_begins_as_the_last_one_said(tmp_path: Path):
    first, second = call(tmp_path), call(tmp_path)
    assert (first.found.session, second.found.session) == (1, 2)
    assert second.found.began_percent == first.found.next_percent
    assert {"participant", "session", "blocks", "support_percent", "reached", "page", "recording"} <= json_value(
        second
    ).keys()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"participant": "Anna"}, "it must have 3 to 16 letters"),
        ({"gain": -0.1}, "--gain is -0.1"),
        ({"needed_percent": 120.0}, "--needed-percent is 120"),
        ({"level": 7}, "--level is 7"),
    ],
)
def test_options_that_mean_nothing_are_refused(change: dict[str, Any], message: str):
    with pytest.raises(ConfigError, match=message):
        AssistOptions(**{"participant": "P-07", **change})
