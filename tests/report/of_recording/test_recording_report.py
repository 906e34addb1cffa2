"""The report shows the content of a recording, leaves out missing parts, and needs only the recording."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import RecordingError
from exograv.recording import Recording, RecordingWriter, read_recording
from exograv.report.figures.parameters import MOST_PANELS, most_learned
from exograv.report.figures.postures import distinct_frames, projected
from exograv.report.of_recording.headline import headline, tiles
from exograv.report.of_recording.recording_report import FIGURES, page_of, write_report
from exograv.report.style.figure_style import averaged, thinned
from exograv.report.style.page import page_text
from exograv.study.targets import joint_groups, target_of, targets

JOINTS = ("shoulder_flexion", "elbow_flexion")
VOID = {"meta", "wbr", "br", "img", "link", "input", "hr"}


def render(recording: Recording) -> str:
    return page_text(page_of(recording))


class Outline(HTMLParser):
    """Parser that collects the parts of a page, and checks that its elements close."""

    def __init__(self):
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str]] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def outline(page: str) -> Outline:
    parser = Outline()
    parser.feed(page)
    assert parser.open == []
    return parser


def chapters(page: str) -> list[str]:
    return re.findall(r'<section id="(\w+)">', page)


@pytest.fixture(scope="module")
def page(demo_recording: Path) -> str:
    return render(read_recording(demo_recording))


def test_a_whole_session_fills_every_chapter_but_those_of_other_devices_and_of_a_task(page: str):
    assert chapters(page) == [name for name, _, _ in FIGURES if name not in ("devices", "touches")]


def test_the_page_is_well_formed_and_fetches_nothing(page: str):
    parts = outline(page)
    fetched = [value for name, value in parts.attributes if name in ("src", "href", "xlink:href", "data")]
    assert all(value.startswith(("#", "data:text/csv")) for value in fetched)
    assert "@import" not in page
    assert "url(http" not in page


def test_the_page_says_what_was_found_and_on_what(page: str):
    text = outline(page).text
    for words in (
        "On target after 22 s of motion",
        "0.18 N·m at the shoulder and 0.07 N·m at the elbow are left over",
        "Recupera-like arm, harmonic drives, passive forearm",
        "0 (weightless)",
        "true 1.000 kg",
        "This run against 3 other simulated wearers.",
        "holds a still arm, so a small drift says little; the left over says more",
        "not a medical device",
        "hardware emergency stop",
        "0f0f0f",
        "The arm is let go.",
    ):
        assert words in text


@pytest.mark.long
def test_the_same_recording_gives_the_same_page(page: str, demo_recording: Path):
    assert render(read_recording(demo_recording)) == page


def test_a_recording_without_results_still_gives_a_page(tmp_path: Path):
    with RecordingWriter(tmp_path / "a.mcap", JOINTS, {}):
        pass
    page = write_report(tmp_path / "a.mcap", tmp_path / "new" / "report.html").read_text(encoding="utf-8")
    assert chapters(page) == []
    assert "was not completed" in outline(page).text


def test_an_identification_without_a_twin_shows_what_the_machine_believes(tmp_path: Path):
    with RecordingWriter(tmp_path / "a.mcap", JOINTS, {"rig": "own"}) as recording:
        for k in range(5):
            entry = {
                "name": "upper_arm.mass",
                "unit": "kg",
                "prior": 2.0,
                "estimate": 2.1,
                "ci95": [2.0 - 0.1 * k, 2.2],
            }
            message = {"motion_s": 1.0 * k, "parameters": [entry], "outcome": "Still learning."}
            recording.write("/estimate", 1.0 * k, {**message, "predicted_left_over_Nm": [0.5, 0.2]})
        recording.write(
            "/result", 5.0, {"identification": {"motion_s": 5.0, "time_to_target_s": None, "outcome": "Done."}}
        )
    page = render(read_recording(tmp_path / "a.mcap"))
    assert chapters(page) == ["progress", "parameters"]
    assert "the machine itself predicts" in page
    assert "examiner" not in page


def test_parameters_without_an_interval_are_drawn(tmp_path: Path):
    with RecordingWriter(tmp_path / "a.mcap", JOINTS, {"method": "gradient"}) as recording:
        for k in range(3):
            entry = {"name": "upper_arm.mass", "unit": "kg", "prior": 2.0, "estimate": 2.1, "ci95": None}
            recording.write("/estimate", 1.0 * k, {"motion_s": 1.0 * k, "parameters": [entry], "outcome": "Learning."})
    assert chapters(render(read_recording(tmp_path / "a.mcap"))) == ["parameters"]


def test_a_cut_recording_says_so_on_the_page(demo_recording: Path, tmp_path: Path):
    content = demo_recording.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[: len(content) // 2])
    page = render(read_recording(tmp_path / "cut.mcap"))
    assert "cut.mcap ends abruptly at" in outline(page).text
    assert "left_over" not in chapters(page)


def test_names_and_texts_cannot_put_code_into_the_page(tmp_path: Path):
    evil = '<script>alert("x")</script>'
    with RecordingWriter(tmp_path / "a.mcap", (f"joint{evil}",), {"title": evil}) as recording:
        recording.write("/event", 0.0, {"kind": evil, "text": evil})
        for k in range(3):
            recording.write("/left_over", 1.0 * k, {"motion_s": 1.0 * k, "total": [0.3]})
    page = render(read_recording(tmp_path / "a.mcap"))
    assert "progress" in chapters(page)
    assert "<script>alert" not in page


def test_files_and_long_lists_of_the_settings_are_folded_and_short_values_are_in_the_table(tmp_path: Path):
    files = {"rig.toml": "# a machine\n" + 50 * "a = 1\n"}
    settings = {"title": "Own machine", "settings": {"rig_files": files, "weights": 100 * [1.5]}}
    with RecordingWriter(tmp_path / "a.mcap", JOINTS, settings):
        pass
    page = render(read_recording(tmp_path / "a.mcap"))
    assert re.findall("<summary>(.*?)</summary>", page) == [
        "settings.rig_files.rig.toml (52 lines)",
        "settings.weights (102 lines)",
    ]
    assert "<td>Own machine</td>" in page


def test_a_missed_target_is_never_called_weightless(tmp_path: Path):
    with RecordingWriter(tmp_path / "a.mcap", JOINTS, {}) as recording:
        scores = {"total": {"identified": [0.25, 0.05]}}
        identification = {"motion_s": 60.0, "time_to_target_s": 40.0, "stop": "time", "outcome": ""}
        recording.write("/result", 60.0, {"left_over_rms_Nm": scores, "identification": identification})
    recording = read_recording(tmp_path / "a.mcap")
    assert headline(recording).startswith("After 60 s of motion 0.25 N·m")
    assert [tile.is_good for tile in tiles(recording)] == [False, True]


def test_the_parts_of_both_arms_are_judged_one_by_one():
    joints = ("right_shoulder_flexion", "right_elbow_flexion", "left_shoulder_flexion", "left_elbow_flexion")
    assert list(joint_groups(joints)) == ["right shoulder", "right elbow", "left shoulder", "left elbow"]
    assert [target_of(joint) for joint in (*joints, "forearm_roll")] == [0.2, 0.1, 0.2, 0.1, 0.05]


def test_the_shoulder_is_as_good_as_its_worst_axis(demo_recording: Path):
    recording = read_recording(demo_recording)
    assert joint_groups(recording.joints) == {"shoulder": [0, 1, 2], "elbow": [3]}
    np.testing.assert_array_equal(targets(recording), [0.2, 0.2, 0.2, 0.1])
    assert tiles(recording)[0].value == "0.18 N·m"


def test_a_torque_that_the_envelope_changed_is_counted(tmp_path: Path):
    zero = {
        name: np.zeros(2) for name in ("q_measured", "q_reference", "v", "current", "tau_measured", "tau_feedforward")
    }
    with RecordingWriter(tmp_path / "a.mcap", JOINTS, {}) as recording:
        for k in range(4):
            torques = {"tau_desired": np.array([9.0, 1.0]), "tau_commanded": np.array([9.0 - (k == 2), 1.0])}
            recording.tick(1e-3 * k, closure_slope=0.0, tick_us=50.0, **zero, **torques)
    np.testing.assert_array_equal(read_recording(tmp_path / "a.mcap").computing_times.limited_share, [0.25, 0.0])


def test_the_parameters_that_closed_most_are_shown():
    first = [{"name": str(k), "ci95": [-1.0, 1.0]} for k in range(40)]
    last = [{"name": str(k), "ci95": [-1.0, 1.0] if k % 2 else [-0.1, 0.1]} for k in range(40)]
    assert most_learned(first, last) == [str(k) for k in range(0, 40, 2)]
    assert len(most_learned(last, last)) == MOST_PANELS


def test_the_postures_shown_are_those_that_differ():
    frames = [{"t": float(k), "arm": [[0.0, 0.0, 0.01 * k]]} for k in range(100)]
    assert [frame["t"] for frame in distinct_frames(frames, 3)] == [0.0, 49.0, 99.0]
    assert distinct_frames(frames[:2], 3) == frames[:2]


@pytest.mark.parametrize("outward", [-1.0, 1.0])
def test_a_drawn_person_stands_upright_and_reaches_away_from_the_other_arm(outward: float):
    up, forward = projected(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]), outward)
    assert up[1] > 0.9
    assert abs(up[0]) < 1e-12
    assert forward[0] * outward < 0.0


def test_averaging_keeps_the_mean_and_thinning_keeps_the_ends():
    t, values = averaged(np.arange(1000.0), np.arange(2000.0).reshape(1000, 2), 10)
    assert (t.shape, values.shape) == ((10,), (10, 2))
    assert values[:, 0].mean() == 999.0
    assert list(thinned(100, 3)) == [0, 49, 99]
    assert list(thinned(0, 3)) == []


def test_a_page_that_cannot_be_written_is_a_readable_error(tmp_path: Path):
    with RecordingWriter(tmp_path / "a.mcap", JOINTS, {}):
        pass
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="give a folder with write permission"):
        write_report(tmp_path / "a.mcap", tmp_path / "file" / "report.html")


def test_the_report_loads_neither_casadi_nor_mujoco():
    code = "import sys, exograv.study; print(sorted({'casadi', 'mujoco', 'scipy', 'pinocchio'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
