"""Wearers follow their regressions, with the spread that no table can remove, and are physically possible."""

from dataclasses import replace

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.rig.twin import Body, Disturbances, draw_wearer
from exograv.rig.twin.wearer.regressions import TABLE
from exograv.rig.twin.wearer.segments import draw_body, draw_segments, is_physical

SAMPLE_MAN = Body("male", height=1.741, mass=73.0)
SAMPLE_WOMAN = Body("female", height=1.735, mass=61.9)
EXACT = Disturbances.at_level(0).without("segment_residual")


def test_the_mean_man_has_the_masses_and_centres_of_the_sample():
    for name, mass, from_distal in (("upper_arm", 1.979, 13.3), ("forearm", 1.175, 14.3), ("hand", 0.451, 11.8)):
        rows = TABLE["male"][name]
        assert rows.mass.mean(73.0, 1.741) == pytest.approx(mass, abs=5e-4)
        assert rows.centre.mean(73.0, 1.741) == pytest.approx(from_distal, abs=0.06)  # printed to 1 mm


def test_the_mean_woman_has_the_masses_and_moments_of_the_sample():
    segments = draw_segments(SAMPLE_WOMAN, EXACT, 0)
    expected = {
        "upper_arm": (1.58, 92.3, 80.7, 26.2),
        "forearm": (0.86, 40.9, 39.7, 5.3),
        "hand": (0.35, 6.0, 4.4, 2.4),
    }
    for name, (mass, *moments) in expected.items():
        assert segments[name].mass == pytest.approx(mass)
        np.testing.assert_allclose(np.diag(segments[name].inertia), 1e-4 * np.array(moments), rtol=1e-12)


def test_centres_counted_from_the_joint_agree_with_joint_centre_tables():
    # de Leva re-expressed the same sample at joint centres: 57.7, 45.7, 36.2 % of the length (men).
    segments = draw_segments(SAMPLE_MAN, EXACT, 0)
    shares = [-segments[name].com[2] / segments[name].length for name in ("upper_arm", "forearm", "hand")]
    np.testing.assert_allclose(shares, [0.577, 0.457, 0.362], atol=0.015)


@pytest.mark.parametrize("level", range(5))
def test_every_wearer_could_exist(level: int):
    for seed in range(40):
        for segment in draw_segments(draw_body(seed), Disturbances.at_level(level), seed).values():
            assert is_physical(segment.mass, segment.inertia)


def test_people_are_as_tall_and_heavy_as_the_population():
    bodies = [draw_body(seed) for seed in range(1500)]
    men = [body for body in bodies if body.sex == "male"]
    assert len(men) / len(bodies) == pytest.approx(0.5, abs=0.04)
    assert np.mean([man.height for man in men]) == pytest.approx(1.78, abs=0.01)
    assert np.std([man.height for man in men]) == pytest.approx(0.07, abs=0.006)
    masses = np.array([body.mass for body in bodies])
    assert masses.min() >= 45.0
    assert masses.max() <= 95.0


def test_one_body_has_many_arms_with_the_spread_of_the_regression():
    drawn = [draw_segments(SAMPLE_MAN, Disturbances.at_level(0), seed)["forearm"] for seed in range(400)]
    assert np.std([segment.mass for segment in drawn]) == pytest.approx(0.101, rel=0.12)
    assert np.mean([segment.mass for segment in drawn]) == pytest.approx(1.175, abs=0.02)
    assert np.std([segment.length for segment in drawn]) == pytest.approx(0.0111, rel=0.12)


def test_studies_differ_from_each_other_as_much_as_the_level_says():
    level = EXACT.with_row("between_study", 2)
    masses = np.array([draw_segments(SAMPLE_MAN, level, seed)["hand"].mass for seed in range(400)])
    assert np.std(np.log(masses)) == pytest.approx(0.08, rel=0.12)


def test_lengths_given_to_the_software_are_wrong_by_as_much_as_the_level_says():
    people = [draw_wearer(Disturbances.at_level(2), seed) for seed in range(300)]
    errors = [p.lengths_given[name] - length for p in people for name, length in p.arms[0].skeleton.lengths.items()]
    assert np.std(errors) == pytest.approx(0.006, rel=0.08)


def test_donning_offsets_are_uniform_within_the_level():
    offsets = np.array([draw_wearer(Disturbances.at_level(2), seed).arms[0].donning_offset for seed in range(300)])
    assert np.abs(offsets).max() <= 0.015
    assert np.std(offsets) == pytest.approx(0.015 / np.sqrt(3.0), rel=0.08)


def test_the_same_seed_is_the_same_person():
    level = Disturbances.at_level(3)
    first, second = draw_wearer(level, 7), draw_wearer(level, 7)
    assert first.body == second.body
    hands = [one.arms[0].skeleton.bone("hand") for one in (first, second)]
    np.testing.assert_array_equal(hands[0].com, hands[1].com)


def test_a_body_beyond_the_regressions_is_refused():
    with pytest.raises(ConfigError, match="No physically possible"):
        draw_wearer(EXACT, 0, body=replace(SAMPLE_MAN, height=1.0, mass=20.0))
