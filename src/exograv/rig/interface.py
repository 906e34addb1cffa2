"""Interface of every machine, hardware or twin: read its measurements, write the command of its motors."""

from types import TracebackType
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv.signals import Command, JointState

from .drive_status import DriveStatus


@runtime_checkable
class Rig(Protocol):
    """Machine under torque control: one `read`, then one `write`, in every period; `with rig:` owns the hardware.

    A command is never turned into torque after its `valid_until` has passed on the rig's clock. The motors then get
    zero torque.
    """

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints, in the order of every per-joint array."""
        ...

    @property
    def period_s(self) -> float:
        """Time between two measurements [s]."""
        ...

    @property
    def t(self) -> float:
        """Time on the rig's clock [s]."""
        ...

    def read(self) -> JointState:
        """Return the newest measurement; the previous one again if no new one has arrived."""
        ...

    def write(self, command: Command) -> None:
        """Hand a command to the drives. A simulated machine advances by one period."""
        ...

    def __enter__(self) -> "Rig": ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


@runtime_checkable
class Powered(Protocol):
    """Machine whose drives must be switched on before they give torque, and may be off at any time."""

    def enable(self) -> None:
        """Switch all motors on at zero torque. Only this call acknowledges faults whose cause is gone.

        Raises:
            RigError: A drive stays off. The message names the drive and the reason.
        """
        ...

    def disable(self) -> None:
        """Switch all motors off; the drives brake."""
        ...

    def status(self) -> tuple[DriveStatus, ...]:
        """Return the newest status of each drive, in the order of the joints."""
        ...


@runtime_checkable
class VirtualRig(Protocol):
    """Simulated machine, which no person can wear. A rig without this property is a real machine."""

    @property
    def is_virtual(self) -> bool:
        """True if the machine is simulated."""
        ...


def may_be_worn(rig: Rig) -> bool:
    """Return True if a person may be in this machine. Every protection of a person is then required."""
    return not (isinstance(rig, VirtualRig) and rig.is_virtual)


@runtime_checkable
class CuffSensing(Protocol):
    """Machine with a six-axis force/torque sensor at every cuff, in the order of its description, tared empty."""

    def cuff_wrenches(self) -> Float[np.ndarray, "cuff 6"]:
        """Return the present force [N] and moment [N·m] of each cuff on the arm, force first.

        The moment is about the origin of the machine's cuff frame (`exo_frame`); both are in the axes of that frame.
        Two calls in one period return the same values.
        """
        ...
