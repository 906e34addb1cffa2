"""A CSV of touches is cut by session. Each line becomes a touch, or is refused with a reason."""

import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.study.made_up_sessions import study_with

from exograv.errors import RecordingError
from exograv.study.dataset.adding import add_files
from exograv.study.dataset.making import refresh
from exograv.study.dataset.options import AddOptions
from exograv.study.dataset.tables import frame, read_tables
from exograv.study.folder.columns import SESSIONS, TOUCHES, WINDOWS
from exograv.study.importers.imported_session import StatedSession
from exograv.study.importers.touch_sheet import SheetPart, cut_sheet

CODES = ("K9RR9PR", "R7RX4L7")
HEAD = "participant,protocol,session,window,t_s,x_px,y_px,target_x_px,target_y_px,gravity_level\n"
LINES = (
    "K9RR9PR,training,1,1,10.5,990,500,960,540,0\n"
    "K9RR9PR,training,1,1,13.2,950,545,960,540,0\n"
    "R7RX4L7,training,1,1,11.0,970,540,960,540,1\n"
)


def cut(text: str, said: StatedSession | None = None, level: float | None = None) -> tuple[list[SheetPart], list[str]]:
    return cut_sheet(text.encode(), said or StatedSession(), level, lambda code: code if code in CODES else None)


def test_each_session_gets_its_lines_as_they_were():
    (one, other), nowhere = cut(HEAD + LINES)
    assert nowhere == []
    assert one.said == StatedSession("K9RR9PR", "training", 1)
    assert one.content.decode() == HEAD + "".join(LINES.splitlines(keepends=True)[:2])
    assert other.content.decode() == HEAD + LINES.splitlines(keepends=True)[2]


def test_rows_fit_the_contract():
    (one, _), _ = cut(HEAD + LINES)
    found, key = one.imported(), {"participant": "K9RR9PR", "protocol": "training", "session": 1}
    frame(TOUCHES, [{**key, **row} for row in found.touches])
    frame(WINDOWS, [{**key, **row} for row in found.windows])
    frame(SESSIONS, [{**key, **found.session, "source": "a", "sha256": "b"}])
    assert [row["deviation_px"] for row in found.touches] == pytest.approx([50.0, 125.0**0.5])


@pytest.mark.parametrize(("delimiter", "comma"), [(";", True), ("\t", True), (";", False), ("\t", False), (",", False)])
def test_delimiter_and_decimal_comma_change_nothing(delimiter: str, comma: bool):
    text = (HEAD + LINES).replace(",", delimiter)
    text = text.replace(".", ",") if comma else text
    (one, other), nowhere = cut(text)
    (same, alike), _ = cut(HEAD + LINES)
    assert (one.touches, other.touches, nowhere) == (same.touches, alike.touches, [])


def test_both_decimal_signs_in_one_file_are_refused_with_their_lines():
    text = (HEAD + LINES).replace(",", ";").replace("13.2", "13,2")
    with pytest.raises(RecordingError, match="Line 3 has a decimal comma and line 2 a decimal point"):
        cut(text)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("K9RR9PR,training,1,1,9.0,1,2,3\n", "the line has 8 cells"),
        ("K9RR9PR,training,1,1,soon,1,2,3,4,0\n", "t_s is not a number"),
        ("K9RR9PR,training,1,1,inf,1,2,3,4,0\n", "t_s is not a number"),
        ("K9RR9PR,training,1,1.5,9.0,1,2,3,4,0\n", "window is not a whole number"),
        ("K9RR9PR,training,1,1,9.0,,2,3,4,0\n", "x_px is missing"),
        ("K9RR9PR,training,1,1,9.0,1,2,,4,0\n", "target_x_px and deviation_x_px are missing"),
        ('K9RR9PR,training,1,1,9.0,"1,2,3,4,0\n', "a quote in the line is not closed"),
        ("Anneliese,training,1,1,9.0,1,2,3,4,0\n", "its participant is not a code"),
        ("K9RR9PR,../training,1,1,9.0,1,2,3,4,0\n", "its protocol is not a name"),
        ("K9RR9PR,training,0,1,9.0,1,2,3,4,0\n", "its session is not a whole number from 1"),
    ],
)
def test_a_line_that_cannot_be_used_is_named_and_the_others_are(line: str, reason: str):
    parts, nowhere = cut(HEAD + LINES + line)
    refusals = [*nowhere, *(one for part in parts for one in part.refusals)]
    assert len(refusals) == 1
    assert refusals[0].startswith("line 5: ")
    assert reason in refusals[0]
    assert "Anneliese" not in refusals[0]
    assert sum(len(part.touches) for part in parts) == 3


