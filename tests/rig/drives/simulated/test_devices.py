"""Simulated drives in real time leave a question of the host waiting only until they know the host's rhythm."""

from types import SimpleNamespace

import numpy as np
import pytest

from exograv.rig.drives.simulated import devices
from exograv.rig.drives.simulated.devices import SimulatedDevices

STEP_S, STEP_TAKES_S, SLOW_STEP_TAKES_S = 1e-3, 0.4e-3, 1.3e-3
LEARNS_S, SECONDS = 0.1, 0.3
ANSWERS_IN_S = 0.02e-3


class AskedDevices(SimulatedDevices):
    """Drives on a bus without frames, whose host asks in every period; time is counted here."""

    def __init__(self, first_s: float, period_s: float):
        twin = SimpleNamespace(period_s=STEP_S)
        plant = SimpleNamespace(twin=twin, each=(), now=0.0, step=self._step_plant)
        # Not by `__init__`, which takes a whole twin and its drives.
        self.plant, self._lock_step, self._faults, self.pauses = plant, False, [], []  # pyright: ignore[reportAttributeAccessIssue]
        self._asked_at, self._has_waited, self._stepped_at = None, False, 0.0
        self.now, self._next, self._period_s = 0.0, first_s, period_s
        self.waited: list[tuple[float, float]] = []
        self.steps, self.slow_step = 0, -1

    def _step_plant(self) -> None:
        self.now += SLOW_STEP_TAKES_S if self.steps == self.slow_step else STEP_TAKES_S
        self.steps += 1

    def _serve(self, seconds: float) -> None:
        if self._next > self.now + seconds:
            self.now += max(seconds, 1e-6)
            return
        self.now = max(self.now, self._next)
        self.waited.append((self._next, self.now - self._next))
        self._note_question()
        self._next += self._period_s

    @property
    def where(self) -> str:
        return "nowhere"

    def _close(self) -> None: ...
    def _step_drive(self, joint: int) -> None: ...


@pytest.mark.parametrize("period_s", [1e-3, 2e-3])
@pytest.mark.parametrize("phase", np.linspace(0.0, 0.95, 7))
def test_no_question_waits_for_a_step_once_the_rhythm_is_known(
    phase: float, period_s: float, monkeypatch: pytest.MonkeyPatch
):
    asked = AskedDevices(0.01 + phase * STEP_S, period_s)
    monkeypatch.setattr(devices, "time", SimpleNamespace(monotonic=lambda: asked.now))
    asked.run(lambda: asked.now > SECONDS)
    waited = [seconds for at, seconds in asked.waited if at > LEARNS_S]
    assert len(waited) > 90
    assert max(waited) < ANSWERS_IN_S
    assert asked.steps == pytest.approx(SECONDS / STEP_S, abs=3)
    assert not asked.pauses


@pytest.mark.parametrize("phase", np.linspace(0.0, 0.95, 7))
def test_a_slow_step_delays_the_next_question_only(phase: float, monkeypatch: pytest.MonkeyPatch):
    asked = AskedDevices(0.01 + phase * STEP_S, 1e-3)
    asked.slow_step = 200
    monkeypatch.setattr(devices, "time", SimpleNamespace(monotonic=lambda: asked.now))
    asked.run(lambda: asked.now > SECONDS)
    assert sum(seconds > ANSWERS_IN_S for at, seconds in asked.waited if at > LEARNS_S) <= 2
