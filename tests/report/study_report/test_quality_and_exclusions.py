"""Every flaw is named and counted, and every touch is either used or left out for one reason."""

import pandas as pd
import pytest
from tests.study.made_up_study import made_up_study, study_data

from exograv.report.study_report.exclusions import BROKEN_OFF, exclusions
from exograv.report.study_report.quality import QualityStatement, issues
from exograv.study.dataset.quarantine import QuarantineNote
from exograv.study.dataset.tables import Tables
from exograv.study.folder.journal import JournalEntry
from exograv.study.measures.selecting import rows
from exograv.study.measures.study_data import StudyData

COMPLETE = {"trained": {"training": 16, "flight": 1}, "untrained": {"familiarisation": 4, "flight": 1}}


def study(**changes: pd.DataFrame) -> StudyData:
    """Return the published design with two windows and touches each, with these tables instead of its own."""
    tables = made_up_study({"trained": 1, "untrained": 1}, COMPLETE, windows=2, touches=2)
    return study_data(Tables(**{**vars(tables), **changes}))


def found(data: StudyData, told: QualityStatement | None = None) -> dict[str, tuple[int, str]]:
    return {one.what: (one.count, one.which) for one in issues(data, told or QualityStatement())}


def test_a_study_without_a_flaw_has_none():
    assert found(study()) == {}


@pytest.mark.parametrize(
    ("column", "value", "what"),
    [
        ("is_complete", False, "sessions that did not run to their end"),
        ("remark", "It was cut.", "sources with remarks"),
        ("pitch_x_mm", None, "sessions on a screen that was not calibrated"),
        ("clock_jumps", 1, "sessions in which a clock jumped"),
        ("ticks_lost", 5, "sessions with lost ticks"),
        ("stops", 1, "sessions with stops"),
        ("calibration_sha256", None, "sessions with an active machine without calibration"),
    ],
)
def test_a_flawed_session_is_counted_and_named(column: str, value: object, what: str):
    sessions = study().tables.sessions
    sessions.loc[0, column] = value
    count, which = found(study(sessions=sessions))[what]
    assert count == 1
    assert which.startswith("T1QX training 1")


def test_missing_sessions_are_named_as_runs():
    sessions = study().tables.sessions
    kept = rows(sessions, ~((sessions["protocol"] == "training") & sessions["session"].between(3, 5)))
    assert found(study(sessions=kept)) == {"expected sessions that are missing": (3, "T1QX training 3–5")}


def test_a_window_that_was_broken_off_or_marked_is_named():
    windows = study().tables.windows
    windows.loc[0, "is_complete"] = False
    windows.loc[1, "marks"] = "feed lost;short"
    what = found(study(windows=windows))
    assert what["interrupted windows"] == (1, "T1QX training 1 window 1")
    assert what["windows marked `feed lost`"] == what["windows marked `short`"] == (1, "T1QX training 1 window 2")


def test_what_the_folder_tells_is_told():
    aside = {"ab": QuarantineNote("ab", None, "It is no recording.")}
    told = QualityStatement(aside, [JournalEntry(what="refused", sentence="Twice.")], ["No ticks."])
    what = found(study(), told)
    assert what["files in quarantine"] == (1, "It is no recording.")
    assert what["refused files or lines"] == (1, "Twice.")
    assert what["recordings whose movements could not be read"] == (1, "No ticks.")


def test_counted_and_excluded_touches_make_up_all_that_were_recorded():
    tables = study().tables
    touches, windows = tables.touches, tables.windows
    touches.loc[[0, 5, 9], "is_accepted"] = False
    touches.loc[[0, 5], "reason"] = "palm"
    windows.loc[3, "is_complete"] = False
    data = study(touches=touches, windows=windows)
    found = {one.reason: one.touches for one in exclusions(data)}
    assert found == {"as large as a palm": 2, "no reason was stated": 1, BROKEN_OFF: 2}
    assert sum(found.values()) + len(data.touches) == len(touches)
