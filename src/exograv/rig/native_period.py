"""Memory and code of a simulated machine for a caller in C, so that a period in lock-step needs no Python."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.signals import Command

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class NativeMuscles:
    """Muscle torque of one arm for a block of periods."""

    torques: Float[np.ndarray, "period freedom"]
    """Torques of a block [N·m]."""

    now: Float[np.ndarray, " freedom"]
    """Memory of the torque of the present period [N·m]."""


@dataclass(frozen=True)
class NativePole:
    """Memory of a pole of a shoulder's angles; `rig.twin.world.poles` explains its use."""

    abduction: np.ndarray
    """Memory that begins with the angle of abduction [rad]."""
    inertia: np.ndarray
    """Inertia of the engine's degrees of freedom [kg·m²]."""
    places: list[int]
    """Places of flexion, rotation and of both in the inertia."""
    turning: list[int]
    """Degrees of freedom of flexion and rotation."""
    damping: np.ndarray
    """Damping of both [N·m·s/rad]."""
    engine_damping: np.ndarray
    velocity: np.ndarray
    forces: np.ndarray
    """Damping, velocity and joint forces of the engine, by degree of freedom."""
    is_near: np.ndarray
    """1 while the engine damps, else 0."""
    damping_step: float
    """Larger damping times the step [N·m·s²/rad]."""
    stable_share: float
    far_cosine: float


@dataclass(frozen=True)
class NativePeriod:
    """Measure, then advance: the sensors' code; then per substep the engine's first half, the forces, and the second.

    An advance takes its current, damping, end of validity and muscle torques from the memory that is named here.
    """

    sensors: kernel.NativeCall
    noise: Float[np.ndarray, "reading joint"]
    """Noise of a block of measurements [A]."""
    noise_now: Joints
    """Memory of the noise of the present measurement [A]."""
    measured: tuple[Joints, Joints, Joints | None]
    """Memory of joint position [rad], motor current [A] and motor position [rad], as measured; None for the last
    without encoders on the motors."""
    forces: kernel.NativeCall
    halves: tuple[int, int]
    """Addresses of the engine's two halves of a substep, each a function of the next two addresses."""
    engine: tuple[int, int]
    """Addresses of the engine's model and state."""
    substeps: int
    """Number of substeps in a period."""
    velocity: np.ndarray
    """Velocities of the engine; one that is not finite means that the simulation has diverged."""
    current: Joints
    damping: Joints
    valid_until: np.ndarray
    muscles: tuple[NativeMuscles, ...]
    poles: tuple[NativePole, ...]


@runtime_checkable
class NativelySimulated(Protocol):
    """Interface of a simulated machine that native code can advance; used between `read` and `write` as their equal."""

    @property
    def native_period(self) -> NativePeriod | None:
        """Period for a caller in C; None if there is no native code."""
        ...

    @property
    def is_unread(self) -> bool:
        """True if this period has not been measured yet, so that native code may measure it."""
        ...

    def write(self, command: Command) -> None:
        """Hand a command to the drives, as `Rig.write` does."""
        ...

    def begin_native(self) -> tuple[float, int, int, int]:
        """Prepare the memory of one period.

        Returns:
            Time on the rig's clock [s], number of the measurement, and the rows of noise and of muscle torques.
        """
        ...

    def end_native(self, has_diverged: bool) -> None:
        """Note that native code has advanced the machine by one period.

        Raises:
            RigError: The simulation has diverged.
        """
        ...
