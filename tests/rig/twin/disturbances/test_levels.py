"""Every row of the table of disturbances exists, with its size and its switch."""

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.rig.twin import Disturbances, draw_machine, draw_wearer
from exograv.rig.twin.disturbances.levels import MACHINE, ROWS, WEARER
from exograv.rig.twin.disturbances.streams import stream, uniform

GROWS_WHEN_SMALLER = {"cuff_stiffness", "cuff_rotation", "cuff_damping", "gear_stiffness", "torque_bandwidth"}
GROWS_WHEN_SMALLER_COLUMNS = {"bits"}


def ends(value) -> tuple[float, float]:
    return value if isinstance(value, tuple) else (value, value)


def test_both_tables_have_all_their_rows():
    # Passive stiffness of elbow and shoulder are columns of one row. The row of a second arm came with machines for
    # both arms, and the row of changes from day to day with files of participants.
    assert len(WEARER) == 18 - 1 + 1 + 1
    # Coulomb friction of both drives is one row, too; gear stiffness and bandwidth are two rows. The sensors at the
    # cuffs came with the methods that need them.
    assert len(MACHINE) == 17 - 1 + 1 + 1


@pytest.mark.parametrize("row", ROWS)
def test_no_level_is_milder_than_the_one_below_it(row: str):
    for column, values in ROWS[row].columns.items():
        sign = -1.0 if row in GROWS_WHEN_SMALLER or column in GROWS_WHEN_SMALLER_COLUMNS else 1.0
        worst = [max(sign * end for end in ends(value)) for value in values]
        assert worst == sorted(worst) or row == "stribeck_velocity"


@pytest.mark.parametrize(
    ("row", "column", "level", "value"),
    [
        ("donning_offset", "max_mm", 2, 15.0),
        ("carrying_angle", "male_mean_deg", 2, 11.0),
        ("carrying_angle", "female_sd_deg", 4, 5.0),
        ("elbow_axis", "axis_sd_deg", 3, 4.0),
        ("elbow_axis", "forearm_sd_deg", 2, 2.0),
        ("cuff_stiffness", "along", 2, 3.0),
        ("cuff_rotation", "about_others", 4, 0.18),
        ("passive_stiffness", "elbow", 2, (0.4, 1.2)),
        ("slow_bias", "shoulder", 3, 0.8),
        ("coulomb", "harmonic.elbow", 2, (1.5, 2.8)),
        ("viscous", "harmonic", 4, (1.0, 6.0)),
        ("gain_error", "sd", 2, 0.05),
        ("gear_stiffness", "harmonic", 2, 15.0),
        ("torque_bandwidth", "quasi_direct", 1, 80.0),
        ("current_noise", "harmonic", 2, 0.4),
        ("encoder", "bits", 2, 17.0),
        ("delay", "value_ms", 2, 1.5),
    ],
)
def test_the_numbers_are_those_of_the_yardstick(row: str, column: str, level: int, value):
    assert Disturbances.at_level(level).value(row, column) == value


@pytest.mark.parametrize("level", range(5))
@pytest.mark.parametrize("row", ["coulomb", "viscous", "passive_stiffness", "passive_damping", "rotor_inertia"])
def test_draws_lie_in_the_range_of_their_level_and_fill_it(row: str, level: int):
    for column, values in ROWS[row].columns.items():
        low, high = ends(values[level])
        generator = stream(0, "test", column)
        drawn = np.array([uniform(generator, values[level]) for _ in range(300)])
        assert drawn.min() >= low
        assert drawn.max() <= high
        assert np.ptp(drawn) >= 0.95 * (high - low)


def test_switching_one_row_off_leaves_every_other_draw_as_it_was(rig):
    worst = Disturbances.at_level(4)
    with_all, without = (draw_machine(rig, d, 3) for d in (worst, worst.without("coulomb", "delay")))
    assert (without.friction.coulomb == 0.0).all()
    assert without.sensors.delay == 0.0
    np.testing.assert_array_equal(without.friction.viscous, with_all.friction.viscous)
    np.testing.assert_array_equal(without.drives.gain, with_all.drives.gain)
    person, relaxed = (draw_wearer(d, 3) for d in (worst, worst.without("slow_bias", "passive_stiffness")))
    assert person.arms[0].skeleton.bone("forearm").mass == relaxed.arms[0].skeleton.bone("forearm").mass
    assert person.lengths_given == relaxed.lengths_given


def test_wearer_and_machine_have_separate_seeds(rig):
    level = Disturbances.at_level(2)
    machines = [draw_machine(rig, level, seed) for seed in (0, 1)]
    assert not np.array_equal(machines[0].drives.gain, machines[1].drives.gain)
    assert draw_wearer(level, 0).body != draw_wearer(level, 1).body


def test_gain_errors_have_the_spread_of_their_level(rig):
    gains = np.array([draw_machine(rig, Disturbances.at_level(2), seed).drives.gain for seed in range(300)])
    errors = gains / rig.nominal_gain - 1.0
    assert np.std(errors) == pytest.approx(0.05, rel=0.06)  # 1200 draws: SD of the SD is 2 %
    assert abs(np.mean(errors)) < 0.005


def test_a_row_that_does_not_exist_is_refused_with_the_nearest_name():
    with pytest.raises(ConfigError, match="Did you mean 'coulomb'"):
        Disturbances.at_level(2).without("coulom")


def test_a_level_that_does_not_exist_is_refused():
    with pytest.raises(ConfigError, match="level 5"):
        Disturbances.at_level(5)
