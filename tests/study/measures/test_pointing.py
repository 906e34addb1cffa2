"""Errors of pointing are those of the law from which the touches were drawn."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.study.made_up_study import PITCH_MM, made_up_study

from exograv.study.measures.pointing import (
    counted,
    directions_deg,
    ellipse,
    mean_direction,
    pace_share,
    scatter_measures,
    session_measures,
)


def touches_at(right: np.ndarray, up: np.ndarray) -> pd.DataFrame:
    columns = {"deviation_x_px": right, "deviation_y_px": -up, "deviation_px": np.hypot(right, up)}
    mm = {name.replace("px", "mm"): PITCH_MM * values for name, values in columns.items()}
    return pd.DataFrame({**columns, **mm, "interval_s": 2.75, "pace": "right"})


def test_the_constant_error_is_the_mean_as_the_participant_sees_it():
    values = session_measures(touches_at(np.array([1.0, 3.0, 5.0]), np.array([10.0, 10.0, 40.0])), 1)
    assert values["constant_error_right_px"] == pytest.approx(3.0)
    assert values["constant_error_up_px"] == pytest.approx(20.0)
    assert values["constant_error_px"] == pytest.approx(np.hypot(3.0, 20.0))
    assert values["constant_error_up_mm"] == pytest.approx(PITCH_MM * 20.0)


@given(right=st.floats(-500.0, 500.0), up=st.floats(-500.0, 500.0))
def test_a_shift_of_all_touches_leaves_the_variable_error_as_it_was(right: float, up: float):
    rng = np.random.default_rng(1002)
    x, y = rng.normal(size=(2, 20))
    before, after = (scatter_measures(touches_at(x + a, y + b), "px") for a, b in ((0.0, 0.0), (right, up)))
    for name in ("variable_error_px", "ellipse_major_px", "ellipse_minor_px"):
        assert after[name] == pytest.approx(before[name], rel=1e-6)


def test_squared_variable_and_constant_error_make_up_the_mean_squared_deviation():
    x, y = np.random.default_rng(1003).normal(3.0, 2.0, size=(2, 50))
    values = scatter_measures(touches_at(x, y), "px")
    # The variance is computed about the sample's own mean, with n − 1 of n.
    expected = values["constant_error_px"] ** 2 + values["variable_error_px"] ** 2 * 49 / 50
    assert np.mean(x**2 + y**2) == pytest.approx(expected)


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 90.0, 150.0])
def test_the_ellipse_has_the_axes_and_the_angle_of_the_scatter_and_holds_its_share(angle_deg: float):
    rng = np.random.default_rng(1004)
    turn = np.exp(1j * np.deg2rad(angle_deg))
    z = (rng.normal(0.0, 3.0, 40_000) + 1j * rng.normal(0.0, 1.0, 40_000)) * turn
    major, minor, angle = ellipse(np.column_stack([z.real, z.imag]))
    assert major / minor == pytest.approx(3.0, rel=0.02)
    assert np.cos(2.0 * np.deg2rad(angle - angle_deg)) == pytest.approx(1.0, abs=1e-3)
    inside = (((z / turn).real / major) ** 2 + ((z / turn).imag / minor) ** 2 < 1.0).mean()
    assert inside == pytest.approx(0.95, abs=0.005)  # of 40 000: a standard error of 0.001


def test_directions_turn_from_right_to_up():
    assert directions_deg(np.array([[1.0, 0.0], [0.0, 2.0], [-1.0, 0.0], [0.0, -3.0]])).tolist() == [0, 90, 180, -90]


def test_directions_either_side_of_the_seam_have_their_mean_on_it_and_opposite_ones_have_none():
    mean, strength = mean_direction(np.array([170.0, -170.0]))
    assert abs(mean) == pytest.approx(180.0)
    assert strength == pytest.approx(np.cos(np.deg2rad(10.0)))
    assert mean_direction(np.array([0.0, 90.0, 180.0, 270.0]))[1] == pytest.approx(0.0, abs=1e-12)


def test_of_two_touches_no_scatter_is_told():
    values = scatter_measures(touches_at(np.array([1.0, 2.0]), np.array([1.0, 0.0])), "px")
    assert np.isnan([values["variable_error_px"], values["ellipse_major_px"]]).all()
    assert values["constant_error_px"] == pytest.approx(np.hypot(1.5, 0.5))


def test_a_screen_that_was_not_calibrated_has_pixels_and_no_millimetres():
    touches = counted(made_up_study({"trained": 1}, pitch_mm=None))
    assert np.isnan(scatter_measures(touches, "mm")["median_deviation_mm"])
    assert scatter_measures(touches, "px")["median_deviation_px"] > 0.0


def test_pace_that_nobody_judged_is_not_a_pace_that_nobody_kept():
    assert np.isnan(pace_share(pd.DataFrame({"pace": pd.Series([None, None], dtype="str")})))
    assert pace_share(pd.DataFrame({"pace": pd.Series(["right", "too_long", None], dtype="str")})) == 0.5


def test_touches_of_a_window_that_was_broken_off_do_not_count_and_of_one_run_twice_the_last_do():
    tables = made_up_study({"trained": 1}, {"trained": {"flight": 1}}, windows=3)
    windows = tables.windows.copy()
    windows.loc[windows["window"] == 2, "is_complete"] = False
    again = windows[windows["window"] == 3].assign(attempt=2)
    twice = tables.touches[tables.touches["window"] == 3].assign(attempt=2)
    changed = type(tables)(
        pd.concat([tables.touches, twice]), pd.concat([windows, again]), tables.sessions, tables.participants
    )
    kept = counted(changed)
    assert set(zip(kept["window"], kept["attempt"], strict=True)) == {(1, 1), (3, 2)}
    assert len(kept) == 16
