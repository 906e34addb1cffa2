"""The page claims only what the study supports, marks simulated data, hides sealed groups, and exists in all cases."""

import builtins
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from tests.study.made_up_study import made_up_study, study_data

from exograv.report.study_report.chapters import Content
from exograv.report.study_report.headline import headline
from exograv.report.study_report.page import WrittenReport, page_of, write_study_page
from exograv.report.study_report.planning import next_study
from exograv.report.study_report.quality import QualityStatement, issues
from exograv.report.study_report.report import compared, reason_not_to_compare
from exograv.report.study_report.results import family_of, in_words, measures_table, number
from exograv.report.style.page import page_text, write_pdf
from exograv.study.measures.catalogue import MEASURES
from exograv.study.measures.emg_effort import muscle_effort
from exograv.study.measures.study_data import StudyData
from exograv.study.statistics.findings import StudyFindings

GROUND = {"trained": {"training": 1}, "untrained": {"familiarisation": 1}}


def study(**options) -> StudyData:
    return study_data(made_up_study(**{"windows": 2, "touches": 3, **options}))


@cache
def found_by_all() -> StudyFindings:
    """Return the findings of `study()`.

    Comparing takes a second; millimetres, names and `is_simulated` do not change them.
    """
    return compared(study())


def content(data: StudyData, found: StudyFindings | None = None) -> Content:
    why_not = reason_not_to_compare(data)
    if found is None and not why_not:
        found = compared(data)
    return Content(data, found, why_not, issues(data, QualityStatement()), {"training": ["target"]})


def page(data: StudyData, found: StudyFindings | None = None) -> str:
    return page_text(page_of(content(data, found), ()))


def text(html: str) -> str:
    """Return the visible text of a page in one line."""
    body = re.sub(r"<style>.*?</style>", "", html, flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", body))


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> WrittenReport:
    data, found = study(), found_by_all()
    said = replace(content(data, found), planned=next_study(data, found.groups))
    return write_study_page(tmp_path_factory.mktemp("report"), said)


@pytest.fixture
def no_print(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace the layout on paper, which takes seconds."""
    monkeypatch.setattr("exograv.report.study_report.page.write_pdf", lambda html: (None, None))


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the figures out of the page, which take a second."""
    monkeypatch.setattr("exograv.report.style.page.inline_svg", lambda *_: "")


@pytest.mark.slow
def test_the_page_needs_nothing_beside_it_and_has_every_figure_twice(written: WrittenReport):
    html = written.html.read_text(encoding="utf-8")
    assert not re.findall(r'(?:src|href)="(?!#|data:)[^"]*"', html)
    assert "<script src" not in html
    assert {path.suffix for path in written.figures} == {".svg", ".png"}
    assert all(path.stat().st_size > 1000 for path in written.figures)


@pytest.mark.slow
@pytest.mark.usefixtures("no_print")
def test_the_same_study_gives_the_same_page(written: WrittenReport, tmp_path: Path):
    data = study()
    again = write_study_page(
        tmp_path, replace(content(data, compared(data)), planned=next_study(data, ("trained", "untrained")))
    )
    assert again.html.read_bytes() == written.html.read_bytes()


@pytest.mark.slow
def test_the_print_is_a_pdf_whose_every_sheet_is_headed_by_what_it_is(written: WrittenReport):
    assert written.pdf is not None
    assert written.pdf.read_bytes().startswith(b"%PDF")
    html = written.html.read_text(encoding="utf-8")
    assert '@top-right { content: "SIMULATED: nobody took part"' in html


def test_a_study_of_people_is_nowhere_called_simulated():
    assert "simulated" not in text(page(study(is_simulated=False), found_by_all())).lower().replace(
        "simulated microgravity", ""
    )


def test_what_three_against_three_cannot_say_stands_before_any_figure():
    said = text(page(study(), found_by_all()))
    assert "With 3 against 3 people this test cannot reach 0.05" in said
    assert "p = 0.100, the smallest possible" in said
    assert "significant" not in said


def test_a_page_of_sealed_groups_names_no_group_and_compares_nothing():
    said = text(page(study(is_sealed=True)))
    assert "trained" not in said
    assert "carried share" not in said
    assert "Groups are sealed, so there is no comparison" in said


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"protocols": GROUND}, "No participant has flown yet"),
        ({"people": {"trained": 2}}, "No participant of the group untrained flew"),
        ({"people": {"trained": 0}}, "There are no accepted touches yet"),
    ],
)
def test_a_study_that_lacks_something_says_what(options: dict, sentence: str):
    assert sentence in text(page(study(**options)))


