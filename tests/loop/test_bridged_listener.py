"""Listeners hear the motion between two measurements that are not neighbours, as if none had been lost."""

import numpy as np
import pytest

from exograv.loop.bridged_listener import BRIDGED_TICKS, BridgedListener
from exograv.loop.tick_sample import TickSample
from exograv.signals import JointState, Reference, TorqueSource

SPEED, DT = np.array([1.0, -2.0]), 0.001


def at(tick: int, into: np.ndarray) -> TickSample:
    """Return a tick of a motion at constant speed; its arrays are views of `into`, as in a session."""
    into[:] = SPEED * tick * DT
    state = JointState(tick * DT, tick, into, 2.0 * into, into, TorqueSource.CURRENT)
    return TickSample(state, into, into, 3.0 * into, into, into, Reference(into, into, into))


@pytest.mark.parametrize("missing", [0, 1, 7, BRIDGED_TICKS - 1])
def test_a_steady_motion_is_heard_whole_whatever_was_lost(missing: int):
    heard, buffer = list[TickSample](), np.zeros(2)

    def listen(moment: TickSample) -> None:
        state = moment.state._replace(q=moment.state.q.copy(), current=moment.state.current.copy())
        reference = Reference(*(one.copy() for one in moment.reference))
        heard.append(moment._replace(state=state, tau_measured=moment.tau_measured.copy(), reference=reference))

    bridged = BridgedListener(listen)
    for tick in range(60):
        bridged.take(None if 30 <= tick < 30 + missing else at(tick, buffer))
    assert len(heard) == 60
    for tick, moment in enumerate(heard):
        expected = SPEED * tick * DT
        for values, scale in (
            (moment.state.q, 1.0),
            (moment.state.current, 2.0),
            (moment.tau_measured, 3.0),
            (moment.reference.q, 1.0),
        ):
            np.testing.assert_allclose(values, scale * expected, atol=1e-15)
        assert moment.state.t == pytest.approx(tick * DT)


@pytest.mark.parametrize("missing", [BRIDGED_TICKS, 500])
def test_a_motion_after_a_long_silence_is_not_invented(missing: int):
    heard, buffer = list[int](), np.zeros(2)
    bridged = BridgedListener(lambda moment: heard.append(moment.state.sequence))
    for tick in range(2 + missing):
        bridged.take(None if 1 <= tick <= missing else at(tick, buffer))
    assert heard == [0, missing + 1]


def test_silence_before_the_first_measurement_is_not_filled():
    heard, buffer = list[int](), np.zeros(2)
    bridged = BridgedListener(lambda moment: heard.append(moment.state.sequence))
    for moment in (None, None, at(2, buffer)):
        bridged.take(moment)
    assert heard == [2]
