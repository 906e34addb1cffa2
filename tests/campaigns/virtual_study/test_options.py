"""Options give the careers of a virtual study, and impossible options are refused before it begins."""

import pytest

from exograv.campaigns.virtual_study.careers import careers
from exograv.campaigns.virtual_study.options import StudyOptions
from exograv.errors import ConfigError

CODES = tuple(f"V{k}" for k in range(6))


def test_everybody_of_the_main_study_is_recorded_once_and_nobody_else():
    found = careers(StudyOptions(conditions=("dam", "water")), CODES)
    assert sorted(one.code for one in found if one.code is not None) == list(CODES)
    assert [one.condition_name for one in found if one.code is None] == ["water"] * 3 + ["familiarised"] * 3


def test_the_trained_fly_for_the_comparison_before_their_training_goes_on():
    main = careers(StudyOptions(sessions=(16, 4)), CODES)[0]
    assert main.flights == ((4, "comparison"), (16, "trained"))
    assert main.sessions == 16


def test_whoever_trains_no_longer_than_the_comparison_flies_once():
    main = careers(StudyOptions(sessions=(2, 4)), CODES)[0]
    assert main.flights == ((2, "trained"),)


def test_one_number_is_one_person_in_every_condition():
    found = careers(StudyOptions(conditions=("dam", "ideal", "parabolic")), CODES)
    by_person = {}
    for one in found:
        by_person.setdefault(one.person, set()).add(one.seed)
    assert all(len(seeds) == 1 for seeds in by_person.values())
    assert len({min(seeds) for seeds in by_person.values()}) == 6


def test_names_of_careers_are_all_different():
    options = StudyOptions(conditions=("ideal", "ideal+left=0.2", "ideal@quasi-direct", "ideal+friction=2"))
    names = [one.name for one in careers(options, CODES)]
    assert len(set(names)) == len(names)


def test_another_seed_draws_other_people():
    first, other = (careers(StudyOptions(seed=seed), CODES)[0].seed for seed in (1000, 1001))
    assert first != other


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"participants": (0, 3)}, "--participants"),
        ({"participants": (3, -1)}, "--participants"),
        ({"sessions": (100, 1)}, "--sessions"),
        ({"conditions": ()}, "--conditions"),
        ({"conditions": ("dam", "dam")}, "twice"),
        ({"conditions": ("swimming",)}, "swimming"),
        ({"conditions": ("parabolic", "dam")}, "parabolic"),
        ({"windows": 0}, "--windows"),
        ({"flight_windows": 32}, "--flight-windows"),
        ({"level": 5}, "--level"),
        ({"compared": (-1, 1)}, "--compared"),
        ({"constants": {"luck": 1.0}}, "luck"),
        ({"constants": {"width": float("nan")}}, "width"),
        ({"constants": {"width": 0.0}}, "width is 0; allowed: above 0"),
        ({"constants": {"trusts_felt": 1.0}}, "trusts_felt is 1; allowed: from 0 to 0.99"),
        ({"constants": {"motor_noise": -0.1}}, "motor_noise"),
    ],
)
def test_what_cannot_be_is_refused_by_name(changes, word):
    with pytest.raises(ConfigError, match=word):
        StudyOptions(**changes)


def test_a_changed_constant_is_everybodys():
    assert StudyOptions(constants={"width": 0.1}).habits.rates.width == 0.1
