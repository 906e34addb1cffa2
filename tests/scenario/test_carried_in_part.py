"""An arm in a foreign world floats on a part of its estimate after a short motion, and the machine says why."""

import numpy as np
import pytest

import exograv
from exograv.recording import read_recording

LEVEL, SEED, MOTION_S, FLOAT_S = 2, 1001, 12.0, 2.0

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> exograv.Flight:
    twin = exograv.Twin(exograv.load_rig("recupera_like"), level=LEVEL, world="all", seed=SEED)
    path = tmp_path_factory.mktemp("part") / "flight.mcap"
    return exograv.float_arm(twin, identify_s=MOTION_S, seconds=FLOAT_S, path=path)


def test_the_machine_floats_on_a_part_of_the_estimate_and_not_on_the_whole(flight: exograv.Flight):
    carried = flight.estimate.carried()
    assert not carried.is_whole
    assert carried.share.max() > 0.5
    last = [m for m in read_recording(flight.path).messages("/control") if m["act"] == "publish"][-1]
    assert not np.allclose(last["x"], flight.estimate.x)
    assert flight.stops == ()


def test_the_sentence_of_the_screen_is_the_one_of_the_recording_and_of_the_result(flight: exograv.Flight):
    events = [m["text"] for m in read_recording(flight.path).messages("/event") if m["kind"] == "carried in part"]
    assert events == [flight.why]
    assert flight.why in flight.estimate.why
    assert f"motion of {60} s" in flight.why


def test_on_no_axis_the_carried_arm_is_worse_than_the_table_by_more_than_the_margin(flight: exograv.Flight):
    estimate = flight.estimate
    twin = exograv.Twin(exograv.load_rig("recupera_like"), level=LEVEL, world="all", seed=SEED)
    table = exograv.Compensator(twin.rig, twin.person).x
    assert flight.left_over_true is not None
    by_table = twin.left_over_true(
        exograv.Estimate(estimate.person, estimate.assembly, estimate.machine, table, None, "")
    )
    assert (flight.left_over_true <= by_table + 0.05).all()
