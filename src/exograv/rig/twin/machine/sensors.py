"""Sensors of the twin's machine: late, quantised encoders and noisy motor currents."""

from collections.abc import Mapping

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.rig.twin.disturbances.streams import stream

from .machine import Machine

BLOCK = 256
"""Number of measurements whose noise is drawn at once; not more, for the reason given in `ornstein_uhlenbeck`."""

Joints = Float[np.ndarray, " joint"]


class Sensors:
    """Encoders and current sensors of all joints; they read the memory that holds the truth."""

    def __init__(self, machine: Machine, seed: int, truth: ca.Function, memory: Mapping[str, np.ndarray]) -> None:
        """Compile the measurement.

        `truth` gives position, motor torque at the joint and motor position from `memory`, as late as a measurement is.
        """
        self._kernel = kernel.compile(_measurement(machine, truth), memory)
        outputs = self._kernel.outputs
        q_motor = outputs["q_motor"] if machine.sensors.has_motor_encoders else None
        self.measured = outputs["q_measured"], outputs["current"], q_motor
        """Memory of the newest measurement: position [rad], current [A] and motor position [rad], None without one."""
        self.native = self._kernel.native
        """One measurement for a caller in C, with the noise in `noise_now`; None if there is no native code."""
        self.noise_now: Joints = self._kernel.inputs["noise"]
        """Memory of the noise of one measurement [A]."""
        self._noise_sd = _per_gain(machine.sensors.current_noise, np.abs(machine.drives.gain))  # [A]
        self._stream = stream(seed, "run", "current_noise")
        self.noise = self._draw_noise()
        """Noise of the present block of measurements [A]; the next block overwrites it."""
        self._reading = 0

    def measure(self) -> tuple[Joints, Joints, Joints | None]:
        """Measure positions [rad], currents [A] and motor positions [rad] now; None without encoders on the motors."""
        self.noise_now[:] = self.noise[self.advance()]
        self._kernel.evaluate()
        q, current, q_motor = self.measured
        return q.copy(), current.copy(), None if q_motor is None else q_motor.copy()

    def advance(self) -> int:
        """Count one measurement, and return its row in `noise`."""
        if self._reading == BLOCK:
            self.noise[:], self._reading = self._draw_noise(), 0
        self._reading += 1
        return self._reading - 1

    def _draw_noise(self) -> Float[np.ndarray, "reading joint"]:
        return self._noise_sd * self._stream.standard_normal((BLOCK, len(self._noise_sd)))


def _per_gain(torque: Joints, gain: Joints) -> Joints:
    """Motor current [A] for a torque at the joint [N·m]; zero for a joint without motor."""
    return np.divide(torque, gain, out=np.zeros_like(gain), where=gain != 0.0)


def _measurement(machine: Machine, truth: ca.Function) -> ca.Function:
    arguments = truth.sx_in()
    q, tau_motor, q_motor = truth.call(arguments)
    noise = ca.SX.sym("noise", q.numel())  # [A]
    q_measured = q + ca.DM(machine.sensors.encoder_offset)
    for joint, step in enumerate(machine.sensors.encoder_step.tolist()):
        if step > 0.0:
            q_measured[joint] = ca.floor(q_measured[joint] / step + 0.5) * step
    current = tau_motor * ca.DM(_per_gain(np.ones(len(machine.drives.gain)), machine.drives.gain)) + noise
    names = [*truth.name_in(), "noise"]
    # The steps of a motor's encoder are not modelled: behind a gear of ratio 100 they are too small to matter.
    measured = {"q_measured": q_measured, "current": current, "q_motor": q_motor}
    return ca.Function("twin_sensors", [*arguments, noise], list(measured.values()), names, list(measured))
