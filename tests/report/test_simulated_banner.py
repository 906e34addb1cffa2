"""Every page and picture that is made from simulated data says so, whoever makes it."""

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.report.of_benchmarks.test_identification_benchmark import ROW, result
from tests.report.of_benchmarks.test_transparency_report import RESULTS

import exograv
from exograv.recording import RecordingWriter
from exograv.report.of_benchmarks.identification_benchmark import write_benchmark_page
from exograv.report.of_benchmarks.transparency_report import write_transparency_report
from exograv.report.of_recording.recording_report import write_report
from exograv.report.style.page import SIMULATED

SOURCE = Path(exograv.__file__).parent
ALWAYS = ("SIMULATED", "word('simulated')")
"""Expressions of makers whose data can only be simulated."""
MAKERS = {
    "report/of_recording/recording_report.py": ("SIMULATED if recording.is_simulated else ''",),
    "report/study_report/page.py": ("NO_EVIDENCE if content.data.is_simulated else ''",),
    "report/of_benchmarks/transparency_report.py": ALWAYS,
    "report/of_benchmarks/identification_benchmark.py": ALWAYS,
    "report/of_recording/twin_report.py": ("SIMULATED_MACHINE if figures.is_simulated else ''",),
    "procedures/rehabilitation/assist/page.py": ("simulated",),
    "campaigns/virtual_study/page.py": ALWAYS,
}
"""Modules that make a page, and what they may give as its banner."""
NOT_OF_A_RUN = ("procedures/machine_tools/check_rig/__init__.py", "cli/machine/design_motion.py")
"""Modules whose pictures show a file or a plan, and no data of a run."""


def calls(name: str) -> Iterator[tuple[str, ast.Call]]:
    """Yield module and call of each function or class with this name, outside the room that defines it."""
    for path in sorted(SOURCE.rglob("*.py")):
        place = path.relative_to(SOURCE).as_posix()
        text = path.read_text(encoding="utf-8")
        if f"{name}(" not in text or place.startswith("report/style/"):
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == name:
                yield place, node


def test_every_maker_of_a_page_gives_it_the_banner_of_its_data():
    found = dict(calls("Page"))
    assert set(found) == set(MAKERS), "A new page needs a line in MAKERS and a test that looks for its banner."
    for place, call in found.items():
        given = [ast.unparse(one.value) for one in call.keywords if one.arg == "simulated"] or [
            ast.unparse(call.args[2])
        ]
        assert given[0] in MAKERS[place]


def test_every_module_that_writes_a_picture_of_a_run_marks_simulated_data():
    unmarked = {
        place
        for place, _ in calls("write_picture")
        if "simulated" not in (SOURCE / place).read_text(encoding="utf-8").lower()
    }
    assert unmarked == set(NOT_OF_A_RUN)


SETTINGS = {
    "a command on the twin, such as demo, train, weigh or support-level": {"disturbance_level": 0},
    "a participant model": {"settings": {"participant_model": {}}},
    "a live run with --simulate": {"command": "exograv run live --simulate"},
}


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
def test_the_report_of_a_simulated_recording_has_the_banner(settings: dict, tmp_path: Path):
    with RecordingWriter(tmp_path / "a.mcap", ("elbow_flexion",), settings):
        pass
    assert SIMULATED in write_report(tmp_path / "a.mcap", tmp_path / "a.html").read_text(encoding="utf-8")


def test_the_report_of_a_real_machine_has_none(tmp_path: Path):
    settings = {"command": "exograv run live", "rig": "recupera_like"}
    with RecordingWriter(tmp_path / "a.mcap", ("elbow_flexion",), settings) as recording:
        recording.write("/left_over", 0.0, {"motion_s": 0.0, "total": np.zeros(1)})
    assert "SIMULATED" not in write_report(tmp_path / "a.mcap", tmp_path / "a.html").read_text(encoding="utf-8")


def test_benchmarks_on_the_twin_have_the_banner_and_their_picture_the_mark(tmp_path: Path):
    assert SIMULATED in write_transparency_report(RESULTS, tmp_path / "a.html").read_text(encoding="utf-8")
    assert SIMULATED in write_benchmark_page(result([ROW]), tmp_path).page.read_text(encoding="utf-8")
