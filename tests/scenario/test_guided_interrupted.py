"""Ctrl-C while an arm is guided leaves a complete recording without a result, and does not change earlier paths."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from exograv.laboratory.guided.guided_command import run_repeat, run_teach
from exograv.laboratory.guided.mirror_command import run_mirror
from exograv.laboratory.preparation import prepare
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.loop.pilot import Progress
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.rehabilitation.guided.options import GuidedOptions, MirrorOptions, RepeatOptions
from exograv.recording.reader import read_recording

pytestmark = pytest.mark.slow

SEED = 1000
CODE = "K7MR4XX"


def quiet(_text: str, _share: float) -> None:
    """Discard the progress."""


@dataclass
class Pressed:
    """Progress that raises Ctrl-C when a text was shown this number of times."""

    text: str
    times: int

    def __call__(self, text: str, _share: float) -> None:
        self.times -= text.startswith(self.text)
        if self.times == 0:
            raise KeyboardInterrupt


@pytest.fixture(scope="module")
def known() -> ControllerKnowledge:
    return prepare(draw_laboratory("recupera_like_qdd", None, 2, SEED), SEED, quiet)


@pytest.fixture
def path(known: ControllerKnowledge, tmp_path: Path) -> Path:
    """Path that was taught before."""
    options, path = GuidedOptions(seed=SEED), tmp_path / "path.toml"
    run_teach(options, path, CODE, tmp_path, quiet, lambda *_asked: known)
    return path


def interrupted(act: Callable[[Progress], Any], pressed: Pressed, recorded: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        act(pressed)
    recording = read_recording(recorded)
    assert recording.remark is None
    assert not recording.messages("/result")


def test_in_the_middle_of_teaching_the_path_of_before_stays(path: Path, known: ControllerKnowledge):
    before = path.read_bytes()
    options = GuidedOptions(seed=SEED)
    act = partial(run_teach, options, path, CODE, path.parent, preparing=lambda *_asked: known)
    interrupted(act, Pressed("The arm floats; lead it", 100), path.parent / "teach.mcap")
    assert path.read_bytes() == before


def test_in_the_middle_of_repeating(path: Path, known: ControllerKnowledge):
    options = RepeatOptions(seed=SEED)
    act = partial(run_repeat, options, path, CODE, path.parent, preparing=lambda *_asked: known)
    interrupted(act, Pressed("Repeating the path", 100), path.parent / "repeat.mcap")


def test_before_a_mirror_has_begun(tmp_path: Path):
    act = partial(run_mirror, MirrorOptions(seed=SEED), tmp_path)
    interrupted(act, Pressed("", 5), tmp_path / "mirror.mcap")
