"""An estimate is stored once. A file that the motion contradicts stops the machine and is not overwritten."""

from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.experiment.steered.participant_keeping import EstimateKeeper
from exograv.experiment.steered.participants import RequestedParticipant
from exograv.procedures.identification.participant_session import DISAGREED, KEPT_BEFORE, KeptParticipant, NotKept
from exograv.runtime.control_loop.steering import DescentCommand
from exograv.sentence import Sentence
from exograv.storage.session_checkpoint import CheckedArm


@dataclass
class Folder:
    """Replacement of the participants' files."""

    kept: list[str | None] = field(default_factory=list)
    fails: bool = False
    donning: list[bool] = field(default_factory=list)
    """True for each arm from rests that takes the place of an estimate of the same donning."""

    def keep(self, code: str | None, *_: Any) -> str | None:
        if self.fails:
            raise ConfigError("people/P-07.toml cannot be written: no space. Give another folder.")
        self.kept.append(code)
        return code or "P-123456"

    def keep_rests(self, code: str | None, _: CheckedArm, is_of_donning: bool) -> KeptParticipant:
        code = self.keep(code)
        self.donning.append(is_of_donning)
        return KeptParticipant(Path("P.toml"), code or "", "", 1, [], 0)


LEARNED = CheckedArm(
    x=[1.0], covariance=[[1.0]], motion_s=10.0, outcome="", predicted_left_over_Nm=[0.1], held_out_error_Nm=[],
    held_out_s=0.0,
)  # fmt: skip


def worker(is_contradicted: bool = False, is_learned: bool = False, refusal: str = "") -> Any:
    judged = SimpleNamespace(is_contradicted=is_contradicted, left_over=np.zeros(4), refusal=refusal)
    return SimpleNamespace(judged=judged, learned=SimpleNamespace() if is_learned else None)


def keeping(participant: str | None = None, code: str | None = None) -> EstimateKeeper:
    return EstimateKeeper(RequestedParticipant(participant, code, 20.0, "right"))


@pytest.mark.parametrize(("code", "shown"), [("P-07", "P-07"), (None, "P-123456")])
def test_who_was_learned_is_kept_once_under_a_code_that_is_shown(code: str | None, shown: str):
    folder, sent = Folder(), list[object]()
    one = keeping(code=code)
    assert one.code is None
    one.look(worker(), sent.append, folder.keep)
    assert folder.kept == []
    for _ in range(3):
        one.look(worker(is_learned=True), sent.append, folder.keep)
    assert (folder.kept, sent, one.code, one.wrong) == ([code], [], shown, ())


def test_a_file_of_somebody_else_stops_once_and_is_not_written_over():
    folder, sent = Folder(), list[object]()
    one = keeping("P-07", "P-07")
    for _ in range(3):
        one.look(worker(is_contradicted=True, is_learned=True), sent.append, folder.keep)
    assert [type(word) for word in sent] == [DescentCommand]
    assert folder.kept == []
    assert one.is_contradicted
    assert "P-07 does not fit this arm" in one.wrong[0]


def test_a_folder_that_cannot_be_written_is_told_and_ends_nothing():
    one = keeping("P-07", "P-07")
    one.look(worker(is_learned=True), list[object]().append, Folder(fails=True).keep)
    assert "cannot be written" in one.wrong[0]
    assert not one.is_contradicted


def test_a_form_that_does_not_fit_the_arm_stops_and_no_arm_is_kept():
    folder, sent = Folder(), list[object]()
    one = keeping(code="P-07")
    one.look(
        worker(is_learned=True, refusal="The arm weighs like that of a person of 60 kg."), sent.append, folder.keep
    )
    assert [type(word) for word in sent] == [DescentCommand]
    assert folder.kept == []
    assert one.wrong[0] == (
        "The arm weighs like that of a person of 60 kg. The arm was let down. Correct the form, then begin again."
    )


def code_of(told: Sentence | None) -> str:
    assert told is not None
    return told.code


def test_an_arm_from_rests_takes_the_place_of_the_identified_one_of_the_same_donning():
    folder, one = Folder(), keeping(code=None)
    one.look(worker(is_learned=True), list[object]().append, folder.keep)
    for _ in range(2):
        assert code_of(one.keep_rests(LEARNED, folder.keep_rests)) == "rest.stored"
    assert (folder.kept, folder.donning) == ([None, "P-123456", "P-123456"], [True, True])


def test_the_first_stored_arm_of_a_donning_counts_it_even_if_it_comes_from_a_rest():
    folder, one = Folder(), keeping(code="P-07")
    one.look(worker(is_learned=True), list[object]().append, lambda *_: None)
    for _ in range(2):
        one.keep_rests(LEARNED, folder.keep_rests)
    assert (folder.kept, folder.donning) == (["P-07", "P-07"], [False, True])


def test_the_operator_is_told_what_of_the_rests_is_not_in_the_file():
    one = keeping("P-07", "P-07")
    assert code_of(one.keep_rests(LEARNED, Folder(fails=True).keep_rests)) == "rest.not_stored"
    no_folder = Mock(side_effect=PermissionError("people"))
    assert code_of(one.keep_rests(LEARNED, no_folder)) == "rest.not_stored"
    assert code_of(one.keep_rests(LEARNED, lambda *_: NotKept(None, KEPT_BEFORE))) == "rest.kept_before"
    refuted = KeptParticipant(Path("P.toml"), "P-07", "", 1, [], 0, DISAGREED)
    assert code_of(one.keep_rests(LEARNED, lambda *_: refuted)) == "rest.stored_refuted"
    assert one.keep_rests(LEARNED, lambda *_: None) is None
