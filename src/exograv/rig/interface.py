"""The one interface that every machine has, hardware or twin: read what it measures, write what its motors shall do."""

from types import TracebackType
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv.signals import Command, JointState

from .drive_status import DriveStatus


@runtime_checkable
class Rig(Protocol):
    """A machine under torque control. One `read`, then one `write`, in every period; `with rig:` owns the hardware.

    A command whose `valid_until` has passed on the rig's clock never becomes torque: the motors get none.
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
        """The rig's clock [s]."""
        ...

    def read(self) -> JointState:
        """What the machine measured last: the same as before where nothing new has come."""
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
    """A machine whose drives have to be switched on before they give torque, and may be off at any time."""

    def enable(self) -> None:
        """Switch all motors on, at zero torque; faults that are over are acknowledged by it, and by nothing else.

        Raises:
            RigError: A drive stays off; says which, and why.
        """
        ...

    def disable(self) -> None:
        """Switch all motors off; the drives brake."""
        ...

    def status(self) -> tuple[DriveStatus, ...]:
        """What each drive said last, in the order of the joints."""
        ...


@runtime_checkable
class VirtualRig(Protocol):
    """A machine that is only computed: nobody can be in it. One that does not say so is real."""

    @property
    def is_virtual(self) -> bool:
        """Whether nobody can be in it."""
        ...


def may_be_worn(rig: Rig) -> bool:
    """Whether a person may be in this machine, so that everything that protects one is asked for."""
    return not (isinstance(rig, VirtualRig) and rig.is_virtual)


@runtime_checkable
class CuffSensing(Protocol):
    """A machine with a six-axis force/torque sensor at every cuff, in the order of its description; tared empty."""

    def cuff_wrenches(self) -> Float[np.ndarray, "cuff 6"]:
        """What each cuff exerts on the arm now: force [N], then moment [N·m].

        About the origin of the machine's cuff frame (`exo_frame`), in that frame's axes. Asked twice in one period it
        says the same.
        """
        ...
