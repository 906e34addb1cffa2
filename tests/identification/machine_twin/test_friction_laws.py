"""The simplest law of friction is chosen that held-out motion does not contradict."""

import numpy as np
from tests.identification.conftest import Exo

from exograv.identification.calibration.empty_prior import data_sheet_prior
from exograv.identification.machine_twin.friction_laws import ABSENT, LAWS, TWIN_PER_JOINT, chosen_laws, of_laws

BLOCKS = np.repeat(np.arange(30), 20)


def losses(*better: str) -> dict[str, np.ndarray]:
    """Losses of one joint, lower for these laws."""
    draw = np.random.default_rng(3)
    noise = draw.chisquare(1, (len(BLOCKS), 1))
    return {law: noise + (0.0 if law in better else 0.5) + 0.001 * draw.random((len(BLOCKS), 1)) for law in LAWS}


def chosen(held: dict[str, np.ndarray]) -> tuple[str, ...]:
    """Names of the chosen laws."""
    return tuple(choice.law for choice in chosen_laws(held, BLOCKS))


def test_the_simplest_law_is_chosen_if_all_are_as_good():
    assert chosen(losses(*LAWS)) == ("coulomb-viscous",)


def test_a_law_is_chosen_whose_parameters_the_data_need():
    rich = tuple(law for law in LAWS if law.startswith("stribeck"))
    assert chosen(losses(*rich)) == ("stribeck",)
    assert chosen(losses("stribeck-asymmetric-load-power")) == ("stribeck-asymmetric-load-power",)


def test_each_joint_has_its_own_law():
    both = {
        law: np.hstack([a, b]) for (law, a), b in zip(losses(*LAWS).items(), losses("stribeck").values(), strict=True)
    }
    assert chosen(both) == ("coulomb-viscous", "stribeck")


def test_samples_that_do_not_count_are_left_out():
    some = losses("stribeck")
    for loss in some.values():
        loss[::2] = np.nan
    assert chosen(some) == ("stribeck",)


def test_the_best_law_has_no_excess_and_a_worse_law_has_its_own():
    (choice,) = chosen_laws(losses("stribeck"), BLOCKS)
    assert choice.excess["stribeck"] == 0.0
    assert choice.excess["coulomb-viscous"] > 5.0 * choice.excess_sd["coulomb-viscous"] > 0.0


def test_each_law_has_the_parameters_of_the_simpler_ones_of_its_name():
    for law, names in LAWS.items():
        for other, fewer in LAWS.items():
            if law.startswith(other):
                assert set(fewer) <= set(names)


def test_a_parameter_that_a_law_does_not_have_keeps_its_absent_value(exo: Exo):
    prior = data_sheet_prior(exo.description, exo.tree, TWIN_PER_JOINT)
    fixed = of_laws(prior, ("asymmetric",) * 4)
    sd = np.sqrt(np.diag(fixed.covariance))
    for name, value in ABSENT.items():
        block = prior.layout.of(name)
        if name == "asymmetry":
            np.testing.assert_array_equal(sd[block], np.sqrt(np.diag(prior.covariance))[block])
        else:
            np.testing.assert_array_equal(fixed.mean[block], value)
            assert (sd[block] < 1e-4).all()
