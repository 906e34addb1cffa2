"""An open question in a rig file is found with its place and comment, and refused before anything else is read."""

import shutil
from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.model.description import load_rig, robots_folder
from exograv.model.open_questions import Question, open_questions

TEXT = """\
name = "machine"  # not a "?" of its own
title = 'Really?'
[donning]
posture_deg = "?"  # 4 angles
[[cuffs]]
exo_frame = '?'
lower_deg = ["?", 1.0]  # "?" twice
"""


def test_every_question_is_found_with_its_table_and_its_comment():
    assert open_questions(TEXT) == [
        Question(4, "donning.posture_deg", "4 angles"),
        Question(6, "cuffs.exo_frame", ""),
        Question(7, "cuffs.lower_deg", '"?" twice'),
    ]


def test_the_machines_that_come_with_exograv_ask_nothing():
    for path in robots_folder().glob("*/rig.toml"):
        assert not open_questions(path.read_text(encoding="utf-8"))


def test_a_machine_that_still_asks_is_refused_with_the_first_question(tmp_path: Path):
    machine = tmp_path / "machine"
    shutil.copytree(robots_folder() / "recupera_like", machine)
    text = (machine / "rig.toml").read_text(encoding="utf-8")
    (machine / "rig.toml").write_text(text.replace("gear_ratio = 100.0", 'gear_ratio = "?"  # turns', 2))
    with pytest.raises(
        ConfigError, match=r"open questions: 2. The first: line \d+, actuators.gear_ratio: turns. Answer each"
    ) as caught:
        load_rig(str(machine))
    assert f"exograv rig check {machine}" in str(caught.value)
