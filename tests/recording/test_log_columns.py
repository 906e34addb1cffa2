"""Columns of a log are found by name or by choice, and the order of the file does not matter."""

from pathlib import Path

import numpy as np
import pytest

from exograv.errors import RecordingError
from exograv.recording import read_log

JOINTS = ("turn", "lift")


def motion() -> np.ndarray:
    """Time, q, v, current of two joints; torque is ten times the current."""
    t = 0.01 * np.arange(300)
    q = np.sin(t[:, None] * np.array([1.0, 2.0]))
    v = np.cos(t[:, None] * np.array([1.0, 2.0])) * np.array([1.0, 2.0])
    return np.column_stack([t, q, v, 3.0 * v])


def write(path: Path, header: str, order: list[int], rows: np.ndarray) -> Path:
    lines = [",".join(f"{value:.6f}" for value in row[order]) for row in rows]
    path.write_text("\n".join([header, *lines] if header else lines) + "\n")
    return path


SHUFFLED = [5, 6, 3, 4, 0, 1, 2]


@pytest.mark.parametrize(
    "header",
    [
        "current_turn,current_lift,qd_turn,qd_lift,time [s],q_turn,q_lift",
        "i1,i2,v1,v2,t,q1,q2",
        "actual_current_0,actual_current_1,actual_qd_0,actual_qd_1,timestamp,actual_q_0,actual_q_1",
    ],
)
def test_usual_names_are_found_in_any_order(tmp_path: Path, header: str):
    log = read_log(write(tmp_path / "log.csv", header, SHUFFLED, motion()), JOINTS, "1:400")
    np.testing.assert_allclose(np.column_stack([log.t, log.q, log.v, log.effort]), motion(), atol=1e-6)


def test_torques_are_taken_where_currents_stand_beside_them(tmp_path: Path):
    rows = np.column_stack([motion(), 10.0 * motion()[:, 5:]])
    header = "t,q0,q1,v0,v1,i0,i1,tau0,tau1"
    path = write(tmp_path / "log.csv", header, list(range(9)), rows)
    np.testing.assert_allclose(read_log(path, JOINTS, "1:400", is_torque=True).effort, rows[:, 7:], atol=1e-5)
    np.testing.assert_allclose(read_log(path, JOINTS, "1:400").effort, rows[:, 5:7], atol=1e-5)


@pytest.mark.parametrize(
    ("header", "choice"),
    [("", "5,6,3,1"), ("a b,c,d,e,zeit,wa_1,wa_2", "zeit,wa_*,3,1"), ("x1,x2,y1,y2,t,p1,p2", "t,p*,y*,x*")],
)
def test_chosen_columns_are_read_from_logs_with_and_without_header(tmp_path: Path, header: str, choice: str):
    log = read_log(write(tmp_path / "log.csv", header, SHUFFLED, motion()), JOINTS, "1:400", choice)
    np.testing.assert_allclose(np.column_stack([log.t, log.q, log.v, log.effort]), motion(), atol=1e-6)


@pytest.mark.parametrize(
    ("choice", "words"), [("1,2,3", "four words"), ("t,p*,y*,z*", "no columns 'z\\*'"), ("1,2,4,7", "needs? 8")]
)
def test_a_choice_that_the_log_does_not_have_is_refused(tmp_path: Path, choice: str, words: str):
    path = write(tmp_path / "log.csv", "x1,x2,y1,y2,t,p1,p2", SHUFFLED, motion())
    with pytest.raises(RecordingError, match=words):
        read_log(path, JOINTS, columns=choice)
