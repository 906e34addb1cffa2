"""Memory and code of a control law for a caller in C, so that a tick in lock-step needs no Python."""

from dataclasses import dataclass

import numpy as np

from exograv import kernel

from .handover import Handover


@dataclass(frozen=True)
class NativeLaw:
    """Control law: copy the inputs into their memory, call it, read the torque."""

    tau_desired: np.ndarray
    """Desired torque (joint,) [N·m]."""

    tau_feedforward: np.ndarray
    """Torque that the model predicts (joint,) [N·m]."""

    call: kernel.NativeCall | None = None
    """Code of the law; None if the torque does not depend on the tick, and there are no inputs."""

    inputs: tuple[np.ndarray, ...] = ()
    """Position, velocity, and reference position, velocity and acceleration (joint,)."""

    mode: np.ndarray | None = None
    """Mode of the law (3,); None without an arm."""

    slope: np.ndarray | None = None
    """Remaining gradient of the closure (1,) [N·m]; None without loops."""

    ramps: tuple[tuple[Handover, np.ndarray], ...] = ()
    """Parameters that fade in, each with the memory that it is copied to before the call."""
