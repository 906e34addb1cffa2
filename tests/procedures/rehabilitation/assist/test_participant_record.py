"""Participant's record: it continues where it stopped, and wrong files are refused with the next step."""

from dataclasses import replace
from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.procedures.rehabilitation.assist.participant_record import (
    ASSIST_FILE,
    AssistFile,
    AssistSession,
    opened,
    read_assist,
)
from exograv.procedures.rehabilitation.assist.session import fly_session

from .weak import Weak, usual

USUAL = usual()
OPTIONS = {"rig": "recupera_like_qdd", "seed": 1000}


def flown(needed: float = 0.5) -> AssistFile:
    file = AssistFile(participant="P-07", options=OPTIONS)
    session = fly_session(Weak(needed), opened(file, USUAL, None, False), lambda _session, _block: None)
    return file.with_session(session)


def broken(file: AssistFile) -> AssistFile:
    last = file.sessions[-1]
    return file.with_session(last.model_copy(update={"blocks": last.blocks[:2], "is_over": False}))


def test_what_was_written_is_read_again_to_the_bit(tmp_path: Path):
    ASSIST_FILE.write(tmp_path / "a.json", flown())
    assert read_assist(tmp_path / "a.json", "P-07", OPTIONS) == flown()


def test_who_is_new_begins_fully_supported_or_a_little_above_what_a_test_found():
    nobody = AssistFile(participant="P-07", options=OPTIONS)
    assert opened(nobody, USUAL, None, False).began_percent == 100.0
    assert opened(nobody, USUAL, 62.0, False).began_percent == 67.0


def test_a_broken_session_goes_on_and_another_one_begins_where_that_is_asked_for():
    file = broken(flown())
    assert opened(file, USUAL, None, False) == file.sessions[0]
    another = opened(file, USUAL, None, True)
    assert (another.number, len(another.blocks)) == (2, 0)
    assert another.began_percent == file.sessions[0].state.support_percent + USUAL.settings.rule.begin_percent


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: opened(flown(), USUAL, 50.0, False), "--needed-percent is for the first session"),
        (lambda: opened(broken(flown()), replace(USUAL, sha256="other"), None, False), "under another protocol file"),
    ],
)
def test_what_would_change_a_course_is_refused(ask, message: str):
    with pytest.raises(ConfigError, match=message):
        ask()


def test_files_of_others_and_damaged_ones_are_refused(tmp_path: Path):
    path = tmp_path / "a.json"
    ASSIST_FILE.write(path, flown())
    with pytest.raises(ConfigError, match=r"belongs to P-07, not to P-08"):
        read_assist(path, "P-08", OPTIONS)
    with pytest.raises(ConfigError, match=r"--seed is 1001, and the sessions in .* were flown with 1000"):
        read_assist(path, "P-07", OPTIONS | {"seed": 1001})
    path.write_text(path.read_text(encoding="utf-8").replace('"is_over": true', '"is_over": 7'), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"is damaged: sessions\.0\.is_over"):
        read_assist(path, "P-07", OPTIONS)


def test_a_failure_before_the_break_still_counts_after_it():
    file = AssistFile(participant="P-07", options=OPTIONS)
    begun: AssistSession = opened(file, USUAL, 40.0, False)
    session = fly_session(Weak(0.6), begun, lambda _session, _block: None)
    cut = session.model_copy(update={"blocks": session.blocks[:1], "is_over": False})
    assert cut.blocks[0].has_failed
    assert opened(file.with_session(cut), USUAL, None, False).state.has_failed