def test_a_deviation_that_is_not_contact_minus_target_is_refused():
    head = HEAD.replace("gravity_level", "gravity_level,deviation_x_px,deviation_y_px")
    parts, _ = cut(
        head + "K9RR9PR,training,1,1,1,990,500,960,540,0,30,-40\nK9RR9PR,training,1,1,2,990,500,960,540,0,40,-30\n"
    )
    assert len(parts[0].touches) == 1
    assert "deviation_x_px is not x_px minus target_x_px" in parts[0].refusals[0]


def test_a_column_that_might_name_a_person_is_refused_by_its_place():
    with pytest.raises(RecordingError, match="Column 11 is not a known column") as refused:
        cut(HEAD.strip() + ",Surname Annelie\n" + LINES)
    assert "Annelie" not in str(refused.value)


def test_missing_columns_are_named_with_what_may_be_told_instead():
    with pytest.raises(RecordingError, match=r"session \(or --session\).*gravity_level \(or --gravity-level\)"):
        cut("participant,protocol,window,t_s,x_px,y_px,target_x_px,target_y_px\n")
    (part,), _ = cut(
        "window,t_s,x_px,y_px,target_x_px,target_y_px\n1,2,3,4,5,6\n", StatedSession("K9RR9PR", "flight", 1), 0.0
    )
    assert part.touches[0]["gravity_level"] == 0.0


@pytest.mark.parametrize("content", [b"", b"\xff\xfea\x00b\x00", b"\x00\x01\x02", b"a letter\nto somebody\n"])
def test_what_is_no_such_text_is_refused_in_a_sentence(content: bytes):
    with pytest.raises(RecordingError):
        cut_sheet(content, StatedSession(), None, lambda code: code)


@given(st.binary(max_size=300))
def test_no_bytes_at_all_end_in_anything_but_a_sentence(content: bytes):
    for head in (b"", HEAD.encode()):
        with contextlib.suppress(RecordingError):
            cut_sheet(head + content, StatedSession(), None, lambda code: code)


def test_a_file_of_two_people_comes_in_as_two_sessions_and_again_not_at_all(tmp_path: Path):
    folder, codes = study_with(tmp_path / "study", "trained", "untrained")
    path = tmp_path / "all.csv"
    path.write_text((HEAD + LINES).replace(CODES[0], codes[0]).replace(CODES[1], codes[1]))
    assert [one.what for one in add_files(folder, [path], AddOptions())] == ["added", "added"]
    assert [one.what for one in add_files(folder, [path], AddOptions())] == ["already there"]
    before = read_tables(folder)
    assert sorted(before.touches["participant"]) == sorted([codes[0], codes[0], codes[1]])
    assert refresh(folder, everything=True).touches.equals(before.touches)


def test_a_sheet_under_other_codes_comes_in_by_new_codes_and_again_from_its_place(tmp_path: Path):
    folder, (code,) = study_with(tmp_path / "study", "trained")
    path = tmp_path / "old.csv"
    path.write_text((HEAD + LINES.splitlines(keepends=True)[0]).replace(CODES[0], "P-02"))
    assert [one.what for one in add_files(folder, [path], AddOptions(new_code=(f"P-02={code}",)))] == ["added"]
    assert refresh(folder, everything=True).touches["participant"].tolist() == [code]
