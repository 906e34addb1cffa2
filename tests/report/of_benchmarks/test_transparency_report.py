"""The page of a transparency test shows every condition, joint and machine, and states goals that were missed."""

from pathlib import Path

import pytest

from exograv.errors import RecordingError
from exograv.report.figures.transparency import CONDITIONS
from exograv.report.figures.transparency_data import (
    ConditionEffort,
    EffortRatios,
    MachineEffort,
    MachineTransparency,
    OffPath,
)
from exograv.report.of_benchmarks.transparency_report import effort_table, headline, write_transparency_report

JOINTS = ["flexion", "abduction", "rotation", "elbow"]


def made_up(profile: str, left: float) -> MachineTransparency:
    """Return figures as `exograv dev transparency` gives them."""
    sizes = [10.0, 4.0, 4.0 * left, 3.0 * left, 2.0 * left, 1.0 * left]
    conditions = {}
    for name, size in zip(CONDITIONS, sizes, strict=True):
        machines = [MachineEffort(seed, 4.0 * size + seed, [size] * 4, size**2, [0.5] * 4, 12) for seed in range(3)]
        conditions[name] = ConditionEffort(4.0 * size, [size] * 4, 0.5, size**2, machines)
    return MachineTransparency(
        rig=f"made_up_{profile}",
        profile=profile,
        disturbance_level=2,
        world="home",
        seeds=[0, 1, 2],
        movement="pointing",
        movement_s=22.0,
        recorded_samples=0,
        clipped_samples=0,
        joints=JOINTS,
        conditions=conditions,
        dam_over_gcm=EffortRatios(left, left, left**2, left),
        dam_minus_ideal_Nms=1.0,
        off_path=[OffPath("dam", 1, 1.3)],
        tracking_error_max_deg=1.0,
    )


RESULTS = [made_up("harmonic", 0.45), made_up("qdd", 0.4)]


def test_the_page_tells_both_drives_every_condition_and_joint(tmp_path: Path):
    text = write_transparency_report(RESULTS, tmp_path / "new" / "page.html").read_text(encoding="utf-8")
    assert "45 % with harmonic drives and 40 % with quasi-direct drives" in text
    for words in ("motors off", "0 g, no machine", "flexion", "elbow", "made_up_qdd", "not a medical device"):
        assert words in text
    assert text.count("<svg") == 2


def test_goals_reached_and_missed_are_told_apart(tmp_path: Path):
    text = write_transparency_report(RESULTS, tmp_path / "page.html").read_text(encoding="utf-8")
    assert text.count("target reached") == 2
    assert text.count("target not reached") == 1
    assert "goal: 25 % of the effort with only the machine carried" in text


def test_performances_off_the_path_are_owned_up_to(tmp_path: Path):
    assert "In 2 of 36 performances" in write_transparency_report(RESULTS, tmp_path / "p.html").read_text("utf-8")


def test_the_same_figures_give_the_same_page(tmp_path: Path):
    pages = [write_transparency_report(RESULTS, tmp_path / f"{k}.html").read_bytes() for k in range(2)]
    assert pages[0] == pages[1]


def test_the_table_has_a_row_for_each_condition():
    table = effort_table(RESULTS[0])
    assert [row[0] for row in table.rows] == [words.replace("\n", " ") for words in CONDITIONS.values()]
    assert all(len(row) == len(table.columns) for row in table.rows)


def test_one_kind_of_drive_alone_makes_a_page_too(tmp_path: Path):
    assert headline(RESULTS[:1]) == "With the arm carried too, 45 % with harmonic drives of the muscle effort remain."
    assert write_transparency_report(RESULTS[:1], tmp_path / "one.html").is_file()


def test_a_page_that_cannot_be_written_is_refused(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match="cannot be written"):
        write_transparency_report(RESULTS, tmp_path / "file" / "page.html")
