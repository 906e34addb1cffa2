"""Figures of a study show every person, distinguish groups without colour, and show SIMULATED for simulated data."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from tests.study.made_up_study import made_up_study, study_data

from exograv.report.study_figures import deviation, gravity, learning, quality, target, windows
from exograv.report.study_figures.groups import LOOKS, WIDTH_1, WIDTH_2, look
from exograv.report.style.figure_style import JOURNAL, house_style
from exograv.study.measures.study_data import StudyData

FIGURES = (deviation, gravity, learning, quality, target, windows)
FEW: dict[str, Any] = {"windows": 3, "touches": 4}


def drawn(module, data: StudyData) -> Figure:
    with house_style(JOURNAL):
        figure = module.draw(data)
        assert figure is not None
        figure.draw_without_rendering()
        return figure


def words(figure: Figure) -> str:
    return " ".join(text.get_text() for text in figure.findobj(Text) if isinstance(text, Text))


@pytest.fixture(scope="module")
def data() -> StudyData:
    return study_data(made_up_study(**FEW))


@pytest.fixture(scope="module")
def people() -> StudyData:
    return study_data(made_up_study(is_simulated=False, **FEW))


@pytest.fixture(scope="module")
def sealed() -> StudyData:
    return study_data(made_up_study(is_sealed=True, **FEW))


@pytest.mark.parametrize("module", FIGURES)
def test_a_figure_of_a_simulated_study_says_so_and_one_of_people_does_not(module, data: StudyData, people: StudyData):
    assert "SIMULATED" in words(drawn(module, data))
    assert "SIMULATED" not in words(drawn(module, people))


@pytest.mark.parametrize("module", FIGURES)
def test_figures_are_as_wide_as_a_column_of_a_journal_or_two(module, data: StudyData):
    assert drawn(module, data).get_size_inches()[0] in (WIDTH_1, WIDTH_2)


@pytest.mark.parametrize("module", FIGURES)
def test_a_figure_of_sealed_groups_names_none(module, sealed: StudyData):
    said = words(drawn(module, sealed)) + module.explain(sealed)
    assert "trained" not in said


@pytest.mark.parametrize("module", FIGURES)
def test_without_anybody_there_is_no_figure(module):
    assert module.draw(study_data(made_up_study({"trained": 0}))) is None


def test_groups_differ_by_marker_line_and_hatching_and_not_by_colour_alone(data: StudyData):
    first, second = (look(data, group) for group in data.groups)
    assert first.marker != second.marker
    assert first.line != second.line
    assert first.hatch != second.hatch
    assert all(one.marker != other.marker for one, other in pairwise(LOOKS))


def test_every_persons_touches_and_median_are_in_the_main_figure(data: StudyData):
    ax = drawn(deviation, data).axes[0]
    heights = [np.atleast_1d(line.get_ydata()) for line in ax.get_lines()]
    for _, touches in data.compared.groupby("participant"):
        values = touches["deviation_px"].to_numpy()
        assert any(len(h) == len(values) and np.allclose(np.sort(h), np.sort(values)) for h in heights)
        assert any(np.allclose(h, np.median(values)) for h in heights)


def test_only_flight_is_compared_and_without_a_flight_the_last_session_of_each(data: StudyData):
    assert set(data.compared["protocol"]) == {"flight"}
    ground = study_data(made_up_study(protocols={"trained": {"training": 3}, "untrained": {"training": 2}}, **FEW))
    last = ground.compared.groupby("participant")["session"].unique()
    assert {tuple(numbers) for numbers in last} == {(3,), (2,)}
    assert "last session of each person" in deviation.explain(ground)


def test_the_second_axis_is_in_millimetres_where_screens_were_calibrated_alike(data: StudyData):
    assert "deviation [mm]" in words(drawn(deviation, data))
    assert "deviation [mm]" not in words(drawn(deviation, study_data(made_up_study(pitch_mm=None, **FEW))))


def test_a_session_that_is_expected_and_missing_is_on_the_sheet(data: StudyData):
    # 16, 4 and 1 sessions are expected, as published; 3, 2 and 1 exist.
    assert "45 missing" in quality.explain(data)
    states = quality.session_states(data)
    assert states["T1QX", "training", 4] == "missing"
    assert states["T1QX", "flight", 1] == "whole"


def test_a_session_of_which_something_is_wrong_is_not_whole(data: StudyData):
    tables = data.tables
    sessions = tables.sessions.copy()
    sessions.loc[0, "stops"] = 1
    sessions.loc[1, "is_complete"] = False
    states = quality.session_states(
        study_data(type(tables)(tables.touches, tables.windows, sessions, tables.participants))
    )
    keys = sessions[["participant", "protocol", "session"]].itertuples(index=False, name=None)
    assert [states[key] for key in keys][:3] == ["something wrong", "not complete", "whole"]
