"""The report of a study has the parts that the command promises, and states what cannot be made."""

import json
from pathlib import Path

import pytest
from tests.study.made_up_sessions import settings, study_with, write_session

from exograv.errors import ConfigError
from exograv.report.study_report.report import write_study_report
from exograv.results import json_value
from exograv.study.dataset.adding import add_files
from exograv.study.dataset.options import AddOptions


@pytest.fixture(autouse=True)
def no_print(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace the layout on paper, which takes seconds; test_page.py checks it."""
    monkeypatch.setattr("exograv.report.study_report.page.write_pdf", lambda html: (None, "not printed"))


def test_a_study_of_recordings_has_the_report_that_the_command_promises(tmp_path: Path):
    folder, codes = study_with(tmp_path / "study", "trained", "untrained")
    for code in codes:
        add_files(folder, [write_session(tmp_path / f"{code}.mcap", settings(code, protocol="flight"))], AddOptions())
    told = list[str]()
    answer = write_study_report(folder.path, told.append)
    assert "primary" in json.dumps(json_value(answer), allow_nan=False)
    assert answer.compared.participants == {"trained": 1, "untrained": 1}
    assert answer.compared.deviation_px is not None
    assert answer.compared.deviation_px["trained"].median == 50.0
    assert answer.compared.primary is not None
    assert answer.compared.primary.test == "exact permutation"
    *read, compares, draws = told
    assert [phase.split()[0] for phase in read] == ["Reading", "Reading"]
    assert (compares.split()[0], draws.split()[0]) == ("Comparing", "Drawing")
    assert all(path.is_file() for path in (answer.report, *answer.figures))
    stored = json.loads((folder.derivatives / "statistics.json").read_text(encoding="utf-8"))
    assert stored["groups"] == ["trained", "untrained"]


def test_a_study_with_nothing_in_it_has_a_report_that_says_so(tmp_path: Path):
    folder, _ = study_with(tmp_path / "study")
    answer = write_study_report(folder.path)
    assert answer.compared.primary is None
    assert answer.compared.participants == {"trained": 0, "untrained": 0}
    assert "exograv study add" in str(answer.compared.not_compared)
    assert answer.report.is_file()


def test_a_folder_that_is_no_study_is_refused(tmp_path: Path):
    with pytest.raises(ConfigError, match="is not a study"):
        write_study_report(tmp_path)
