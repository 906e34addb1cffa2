"""Control of `exograv live`: the arm's controller, and the mode that says how much of the arm is carried."""

from dataclasses import astuple

import numpy as np

from exograv.control.observer import Observer
from exograv.runtime.timing import PERIOD_NS
from exograv.safety.guard import SafeState
from exograv.safety.modes import Event, Mode, ModeMachine
from exograv.signals import Reference

from .arm_controller import ArmController
from .prepare import Prepared

REST_BEFORE_RAMP_S = 1.0
MODES = tuple(Mode)


class LiveControl:
    """`Answering`: the arm's controller, and the mode that says how much of the arm is carried."""

    mode_names = tuple(mode.name.lower() for mode in MODES)

    def __init__(self, prepared: Prepared, gravity_level: float):
        """The arm is held from the first tick on, as the twin begins."""
        period_s = 1e-9 * PERIOD_NS
        self._controller = ArmController(prepared.assembly, prepared.machine, prepared.x, period_s)
        self._controller.mode.gravity_level = gravity_level
        self._observer = Observer(prepared.assembly.n, period_s)
        self._still, self._period_s = np.zeros(prepared.assembly.n), period_s
        self._modes, self._rested_s = ModeMachine(Mode.FLOATING, 1.0), 0.0
        self._q_ramp = self._still
        # The first step finds the loops' posture from cold, which takes longer than a tick.
        posture = prepared.assembly.description.donning_posture
        self._controller.step(posture, self._still, self._hold(self._still))
        self._controller = self._controller.again(prepared.x)
        self._controller.mode.gravity_level = gravity_level

    def answer(self, state: np.void, row: np.ndarray) -> None:
        """One tick."""
        self._observer.update(state["q"])
        q, v = self._observer.q, self._observer.v
        self._follow(SafeState(int(state["safe_state"])), q, v)
        self._controller.mode.arm_share = self._modes.arm_share
        row["tau"] = self._controller.step(q, v, self._hold(q))
        row["tau_feedforward"], row["v"] = self._controller.tau_feedforward, v
        row["slope"], row["mode"] = self._controller.closure_slope, MODES.index(self._modes.mode)
        row["drive"], row["gravity_level"], row["arm_share"] = astuple(self._controller.mode)

    def forget(self, mode: Mode, arm_share: float) -> None:
        """Begin anew in this mode with this share of the arm: after a time that nobody saw."""
        self._observer = Observer(len(self._still), self._period_s)
        self._modes, self._rested_s = ModeMachine(mode, arm_share), 0.0
        self._controller.forget()

    def _hold(self, q: np.ndarray) -> Reference:
        return Reference(q, self._still, self._still)

    def _follow(self, safe_state: SafeState, q: np.ndarray, v: np.ndarray) -> None:
        """What the guard says decides; after its reset the arm is taken again by a ramp."""
        modes = self._modes
        if safe_state >= SafeState.DESCENT:
            modes.take(Event.FAULT)
            self._rested_s = 0.0
            return
        if modes.mode is Mode.SAFE:
            for event in (Event.RESET, Event.TEST, Event.PASSED):
                modes.take(event)
        if modes.mode is Mode.EXO_ONLY:
            self._rested_s += self._period_s
            if self._rested_s >= REST_BEFORE_RAMP_S:
                self._rested_s, self._q_ramp = 0.0, q.copy()
                modes.take(Event.TAKE_ARM)
        modes.step(self._period_s, float(np.abs(q - self._q_ramp).max()), float(np.abs(v).max()))
