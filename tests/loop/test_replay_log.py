"""A recording has the same limits of a person from any process, and they are read back to the last bit."""

import json
import pickle
from dataclasses import replace

import numpy as np

from exograv.loop.replay_log import read_person, written_person
from exograv.safety.limits import PersonLimits
from exograv.safety.plausible import Features, LimbTable, PlausibleTable


def some_limits() -> PersonLimits:
    generator = np.random.default_rng(0)
    products, potential = generator.normal(size=(2, 2, Features(2, 1).count)), generator.normal(size=(2, 4))
    table = PlausibleTable(
        (LimbTable((0, 1), 1, products[0], products[1], 2, potential),), *generator.uniform(size=(3, 2))
    )
    return PersonLimits(table, np.array([8.0, 4.0]), np.array([-1.0, 0.0]), np.array([1.0, 2.0]))


def as_json(limits: PersonLimits) -> str:
    return json.dumps(written_person(limits), default=lambda value: value.tolist(), allow_nan=False)


def test_limits_without_an_end_are_left_out_also_after_they_went_to_another_process():
    limits = some_limits()
    assert as_json(pickle.loads(pickle.dumps(limits))) == as_json(limits)


def test_limits_are_read_back_to_the_last_bit():
    for limits in (some_limits(), replace(some_limits(), v_trip_rad_s=2.25)):
        again = read_person(json.loads(as_json(limits)))
        q = np.array([0.3, 1.1])
        assert again.v_trip_rad_s == limits.v_trip_rad_s
        assert np.array_equal(again.table.torque(q, 0.4), limits.table.torque(q, 0.4))


def test_limits_that_version_0_1_recorded_have_no_potential():
    message = json.loads(as_json(some_limits()))
    for limb in message["table"]["chains"]:
        del limb["potential"], limb["potential_factors"]
    (limb,) = read_person(message).table.chains
    (expected,) = some_limits().table.chains
    assert limb.potential.size == limb.potential_factors == 0
    assert np.array_equal(limb.exo, expected.exo)
