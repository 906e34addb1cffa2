"""Hidden machine as a `Rig`, so that exograv drives it as any other machine."""

from types import TracebackType

import numpy as np

from exograv.errors import RigError
from exograv.signals import Command, JointState, TorqueSource

from .draw import PERIOD_S, Hidden
from .engine import JOINTS, Engine, Joints
from .geometry import Geometry

SETTLE_S = 3.0
"""Time in which the machine comes to rest without motors before it is switched on [s]."""


class HiddenSensors:
    """Sensors of a hidden machine with their errors."""

    def __init__(self, hidden: Hidden, engine: Engine):
        """Measure this machine."""
        self._sensing, self._engine = hidden.sensing, engine
        self._rng = np.random.default_rng((hidden.seed, 1))
        self._no_torque = np.full(JOINTS, np.nan)

    def measure(self, t: float, number: int) -> JointState:
        """Return the measurement with this number at time `t` of the rig's clock [s]."""
        q, theta, current = self._engine.sense()
        sensing = self._sensing
        noise = self._rng.normal(size=(3, JOINTS))
        q = self._encoded(q + sensing.encoder_offset + sensing.encoder_noise * noise[0])
        current = current + sensing.current_noise * noise[1]
        q_motor = None
        if sensing.motor_offset is not None:
            q_motor = self._encoded(theta + sensing.motor_offset + sensing.encoder_noise * noise[2])
        return JointState(t, number, q, current, self._no_torque, TorqueSource.CURRENT, q_motor)

    def _encoded(self, q: Joints) -> Joints:
        step = self._sensing.encoder_step
        return step * np.round(q / step)


class HiddenRig:
    """`Rig` of a hidden machine. Each `write` advances it by one period."""

    period_s = PERIOD_S
    """Time between two measurements [s]."""
    is_virtual = True
    """True: no person can wear the machine."""

    def __init__(self, geometry: Geometry, hidden: Hidden, q: Joints, ran_s: float = 0.0):
        """Let the machine hang near `q` [rad], and switch it on again after it has run for `ran_s` [s]."""
        self._geometry, self._hidden = geometry, hidden
        self.engine = Engine(hidden.values, q)
        """Equations of the machine, for examiners."""
        self._sensors, self._ran_s = HiddenSensors(hidden, self.engine), ran_s
        nothing = np.zeros(JOINTS)
        for _ in range(round(SETTLE_S / PERIOD_S)):
            self.engine.advance(nothing, nothing, np.inf)
        self.engine.t, self._ticks = ran_s, 0
        self._measured: JointState | None = None
        self._hung: dict[str, float] = {}

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints, in the order of every per-joint array."""
        return self._geometry.joints

    @property
    def t(self) -> float:
        """Time on the rig's clock [s]."""
        return self._ticks * PERIOD_S

    def read(self) -> JointState:
        """Return the measurement of this period; two calls in one period return the same one."""
        if self._measured is None:
            self._measured = self._sensors.measure(self.t, self._ticks)
        return self._measured

    def write(self, command: Command) -> None:
        """Give the drives a current and advance by one period.

        Raises:
            RigError: The current is not finite, or the equations diverged.
        """
        if not np.isfinite(command.current).all():
            raise RigError(f"Command {command.sequence} is not finite.")
        damping = np.zeros(JOINTS) if command.damping is None else command.damping
        self.engine.advance(command.current, damping, command.valid_until + self._ran_s)
        self._ticks += 1
        self._measured = None
        if not np.isfinite(self.engine.x).all():
            raise RigError(f"The hidden machine diverged before {self.t:.3f} s.")

    def hang(self, mount: str, mass_kg: float) -> None:
        """Hang a known weight [kg] at a mount as a point; zero removes it."""
        self._hung[mount] = mass_kg
        mass, com, inertia = (np.array(self._hidden.values[name]) for name in ("mass", "com", "inertia"))
        for name, weight in self._hung.items():
            link, place = self._geometry.mounts[name]
            apart = place - com[link]
            both = mass[link] + weight
            reduced = mass[link] * weight / both
            inertia[link] += reduced * (apart @ apart * np.eye(3) - np.outer(apart, apart))
            com[link] += weight / both * apart
            mass[link] = both
        for name, value in (("mass", mass), ("com", com), ("inertia", inertia)):
            self.engine.change(name, value)

    def __enter__(self) -> "HiddenRig":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Do nothing: the machine has no hardware."""
