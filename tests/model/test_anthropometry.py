"""Body data from a form are checked, and the prior is as wide as the spread between people."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.errors import ConfigError
from exograv.model.anthropometry import MASS_SD, Body, Sex, segment_lengths, segment_parameters, segment_prior
from exograv.model.tree import is_physical

PERSON = Body(1.78, 80.0, "male")
LINEARISED = 0.03  # share: the covariance is linearised, but the spread of the inertia is lognormal


@pytest.mark.parametrize(
    ("measures", "expected"),
    [
        ((178.0, 80.0), "height is 178.0 m; allowed: 1.2 to 2.2 m. Was it given in cm or feet?"),
        ((5.8, 80.0), "height is 5.8 m"),
        ((1.78, 210.0), "body mass is 210.0 kg; allowed: 30 to 200 kg. Was it given in pounds or g?"),
        ((1.78, 176.0), "body-mass index of 55.5; allowed: 14 to 50. Check both units"),
        ((1.95, 45.0), "body-mass index of 11.8"),
        ((float("nan"), 80.0), "height is nan m"),
        ((1.78, float("inf")), "body mass is inf kg"),
    ],
)
def test_a_person_in_wrong_units_is_refused(measures: tuple[float, float], expected: str):
    with pytest.raises(ConfigError) as caught:
        Body(*measures, "male")
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("lengths", "expected"),
    [
        ({"upper_arm": 29.0}, "length of upper_arm is 29.0 m; allowed: 0.05 to 0.5 m. Was it given in cm?"),
        ({"forearm": float("nan")}, "length of forearm is nan m"),
        ({"upperarm": 0.29}, "No segment 'upperarm'. Segments: upper_arm, forearm, hand"),
    ],
)
def test_a_length_in_wrong_units_is_refused(lengths: dict[str, float], expected: str):
    with pytest.raises(ConfigError) as caught:
        Body(1.78, 80.0, "male", lengths)
    assert expected in str(caught.value)


def test_a_measured_length_replaces_the_tables_and_no_other():
    table, measured = segment_lengths(PERSON), segment_lengths(Body(1.78, 80.0, "male", {"forearm": 0.25}))
    assert measured == {**table, "forearm": 0.25}


@pytest.mark.parametrize("segment", MASS_SD)
def test_first_moments_spread_as_mass_and_centre_do(segment: str):
    mean, covariance = segment_prior(PERSON, segment)
    sd = np.sqrt(np.diag(covariance))
    mass, length = mean[0], segment_lengths(PERSON)[segment]
    np.testing.assert_allclose(sd[0], MASS_SD[segment] * mass, rtol=LINEARISED)
    np.testing.assert_allclose(sd[1:3], 0.015 * mass, rtol=LINEARISED)
    along = np.hypot(MASS_SD[segment] * mean[3], 0.06 * length * mass)
    np.testing.assert_allclose(sd[3], along, rtol=LINEARISED)


@pytest.mark.parametrize("segment", MASS_SD)
def test_a_heavier_segment_has_the_larger_first_moment(segment: str):
    _, covariance = segment_prior(PERSON, segment)
    assert covariance[0, 3] / np.sqrt(covariance[0, 0] * covariance[3, 3]) < -0.6


@pytest.mark.parametrize("segment", MASS_SD)
def test_the_prior_is_the_spread_of_drawn_people(segment: str):
    generator = np.random.default_rng(0)
    drawn = np.array([segment_parameters(PERSON, segment, d) for d in 0.2 * generator.normal(size=(4000, 10))])
    _, covariance = segment_prior(PERSON, segment)
    # The standard deviation of 4000 draws is exact to 1.1 %; the non-linear inertia adds up to 3 %.
    np.testing.assert_allclose(drawn.std(axis=0) / 0.2, np.sqrt(np.diag(covariance)), rtol=0.06)


MEASURES = st.tuples(st.floats(1.4, 2.1), st.floats(17.0, 45.0), st.sampled_from(["male", "female"]))


@given(measures=MEASURES)
def test_the_tables_arm_is_physical_for_everybody(measures: tuple[float, float, Sex]):
    height, body_mass_index, sex = measures
    person = Body(height, body_mass_index * height**2, sex)
    assert all(is_physical(segment_parameters(person, segment, np.zeros(10))) for segment in MASS_SD)
