"""The data of a figure are those that it draws, with names, panels and axes."""

import csv
import io
from urllib.parse import unquote

import numpy as np
import pytest
from matplotlib.figure import Figure

from exograv.report.style.figure_data import data_link, figure_csv

HOSTILE = '", <b> & #\n%41'


def rows_of(text: str) -> list[dict[str, str]]:
    """Read as a spreadsheet would, without the comment lines."""
    return list(csv.DictReader(line for line in io.StringIO(text) if not line.startswith("#")))


@pytest.fixture
def figure() -> Figure:
    drawn = Figure()
    first, second = drawn.subplots(1, 2)
    first.set(title="Left, over", xlabel="time [s]", ylabel="torque [N·m]")
    first.plot([0.0, 1.0, 2.0], [1.5, np.nan, 2.5], label="a, b")
    first.axhline(7.0)
    second.bar([0.0, 1.0], [3.0, 4.0], 0.5, label="bars")
    second.scatter([5.0], [6.0], label=HOSTILE)
    return drawn


def test_curves_bars_and_dots_have_their_points_and_names(figure: Figure):
    found = [(row["panel"], row["series"], float(row["x"]), float(row["y"])) for row in rows_of(figure_csv(figure))]
    assert found[:2] == [("1", "a b", 0.0, 1.5), ("1", "a b", 2.0, 2.5)]
    assert [row for row in found if row[1] == "bars"] == [("2", "bars", 0.0, 3.0), ("2", "bars", 1.0, 4.0)]
    assert [row[2:] for row in found if row[0] == "2" and row[1] != "bars"] == [(5.0, 6.0)]


def test_a_line_across_a_panel_is_no_datum(figure: Figure):
    assert 7.0 not in [float(row["y"]) for row in rows_of(figure_csv(figure))]


def test_comments_name_the_panels_and_their_axes(figure: Figure):
    assert "# panel 1: Left over; x: time [s]; y: torque [N·m]\n" in figure_csv(figure)


def test_a_figure_without_data_has_no_csv():
    drawn = Figure()
    drawn.subplots().axhline(1.0)
    assert figure_csv(drawn) == ""


def test_a_link_holds_the_text_and_cannot_leave_its_attribute(figure: Figure):
    text = figure_csv(figure)
    link = data_link(text + HOSTILE)
    assert not {'"', "<", ">", "&", "#", "\n"} & set(link)
    assert unquote(link.partition(",")[2]) == text + HOSTILE
