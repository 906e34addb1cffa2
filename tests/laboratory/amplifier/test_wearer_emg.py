"""The amplifier of a session shows the wearer's torque at the present tick, and its errors go on in between."""

from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np

from exograv.laboratory.amplifier.wearer_emg import WearerEmg
from exograv.rig.twin import Twin

PERIOD_S, SEED, TICKS = 0.001, 3, 400


def worn(torque_Nm: list[float]) -> Any:
    return Mock(spec=Twin, t=0.0, period_s=PERIOD_S, truth=SimpleNamespace(tau_muscle=np.array(torque_Nm)))


def after(twin: Any, source: WearerEmg, ticks: int) -> np.ndarray:
    twin.t += ticks * PERIOD_S
    return source.now()


def test_a_pause_between_two_questions_changes_no_later_signal():
    always, seldom = worn([2.0, -1.0]), worn([2.0, -1.0])
    asked_always, asked_seldom = (WearerEmg(twin, SEED) for twin in (always, seldom))
    each = np.array([after(always, asked_always, 1) for _ in range(TICKS)])
    np.testing.assert_array_equal(after(seldom, asked_seldom, TICKS), each[-1])


def test_the_signals_follow_the_torque_of_the_wearer_in_two_channels_per_freedom():
    twin = worn([0.0, 0.0])
    source = WearerEmg(twin, SEED, error_factor=0.0)
    assert not after(twin, source, 1).any()
    twin.truth.tau_muscle = np.array([3.0, 0.0])
    shown = after(twin, source, 1)
    assert source.channels == len(shown) == 4
    assert shown.argmax() == 0
