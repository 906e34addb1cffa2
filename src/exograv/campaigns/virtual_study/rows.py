"""Rows of a recording for every 20th tick of a virtual session."""

import numpy as np
from jaxtyping import Float

from exograv.loop.arm_controller import ArmController
from exograv.loop.output_feedback import Controller
from exograv.recording import RecordingWriter
from exograv.recording.encoding import empty_ticks
from exograv.signals import JointState

Joints = Float[np.ndarray, " joint"]

AT_ONCE = 4096
"""Number of rows in one block of memory."""


class TickRows:
    """Buffer of rows until the session is over."""

    def __init__(self, joints: int):
        """Begin with an empty buffer."""
        self._empty = empty_ticks(1, joints)
        self._empty["phase"], self._empty["tick_us"] = 1, np.nan
        for name in ("q_reference", "v_reference", "a_reference", "q_motor"):
            self._empty[name] = np.nan
        self._blocks, self._count = list[np.ndarray](), AT_ONCE

    def add(
        self,
        state: JointState,
        v: Joints,
        tau_measured: Joints,
        controller: Controller,
        tau: tuple[Joints, Joints] | None,
    ) -> None:
        """Add one tick. `tau` holds desired and commanded torque; None for a rest that was skipped."""
        if self._count == AT_ONCE:
            self._blocks.append(np.repeat(self._empty, AT_ONCE))
            self._count = 0
        row = self._blocks[-1][self._count]
        self._count += 1
        row["t"] = row["now"] = state.t
        row["sequence"] = 0  # The ticks are not counted, because most of them are left out.
        row["q_measured"], row["v"], row["current"] = state.q, v, state.current
        row["tau_measured"], row["tau_feedforward"] = tau_measured, controller.tau_feedforward
        resting = controller.tau_feedforward, controller.tau_feedforward
        row["tau_desired"], row["tau_commanded"] = resting if tau is None else tau
        row["closure_slope"] = controller.closure_slope
        if isinstance(controller, ArmController):
            row["gravity_level"], row["drive"] = controller.mode.gravity_level, controller.mode.drive
            row["arm_share"] = controller.mode.arm_share

    def write(self, recording: RecordingWriter) -> None:
        """Write all rows.

        Raises:
            RecordingError: The disk is full.
        """
        for block in self._blocks[:-1]:
            recording.ticks(block)
        if self._blocks:
            recording.ticks(self._blocks[-1][: self._count])
