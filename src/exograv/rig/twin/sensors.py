"""What the twin's machine tells of itself: late, quantised encoders and noisy motor currents."""

from collections import deque

import numpy as np
from jaxtyping import Float

from .machine import TrueDrives, TrueSensors
from .streams import stream

BLOCK = 4096
"""Measurements whose noise is drawn at once."""

Joints = Float[np.ndarray, " joint"]


class Sensors:
    """Encoders and current sensors of all joints, behind a delay of whole steps."""

    def __init__(self, sensors: TrueSensors, drives: TrueDrives, seed: int, delay_steps: int) -> None:
        self._offset = sensors.encoder_offset
        self._step = sensors.encoder_step
        self._is_quantised = sensors.encoder_step > 0.0
        self._divisor = np.where(self._is_quantised, sensors.encoder_step, 1.0)
        self._torque_to_current = 1.0 / drives.gain
        self._noise_sd = sensors.current_noise / np.abs(drives.gain)  # [A]
        self._stream = stream(seed, "run", "current_noise")
        self._past: deque[tuple[Joints, Joints]] = deque(maxlen=delay_steps + 1)  # newest last
        self._noise = self._draw_noise()
        self._reading = 0

    def fill(self, q: Joints, tau_motor: Joints) -> None:
        """Begin as if the machine had stood still for long."""
        self._past.extend([(q.copy(), tau_motor.copy())] * (self._past.maxlen or 1))

    def note(self, q: Joints, tau_motor: Joints) -> None:
        """Keep the true positions [rad] and motor torques at the joint [N·m] of one step: the arrays themselves."""
        self._past.append((q, tau_motor))

    def measure(self) -> tuple[Joints, Joints]:
        """Positions [rad] and currents [A] as measured now."""
        q, tau_motor = self._past[0]
        q_measured = q + self._offset
        np.copyto(q_measured, np.rint(q_measured / self._divisor) * self._step, where=self._is_quantised)
        return q_measured, tau_motor * self._torque_to_current + self._next_noise()

    def _next_noise(self) -> Joints:
        if self._reading == BLOCK:
            self._noise, self._reading = self._draw_noise(), 0
        self._reading += 1
        return self._noise[self._reading - 1]

    def _draw_noise(self) -> Float[np.ndarray, "reading joint"]:
        return self._noise_sd * self._stream.standard_normal((BLOCK, len(self._offset)))
