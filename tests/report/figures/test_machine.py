"""The picture of a machine shows every joint with its limit, from plain numbers, without model or twin."""

from pathlib import Path

import numpy as np
import pytest

from exograv.errors import RecordingError
from exograv.report.figures.machine import draw
from exograv.report.figures.machine_data import DrawnArm, MachinePicture, TorqueRow
from exograv.report.style.figure_style import house_style, write_picture


def check(limit: float | None) -> MachinePicture:
    reach = 0.05 * np.argwhere(np.ones((8, 8, 8))) + 0.025
    arm = DrawnArm(
        side="right",
        exo=np.array([[0.0, -0.2, 0.5], [0.0, -0.2, 0.2], [0.2, -0.2, 0.2]]),
        links=np.array([[0.0, -0.3, 0.5, 1.5], [0.0, -0.3, 0.3, 0.6]]),
        arm=np.array([[0.0, -0.2, 0.5], [0.0, -0.2, 0.2], [0.25, -0.2, 0.2], [0.4, -0.2, 0.2]]),
        cuffs=np.array([[0.0, -0.2, 0.3], [0.15, -0.2, 0.2]]),
        reach=reach,
        task=reach[:64],
    )
    rows = [TorqueRow(joint, limit, 6.0, 10.0, -2.0, 3.0) for joint in ("shoulder_flexion", "elbow_flexion")]
    return MachinePicture("A machine", [arm], 4, 4, 5.0, 3.7, rows, 0.05)


def words(check: MachinePicture) -> list[str]:
    with house_style():
        figure = draw(check)
        figure.draw_without_rendering()
    texts = [figure.get_suptitle()]
    for ax in figure.axes:
        texts += [label.get_text() for label in ax.get_yticklabels()] + [text.get_text() for text in ax.texts]
    return texts


def test_every_joint_stands_there_with_what_its_drive_has():
    found = words(check(60.0))
    assert {"shoulder flexion", "elbow flexion"} <= set(found)
    assert found.count("60 N·m") == 2
    assert "The cuffs constrain 4 of 4 degrees of freedom; the drives hold an arm of 5.0 kg" in found[0]


def test_a_machine_without_motors_says_so():
    found = words(check(None))
    assert found.count("no motor") == 2
    assert "no motors" in found[0]


def test_a_picture_that_cannot_be_written_is_refused(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match="cannot be written"):
        write_picture(tmp_path / "file" / "x.png", lambda: draw(check(60.0)))
