"""A session interrupted by Ctrl-C continues where it was, under the same guard, and its recordings are complete."""

from pathlib import Path

import numpy as np
import pytest

from exograv.console.words import said_in
from exograv.laboratory.assist.assist_command import run_assist
from exograv.procedures.rehabilitation.assist.options import AssistOptions
from exograv.procedures.rehabilitation.assist.participant_record import AssistBlock, AssistSession, read_assist
from exograv.procedures.rehabilitation.assist.session_files import assist_file
from exograv.procedures.rehabilitation.assist.words import AssistTexts
from exograv.recording import read_recording
from exograv.safety.guard import GRAVITY_LEVEL_S
from exograv.task.assist_as_needed import SENTENCES

pytestmark = pytest.mark.slow

PROTOCOL = """
schema_version = 1
name = "short"
title = "To try it"
blocks = 2
[support]
block = 4
step_down_percent = 10.0
step_up_percent = 10.0
"""
WORDS = AssistTexts("en", {"en": SENTENCES, "de": said_in("de")})


def quiet(_text: str, _share: float) -> None:
    pass


def leave(_session: AssistSession, _block: AssistBlock) -> None:
    raise KeyboardInterrupt


def test_a_session_that_was_left_goes_on_and_every_change_of_support_went_by_the_guards_ramp(tmp_path: Path):
    (tmp_path / "short.toml").write_text(PROTOCOL, encoding="utf-8")
    options = AssistOptions(participant="P-07", protocol=str(tmp_path / "short.toml"), seed=1000, strength=0.1)
    with pytest.raises(KeyboardInterrupt):
        run_assist(options, tmp_path, WORDS, leave, quiet)
    kept = read_assist(assist_file(options, tmp_path), "P-07", options.kept)
    assert (len(kept.sessions[0].blocks), kept.sessions[0].is_over) == (1, False)
    assert "Complete blocks: 1" in (tmp_path / "assist_P-07.html").read_text(encoding="utf-8")

    phases = list[str]()
    result = run_assist(
        options, tmp_path, WORDS, lambda _session, _block: None, lambda text, _share: phases.append(text)
    )
    assert phases[-1] == "Block 2 of 2"
    assert (result.found.session, result.found.blocks) == (1, 2)
    assert result.found.supports_percent[1] == kept.sessions[0].state.support_percent
    for name, blocks in (("assist_P-07_01.mcap", [1]), ("assist_P-07_01_from_2.mcap", [2])):
        recording = read_recording(tmp_path / name)
        decided = [one["record"] for one in recording.messages("/task") if one["kind"] == "assist_decided"]
        assert [one["block"] for one in decided] == blocks
        assert set(decided[0]["text"]) == {"en", "de"}
        levels = [one["gravity_level"] for one in recording.messages("/control") if one["act"] == "level"]
        # Each tick of a changing level has a message, for 1 ms of the ramp. Full support has none.
        assert np.abs(np.diff([0.0, *levels])).max(initial=0.0) <= 1e-3 / GRAVITY_LEVEL_S + 1e-9
        assert recording.is_simulated
        assert not [one for one in recording.messages("/event") if one["kind"] == "stop"]
