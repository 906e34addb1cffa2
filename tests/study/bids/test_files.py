"""A cell is a number, a word or n/a, never a text that another program reads as two cells."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.errors import ConfigError
from exograv.study.bids.files import cell, number_rows
from exograv.study.bids.names import SessionPlace, label, labels


@pytest.mark.parametrize("missing", [None, float("nan"), float("inf"), pd.NA, "", " \t "])
def test_what_is_missing_is_called_so(missing: object):
    assert cell(missing) == "n/a"


@given(st.text())
def test_no_text_becomes_two_cells_or_two_rows(text: str):
    assert len(cell(text).split("\t")) == 1
    assert len(cell(text).splitlines()) == 1


@given(st.floats(-1e6, 1e6))
def test_a_number_is_kept_to_a_millionth(value: float):
    assert float(cell(value)) == pytest.approx(value, abs=6e-7, rel=1e-9)


def test_rows_of_numbers_are_rounded_and_gaps_are_named():
    rows = number_rows([np.array([0.123456, np.nan, -0.0000001]), np.array([1.0, 2.0, np.inf])], [3, 0])
    assert rows == b"0.123\t1\nn/a\t2\n0\tn/a\n"


@given(st.lists(st.floats(-1e5, 1e5), min_size=1), st.integers(0, 9))
def test_every_row_reads_back_as_its_number(values: list[float], digits: int):
    text = number_rows([np.array(values)], [digits]).decode()
    assert [float(line) for line in text.splitlines()] == np.round(values, digits).tolist()


@given(st.text())
def test_a_label_has_letters_and_digits_of_ascii_only(text: str):
    assert label(text) == "" or (label(text).isascii() and label(text).isalnum())


def test_a_name_without_letters_is_refused():
    with pytest.raises(ConfigError, match="no letter and no digit"):
        labels(["--"], "Protocol")


def test_files_of_a_session_are_called_as_bids_wants_it():
    place = SessionPlace("A3CD4EF", "flight01")
    assert str(place.scans) == "sub-A3CD4EF/ses-flight01/sub-A3CD4EF_ses-flight01_scans.tsv"
    assert str(place.motion("exo", "motion.tsv")) == (
        "sub-A3CD4EF/ses-flight01/motion/sub-A3CD4EF_ses-flight01_task-pointing_tracksys-exo_motion.tsv"
    )
