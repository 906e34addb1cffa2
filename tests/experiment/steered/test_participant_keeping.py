"""An estimate is stored once. A file that the motion contradicts stops the machine and is not overwritten."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.experiment.steered.participant_keeping import EstimateKeeper
from exograv.experiment.steered.participants import RequestedParticipant
from exograv.runtime.control_loop.steering import DescentCommand


@dataclass
class Folder:
    """Replacement of the participants' files."""

    kept: list[str | None] = field(default_factory=list)
    fails: bool = False

    def keep(self, code: str | None, *_: Any) -> str | None:
        if self.fails:
            raise ConfigError("people/P-07.toml cannot be written: no space. Give another folder.")
        self.kept.append(code)
        return code or "P-123456"


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
