"""The page of a virtual study has SIMULATED on every part, and claims only what its figures support."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.campaigns.virtual_study.made_up_flights import comparison, flight, main_study

from exograv.campaigns.virtual_study import figure_sensitivity as sensitivity
from exograv.campaigns.virtual_study.ablation import MECHANISMS, ablated_rows
from exograv.campaigns.virtual_study.figure_sensitivity import SensitivityPoint, spans
from exograv.campaigns.virtual_study.figure_windows import by_window
from exograv.campaigns.virtual_study.flight import FAMILIARISED, VirtualFlight
from exograv.campaigns.virtual_study.outcome import NO_EVIDENCE, outcome_of
from exograv.campaigns.virtual_study.page import Content, drawn, page_of, write_virtual_page
from exograv.campaigns.virtual_study.sentences import headline, sentences
from exograv.campaigns.virtual_study.small_study import SIZE
from exograv.report.style.page import page_text

SWEPT = (
    SensitivityPoint("width", 0.1, 0.05, (-0.1, 0.2)),
    SensitivityPoint("width", 0.6, 0.7, (0.6, 0.8)),
    SensitivityPoint("learns_aim", 0.1, 0.45, (0.4, 0.5)),
    SensitivityPoint("learns_aim", 0.4, 0.55, (0.5, 0.6)),
    SensitivityPoint("interval_sd", 0.0, None, None),
)


def flights() -> list[VirtualFlight]:
    found = main_study()
    for k in range(1, 7):
        found.append(flight(k, FAMILIARISED))
        found.append(flight(k, "dam", 0.5, left_over_Nm=0.2, friction_Nm=1.0))
        found.append(flight(k, "dam+friction=2", 0.6, left_over_Nm=0.3, friction_Nm=2.0))
        found.append(flight(k, "gcm", 1.0 + 0.1 * (-1) ** k, left_over_Nm=8.0, friction_Nm=1.0))
        found.append(flight(k, "water", 0.7))
    return found


def content(swept: tuple[SensitivityPoint, ...] = SWEPT, of: list[VirtualFlight] | None = None) -> Content:
    of = flights() if of is None else of
    links = {"report of the study": "report/report.html"}
    return Content(outcome_of(of, "dam"), of, {"seed": "1000", "people": "<3>"}, swept, 0.5, links)


def render(said: Content) -> str:
    return page_text(page_of(said, ()))


def words(figure) -> str:
    return " ".join(text.get_text() for text in figure.findobj(match=lambda one: hasattr(one, "get_text")))


@pytest.mark.slow
def test_the_page_needs_nothing_beside_it_but_its_links_and_has_four_pictures_twice(tmp_path: Path):
    page, figures = write_virtual_page(tmp_path, content())
    html = page.read_text(encoding="utf-8")
    assert re.findall(r'(?:src|href)="(?!#|data:)([^"]*)"', html) == ["report/report.html"]
    assert len(figures) == 8
    assert all(path.stat().st_size > 1000 for path in figures)
    assert html == write_virtual_page(tmp_path, content())[0].read_text(encoding="utf-8")


def test_simulated_stands_on_every_section_and_every_picture():
    said = content()
    sections = re.findall(r"<section.*?</section>", render(said), flags=re.DOTALL)
    assert len(sections) >= 5
    assert all("SIMULATED" in section for section in sections)
    assert all("SIMULATED" in words(one.figure) for one in drawn(said))
    assert NO_EVIDENCE in render(said)


def test_settings_cannot_change_the_page():
    assert "&lt;3&gt;" in render(content())


def test_the_headline_says_whether_the_published_direction_appears():
    assert "appears and is not shown (p = 0.1" in headline(outcome_of(main_study(share=0.4), "dam"))
    assert "does not appear" in headline(outcome_of(main_study(share=2.0), "dam"))
    assert "direction" not in headline(outcome_of(comparison({"dam": 0.5}), "dam"))


def test_three_against_three_are_told_as_what_no_test_can_show():
    said = sentences(outcome_of(main_study(share=0.4), "dam"))
    assert re.match(r"Over the whole flight the trained deviate less in \d of 9 pairs", said[0])
    assert "no test can show anything: p cannot be below 0.1" in said[0]


def test_a_mean_over_people_is_drawn_where_all_of_them_are():
    few = [flight(1, "dam", windows=(1, 2, 4)), flight(2, "dam", windows=(1, 2, 3)), flight(3, "dam", windows=())]
    up_mm = by_window(few)
    assert up_mm.shape == (2, 4)
    assert np.isfinite(up_mm.mean(axis=0)).tolist() == [True, True, False, False]


def test_the_page_tells_how_small_the_sweep_is():
    assert SIZE in sensitivity.TEXT
    assert "ideal" in sensitivity.TEXT


def test_an_ablation_has_a_table_and_sentences():
    rows = ablated_rows("dam", [comparison({"dam": 0.5}) for _ in MECHANISMS])
    html = render(replace(content(), ablated=rows))
    assert "slow_learns = 0" in html
    assert "In the small study transfer of dam is 0.5" in html
    assert "mechanisms" not in render(content())


def test_conditions_are_sorted_by_what_their_interval_carries():
    said = " ".join(sentences(outcome_of(flights(), "dam")))
    assert re.search(r"lies above 0 after dam \(transfer 0\.5\)", said)
    assert re.search(r"open whether anything was taken away, after gcm", said)
    assert "significant" not in said


def test_a_constant_that_takes_the_transfer_away_is_named():
    said = " ".join(sentences(outcome_of(flights(), "dam"), SWEPT, 0.5))
    assert "With width = 0.1 transfer is less than half of 0.5" in said
    assert "No constant alone" in " ".join(sentences(outcome_of(flights(), "dam"), SWEPT[1:], 0.5))


def test_a_constant_that_leaves_no_transfer_to_tell_is_not_passed_over():
    said = sentences(outcome_of(flights(), "dam"), SWEPT, 0.5)[-1]
    assert said.startswith("With interval_sd = 0 no transfer can be told")


def test_the_most_telling_constant_is_on_top_and_goes_from_low_to_high():
    order = spans([SWEPT[1], SWEPT[0], *SWEPT[2:]], 0.5)
    assert [own[0].name for own in order] == ["width", "learns_aim", "interval_sd"]
    assert [row.value for row in order[0]] == [0.1, 0.6]
    alone = SensitivityPoint("sees_higher_m", 0.08, -0.3, None)
    assert spans([*SWEPT, alone], 0.5)[0] == (alone,), "a constant with one end counts from the usual transfer"


@pytest.mark.parametrize("few", [[flight(1, "dam")], [flight(1, "dam", windows=())], main_study(people=1)])
def test_a_study_that_lacks_something_has_a_page_without_nan(few: list[VirtualFlight]):
    said = content((), few)
    assert "nan" not in re.sub(r"<[^>]*>", " ", render(said)).lower().split()
    list(drawn(said))