@pytest.mark.usefixtures("no_figures")
def test_screens_that_were_not_calibrated_are_told_in_pixels():
    assert "deviations are given in pixels" in text(page(study(pitch_mm=None), found_by_all()))


def test_one_person_a_group_is_a_page_without_a_claim():
    said = text(page(study(people={"trained": 1, "untrained": 1})))
    assert "n = 1" in said
    assert "nan" not in said.lower().split()


def test_a_name_of_a_study_cannot_change_the_page():
    data = study()
    evil = data.settings.model_copy(update={"name": '<script>alert("x")</script>\\'})
    html = page(StudyData(evil, data.tables, data.measures, data.traces), found_by_all())
    assert "<script>alert" not in html


def test_without_pango_there_is_a_page_and_a_sentence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    real = builtins.__import__

    def without(name: str, *others):
        if name == "weasyprint":
            raise OSError("cannot load library 'libpango-1.0-0'")
        return real(name, *others)

    monkeypatch.setattr(builtins, "__import__", without)
    (tmp_path / "a.html").write_text("<p>a</p>")
    path, remark = write_pdf(tmp_path / "a.html")
    assert path is None
    assert remark is not None
    assert "apt install" in remark
    assert not (tmp_path / "a.pdf").exists()


def test_the_headline_makes_no_claim_about_groups():
    assert headline(study(is_sealed=True), None).endswith("Groups are sealed.")


def test_a_table_of_measures_has_no_row_twice():
    names = [row[0] for row in measures_table(study()).rows]
    assert len(names) == len(set(names))


def test_numbers_have_three_digits_that_count():
    assert [number(v) for v in (0.0, 12.345, -1234.5, 0.00012)] == ["0", "12.3", "−1230", "0.00012"]


def test_a_measures_name_in_words_has_no_unit_left():
    assert in_words("hand_peak_speed_m_per_s") == "hand peak speed"
    assert not [m.name for m in MEASURES if re.search(r" (px|mm|deg|Nm|rad|s|m)$", in_words(m.name))]


@pytest.mark.usefixtures("no_figures")
def test_measures_are_tested_as_one_family_whose_p_values_are_never_below_the_smallest_possible():
    data = study()
    family = family_of(data, found_by_all())
    assert family is not None
    assert min(family.table["p"].tolist()) >= 0.1 - 1e-12
    assert "tested as one family" in text(page(data, found_by_all()))
    alone = study(people={"trained": 1, "untrained": 1})
    assert family_of(alone, compared(alone)) is None


@pytest.mark.usefixtures("no_figures")
def test_the_effort_of_the_muscles_is_a_chapter_that_sealed_groups_hide():
    from tests.study.measures.test_emg_effort import made_up  # its fixtures read no recording

    said = text(page_text(page_of(replace(content(study(), found_by_all()), effort=muscle_effort(*made_up(8))), ())))
    assert "Effort in weightless windows (16) divided by that at 1 g (8), 8 people: 0.6" in said
    assert "no notch, as no mains are stated" in said
    sealed = study(is_sealed=True)
    hidden = replace(content(sealed), effort=muscle_effort(*made_up(8, sealed=True)))
    said = text(page_text(page_of(hidden, ())))
    assert "EMG is not shown while groups are sealed" in said
    assert "Effort in weightless windows" not in said
