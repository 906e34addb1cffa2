"""The benchmark draws the same wearers and machines for all methods, and refuses bad options in one line."""

from dataclasses import replace

import pytest

from exograv.campaigns.benchmark_identification.cases import Case, by_machine, population
from exograv.campaigns.benchmark_identification.options import (
    BenchmarkOptions,
    levels_of,
    methods_of,
    profiles_of,
)
from exograv.campaigns.benchmark_identification.tasks import machines
from exograv.errors import ConfigError
from exograv.rig.twin.disturbances.levels import MACHINE, WEARER

CASE = Case("harmonic", 2, wearer_seed=0, machine_seed=0)


def test_more_wearers_leave_the_first_ones_as_they_were():
    assert population("qdd", 2, 30, 0)[:7] == population("qdd", 2, 7, 0)


def test_tuning_wearers_share_no_machine_with_reported_ones():
    assert min(case.machine_seed for case in population("qdd", 2, 30, 1000)) == 1000


def test_some_wearers_are_third_parties_arms():
    arms = [case.arm for case in population("harmonic", 2, 12, 0)]
    assert (arms[5], arms[11], arms.count("drawn")) == ("arm26", "rajagopal", 10)


@pytest.mark.parametrize("arm", ["arm26", "rajagopal"])
def test_a_third_partys_arm_is_drawn_into_the_machine(arm):
    model = replace(CASE, arm=arm).laboratory().wearer_model
    assert model is not None
    assert model.title


def test_a_machine_is_calibrated_once_for_all_that_only_its_wearers_differ_in():
    wearers = [replace(CASE, without=name) for name in WEARER]
    assert len(by_machine([CASE, *wearers])) == 1
    assert len(by_machine([replace(CASE, without=name) for name in MACHINE])) == len(MACHINE)


def test_a_wearer_who_never_lets_go_stirs_more_and_is_else_the_same():
    calm, stirring = CASE.laboratory().wearer, replace(CASE, restless=True).laboratory().wearer
    assert (stirring.arms[0].unrest.bias_rms > calm.arms[0].unrest.bias_rms).all()
    assert (stirring.passive.stiffness == calm.passive.stiffness).all()


def test_streams_and_wearers_count_apart():
    groups = machines(BenchmarkOptions(wearers=1, streams=2, methods=("recursive", "anthropometric")))
    tasks = [task for group in groups for task in group]
    assert [(task.open_loop, task.closed_loop) for task in tasks] == [
        (("recursive", "anthropometric"), ("recursive",)),
        (("recursive", "anthropometric"), ()),
    ]


@pytest.mark.parametrize(
    ("given", "word"),
    [
        ({"wearers": -1}, "--wearers is -1"),
        ({"wearers": 0, "streams": 0}, "nothing would run"),
        ({"only": "rain"}, "--only names no disturbance 'rain'"),
        ({"only": "delay", "without": "delay"}, "exclude each other"),
        ({"processes": 0}, "--processes is 0"),
        ({"seed_from": -1}, "--seed-from is -1"),
        ({"break_down": "only", "streams": 0}, "--streams is 0"),
        ({"break_down": "only", "levels": (1, 2)}, "takes one level"),
    ],
)
def test_bad_options_are_refused_in_one_line(given, word):
    with pytest.raises(ConfigError) as error:
        BenchmarkOptions(**given)
    assert word in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("read", "text", "word"),
    [
        (levels_of, "2,5", "--levels has '5'; known: 0, 1"),
        (levels_of, "2,2", "'2' twice"),
        (methods_of, "magic", "--methods has 'magic'; known: recursive"),
        (methods_of, "", "--methods has ''"),
        (profiles_of, "harmonic,steam", "--profiles has 'steam'; known: harmonic, qdd"),
    ],
)
def test_names_that_nobody_knows_are_refused_with_those_that_exist(read, text: str, word: str):
    with pytest.raises(ConfigError) as error:
        read(text)
    assert word in str(error.value)
