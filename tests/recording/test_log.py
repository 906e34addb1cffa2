"""A foreign log is cut to its motion, loses no row without a count, and is refused if it has another content."""

import os
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import RecordingError
from exograv.recording import read_log

DATA = Path(os.environ.get("EXOGRAV_DATA", Path(__file__).parents[3] / "shared" / "data")) / "ur10e"
JOINTS = ("turn", "lift")
SIX = ("a", "b", "c", "d", "e", "f")


def rows_of_motion(rest_before: int = 100, motion: int = 400, rest_after: int = 60) -> np.ndarray:
    """Return a drive to the start, a rest, the motion, a rest; 100 Hz; time, q, v, current and one further column."""
    moving = [*[1.0] * 30, *[0.0] * rest_before, *[1.0] * motion, *[0.0] * rest_after]
    n = len(moving)
    t = 838.0 + 0.01 * np.arange(n)
    v = np.array(moving)[:, None] * np.array([0.5, -1.0]) + 1e-4 * np.sin(np.arange(n))[:, None]
    q = np.cumsum(0.01 * v, axis=0)
    return np.column_stack([t, q, v, 2.0 * v, np.full(n, 7.0)])


def write(path: Path, rows: np.ndarray, header: str = "") -> Path:
    lines = [",".join(f"{value:.6f}" for value in row) for row in rows]
    path.write_text("\n".join([header, *lines] if header else lines) + "\n")
    return path


def test_the_longest_motion_between_two_rests_is_kept(tmp_path: Path):
    log = read_log(write(tmp_path / "log.csv", rows_of_motion()), JOINTS)
    assert log.rows == (131, 530)
    assert len(log.t) == 400
    assert log.skipped == 0
    np.testing.assert_allclose(log.effort, 2.0 * log.v, atol=1e-6)


def test_memory_of_a_log_grows_by_at_most_four_times_its_numbers(tmp_path: Path):
    counts, peaks = (1000, 9000), list[int]()
    for count in counts:
        path = write(tmp_path / "log.csv", rows_of_motion(motion=count))
        tracemalloc.start()
        read_log(path, JOINTS)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    numbers_bytes = 8 * (1 + 3 * len(JOINTS))
    assert peaks[1] - peaks[0] < 4 * numbers_bytes * (counts[1] - counts[0])


def test_a_header_is_counted_as_a_line_and_not_as_a_loss(tmp_path: Path):
    log = read_log(write(tmp_path / "log.csv", rows_of_motion(), "t,q0,q1,v0,v1,i0,i1,extra"), JOINTS)
    assert log.rows == (132, 531)
    assert log.skipped == 0


def test_chosen_rows_are_used_as_they_are(tmp_path: Path):
    log = read_log(write(tmp_path / "log.csv", rows_of_motion()), JOINTS, "10:250")
    assert log.rows == (10, 250)
    assert len(log.t) == 241


def test_cut_rows_non_finite_numbers_and_repeated_times_are_skipped_and_counted(tmp_path: Path):
    path = write(tmp_path / "log.csv", rows_of_motion())
    lines = path.read_text().splitlines()
    lines[200] = lines[200][:11]
    lines[210] = lines[210].replace(",", ",nan,", 1).rsplit(",", 1)[0]
    lines[220] = "garbage" + lines[220]
    lines[230] = lines[229]
    path.write_text("\n".join(lines))
    log = read_log(path, JOINTS)
    assert log.skipped == 4
    assert len(log.t) == 396
    assert np.all(np.diff(log.t) > 0)


def test_a_log_with_many_bad_rows_is_refused(tmp_path: Path):
    rows = rows_of_motion()
    rows[200:300, 0] = rows[200, 0]
    with pytest.raises(RecordingError, match="one in ten"):
        read_log(write(tmp_path / "log.csv", rows), JOINTS)


def test_too_few_columns_are_named(tmp_path: Path):
    with pytest.raises(RecordingError, match="8 columns; 6 joints need 19"):
        read_log(write(tmp_path / "log.csv", rows_of_motion()), SIX)


def test_time_in_milliseconds_is_refused(tmp_path: Path):
    rows = rows_of_motion()
    rows[:, 0] *= 1000.0
    with pytest.raises(RecordingError, match="time in seconds"):
        read_log(write(tmp_path / "log.csv", rows), JOINTS)


def test_a_log_in_which_nothing_moves_is_refused(tmp_path: Path):
    rows = rows_of_motion()
    rows[:, 3:5] = 0.0
    with pytest.raises(RecordingError, match="Nothing moves"):
        read_log(write(tmp_path / "log.csv", rows), JOINTS)


@pytest.mark.parametrize("rows", ["5", "a:b", "9:3", "0:10", "-4:10"])
def test_invalid_row_ranges_are_refused(rows: str, tmp_path: Path):
    with pytest.raises(RecordingError, match="first:last"):
        read_log(write(tmp_path / "log.csv", rows_of_motion()), JOINTS, rows)


def test_rows_outside_the_file_are_refused(tmp_path: Path):
    with pytest.raises(RecordingError, match="0 usable rows in 9000:9100"):
        read_log(write(tmp_path / "log.csv", rows_of_motion()), JOINTS, "9000:9100")


def test_an_empty_or_absent_or_binary_file_is_a_readable_error(tmp_path: Path):
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x81")
    for name, words in (("empty.csv", "0 columns"), ("none.csv", "cannot be read"), ("binary.csv", "no CSV text")):
        with pytest.raises(RecordingError, match=words):
            read_log(tmp_path / name, JOINTS)


# The rows are those in the README of the data. The rule may begin or end a fifth of a second of creeping away from
# them.
@pytest.mark.parametrize(
    ("name", "rows"),
    [("ur-20_02_19_14harm50sec.csv", (195, 4966)), ("ur-20_02_19_14harm50secLoad.csv", (308, 5071))],
)
def test_a_real_log_is_cut_to_its_motion(name: str, rows: tuple[int, int]):
    if not (DATA / name).is_file():
        pytest.skip(f"no recorded UR10e log: {name} is not in $EXOGRAV_DATA/ur10e (docs say where to get it)")
    log = read_log(DATA / name, SIX)
    np.testing.assert_allclose(log.rows, rows, atol=20)
    assert log.skipped == 0
    assert 49.5 < log.t[-1] - log.t[0] < 50.5
