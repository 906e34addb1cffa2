"""Hidden machine as a `Rig`, so that exograv drives it as any other machine."""

from types import TracebackType

import numpy as np

from exograv.errors import RigError
from exograv.signals import Command, JointState, TorqueSource

from .draw import PERIOD_S, Hidden, Stream, Wrench
from .engine import CURRENT, JOINTS, Engine, Joints, Q
from .geometry import Geometry
from .pulls import ForceSensor, Operator

SETTLE_S = 3.0
"""Time in which the machine comes to rest without motors before it is switched on [s]."""


class HiddenSensors:
    """Sensors of a hidden machine with their errors."""

    def __init__(self, hidden: Hidden, engine: Engine):
        """Measure this machine."""
        self._sensing, self._engine = hidden.sensing, engine
        self._rng = np.random.default_rng((hidden.seed, Stream.SENSORS))
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
        self._mount = ""
        self._force_sensor: ForceSensor | None = None
        self.operator: Operator | None = None
        """Operator who pulls at the force sensor; None while no one does."""
        self._square, self._heated = np.zeros(JOINTS), np.zeros(JOINTS)

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
            if self._force_sensor is not None:
                in_mount = self.engine.wrench.reshape(2, 3) @ self._geometry.mount_axes[self._mount]
                self._force_sensor.measure(self._ticks, in_mount.ravel())
        return self._measured

    def write(self, command: Command) -> None:
        """Give the drives a current and advance by one period.

        Raises:
            RigError: The current is not finite, or the equations diverged.
        """
        if not np.isfinite(command.current).all():
            raise RigError(f"Command {command.sequence} is not finite.")
        damping = np.zeros(JOINTS) if command.damping is None else command.damping
        self.engine.wrench[:] = self._pull()
        self.engine.advance(command.current, damping, command.valid_until + self._ran_s)
        square = self.engine.x[CURRENT] ** 2
        self._square += square
        self._heated += square * self.engine.gain_now
        self._ticks += 1
        self._measured = None
        if not np.isfinite(self.engine.x).all():
            raise RigError(f"The hidden machine diverged before {self.t:.3f} s.")

    def mount_force_sensor(self, mount: str) -> ForceSensor:
        """Fix a force sensor to a mount, and return it. It measures from now on."""
        self._mount, self._force_sensor = mount, ForceSensor(self._hidden)
        self.engine.grip(*self._geometry.mounts[mount])
        return self._force_sensor

    def take_mean_gain(self) -> Joints:
        """Return the mean gain since the last call, weighted by the square of the current (joint,) [N·m/A]."""
        mean = self._heated / self._square
        self._square, self._heated = np.zeros(JOINTS), np.zeros(JOINTS)
        return mean

    def _pull(self) -> Wrench:
        """Wrench of the operator in this period, in the axes of the link."""
        if self.operator is None:
            return np.zeros(6)
        R_base_mount, _ = self._geometry.pose(self._mount, self.engine.x[Q])
        in_mount = self.operator.wrench(self.t, R_base_mount).reshape(2, 3)
        return (in_mount @ self._geometry.mount_axes[self._mount].T).ravel()

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
