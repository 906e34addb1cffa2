"""Orders of a procedure to control in a live run: hold the arm, move it along a path, carry a weight, let it float.

An order describes its path; control computes the path tick by tick, so no stream of reference values has to arrive in
time. Control counts the orders in its answers, so that a replay gives it each one in the same tick.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np

from exograv.model.arm import WeightPlace
from exograv.model.assembly import Assembly
from exograv.model.description import ArmSide, RigDescription
from exograv.motion import Cycles, Harmonics, Passage, Planned, Trajectory
from exograv.procedures.rehabilitation.guided.grip import GripOutcome
from exograv.procedures.rehabilitation.guided.guided_arm import LedBy
from exograv.procedures.rehabilitation.guided.mirror_guide import MirrorGuide
from exograv.procedures.rehabilitation.guided.mirror_plan import MirrorPlan, Skeleton
from exograv.procedures.rehabilitation.guided.path_guide import Anchor, PathGuide
from exograv.procedures.rehabilitation.guided.path_shaping import driven
from exograv.procedures.rehabilitation.guided.pull import PullStrength
from exograv.results import json_value
from exograv.runtime.processes.shared_memory import MessageRing, Ring
from exograv.signals import Reference

Joints = np.ndarray

FOLLOWED_MAX = 1 << 15
"""Capacity of the ring of followed ticks: half a minute at 1 kHz. A procedure takes them several times a second."""

STATES = tuple(GripOutcome)

PATHS: Mapping[str, type[Planned]] = {"passage": Passage, "cycles": Cycles, "harmonics": Harmonics}
"""Kinds of paths, by their names in a recording."""


@dataclass(frozen=True)
class Order:
    """Order that replaces the one before."""

    number: int
    """Number of the order, from 1."""

    is_led: bool
    """True if control holds and moves the arm; False if the arm floats."""

    path: Planned | None = None
    """Path from now on, at whose end the arm is held; without one the arm is held where it is."""

    guide: Literal["anchor", "path", "taught", "mirror"] | None = None
    """Guide that leads the arm by a pull that gives way: an anchor at the start of `path`, a guide along `path`, along
    the taught path of the run, or along the mirror image of the leading arm; None for a motion without a guide."""

    speed: float = 1.0
    """Share of the speed of a guide's path [-]."""

    grip: float = 0.0
    """Share of the pull with which a guide begins [-]."""

    lets_go: bool = False
    """True if the guide in force releases the arm."""

    place: WeightPlace = "hand"
    """Place of the weight."""

    mass_kg: float | None = None
    """Weight at `place` that control carries from now on [kg]; None to change no weight."""

    x: tuple[float, ...] | None = None
    """Parameters of the arm that control carries from now on, by a ramp; None to keep those in force."""

    is_load_known: bool = True
    """False while an unknown weight or another person may act on the arm: the drift monitor would see a fault."""


def written_order(order: Order) -> dict[str, Any]:
    """Return the message of an order for a recording."""
    kinds = {kind: name for name, kind in PATHS.items()}
    path = order.path
    plain = {one.name: getattr(order, one.name) for one in fields(order) if one.name != "path"}
    return plain | {"path": None if path is None else {"kind": kinds[type(path)], **json_value(path)}}


def read_order(message: Mapping[str, Any]) -> Order:
    """Return the order of a message in a recording."""
    plain = {one.name: message[one.name] for one in fields(Order) if one.name in message and one.name != "path"}
    path = message["path"]
    if plain.get("x") is not None:
        plain["x"] = tuple(plain["x"])  # JSON has lists only
    return Order(**plain, path=None if path is None else _read_path(path))


def _read_path(message: Mapping[str, Any]) -> Planned:
    values: dict[str, Any] = {
        name: np.array(value) if isinstance(value, list) else value for name, value in message.items()
    }
    return PATHS[values.pop("kind")](**values)


def followed_dtype(joints: int) -> np.dtype:
    """Return the type of a tick in which control carries out an order.

    `order` is the number of the order. `refused` is the number of the last order whose arm control has refused. `tick`
    counts on its path, and -1 is the time before the feedback is there. `state` is the index of the guide's state in
    `GripOutcome`; it and the fields after it belong to a guide.
    """
    per_joint = (joints,)
    return np.dtype(
        [
            ("now", "<f8"),
            ("order", "<i8"),
            ("refused", "<i8"),
            ("tick", "<i8"),
            ("q", "<f8", per_joint),
            ("tau", "<f8", per_joint),
            ("q_observed", "<f8", per_joint),
            ("v", "<f8", per_joint),
            ("state", "<i8"),
            ("grip", "<f8"),
            ("waited_s", "<f8"),
            ("target", "<f8", per_joint),
            ("pull", "<f8", per_joint),
        ],
        align=True,
    )


@dataclass(frozen=True)
class TaughtRows:
    """Postures of a taught path."""

    q_rad: list[list[float]]
    """Postures at even times [rad]."""
    period_s: float
    """Time between two postures [s]."""

    def trajectory(self, dt: float) -> Trajectory:
        """Return the path from rest to rest, at the loop's period."""
        return driven(np.array(self.q_rad), self.period_s, dt)


@dataclass(frozen=True)
class OrderMemory:
    """Memory between a procedure and control, by name if another process has made it."""

    joints: int
    orders: str | None = None
    followed: str | None = None
    taught: TaughtRows | None = None
    """Taught path, which control has from the start: a table does not arrive within a tick."""
    leading: ArmSide | None = None
    """Arm that leads the other one; None without a mirrored motion."""

    def order_ring(self) -> MessageRing:
        """Return the ring of orders from the procedure to control."""
        return MessageRing(self.orders)

    def followed_ring(self) -> Ring:
        """Return the ring of ticks from control to the procedure."""
        return Ring(followed_dtype(self.joints), FOLLOWED_MAX, self.followed)

    def motion(self, assembly: Assembly, period_s: float) -> "OrderedMotion":
        """Build the part of control on this memory."""
        put = self.followed_ring().put
        taught = None if self.taught is None else self.taught.trajectory(period_s)
        mirrored = None if self.leading is None else MirrorPlan.of(assembly, self.leading)
        return OrderedMotion(assembly.description, period_s, self.order_ring().take, put, taught, mirrored)


class OrderedMotion:
    """Part of control: it takes the orders of a procedure and computes their reference."""

    def __init__(
        self,
        description: RigDescription,
        period_s: float,
        next_order: Callable[[], Order | None],
        tell: Callable[[np.ndarray], object] = lambda _row: None,
        taught: Trajectory | None = None,
        mirrored: MirrorPlan | None = None,
    ):
        """Begin without an order.

        Args:
            description: Description of the machine.
            period_s: Period of the loop [s].
            next_order: Function that returns an order that has arrived; None without one.
            tell: Function that sends a row of `followed_dtype` to the procedure.
            taught: Taught path of the run.
            mirrored: Plan of a mirrored motion of the run.
        """
        joints = len(description.joints)
        self._strength, self._taught, self._mirrored = PullStrength.of(description), taught, mirrored
        self.skeleton: Skeleton = lambda _q: ([], [])
        """Points of machine and arms, by the controller of control."""
        self._guide: LedBy | None = None
        self._period_s, self._next, self._tell = period_s, next_order, tell
        self._row, self._still = np.zeros((), followed_dtype(joints)), np.zeros(joints)
        self._held, self._begun_at = self._still, np.nan
        self.order: Order | None = None
        """Order in force; None before the first, and after a stop."""
        self.count = 0
        """Number of orders that control has taken."""

    @property
    def is_led(self) -> bool:
        """True if control holds and moves the arm."""
        return self.order is not None and self.order.is_led

    @property
    def leading(self) -> ArmSide | None:
        """Arm that floats and leads the other one; None if no arm leads."""
        return self._guide.side if self.is_led and isinstance(self._guide, MirrorGuide) else None

    @property
    def is_load_known(self) -> bool:
        """False while an unknown weight may be on the arm."""
        return self.order is None or self.order.is_load_known

    def take(self, q: Joints) -> Order | None:
        """Take an order that has arrived, at the posture `q` [rad], and return it; None without one."""
        order = self._next()
        if order is None:
            return None
        # A path starts where the arm is held. A weight alone changes neither posture nor path.
        self._held = self._held if self.is_led else q.copy()
        self.order, self._begun_at, self.count = order, np.nan, self.count + 1
        self._take_guide(order, q)
        return order

    def _take_guide(self, order: Order, q: Joints) -> None:
        """Begin with another guide, or release the arm. A guide stays in force while the arm is given back to float."""
        if order.lets_go and self._guide is not None:
            self._guide.let_go()
        elif order.guide == "anchor" and order.path is not None:
            self._guide = Anchor(order.path.at(0)[0], self._strength, self._period_s)
        elif order.guide == "mirror":
            assert self._mirrored is not None
            self._guide = self._mirrored.guide(q, self._period_s, self.skeleton)
            self._guide.lead()
        elif order.guide is not None:
            path = self._taught if order.guide == "taught" else order.path
            assert isinstance(path, Trajectory | Passage)
            self._guide = PathGuide(path, self._strength, order.speed, order.grip)
            self._guide.lead()
        elif order.is_led:
            self._guide = None

    def drop(self) -> None:
        """Forget the order in force, because the machine was stopped."""
        self.order = self._guide = None

    def discard(self) -> None:
        """Forget all orders, taken or not: an order from before must not move an arm that is taken again."""
        self.drop()
        while self._next() is not None:
            self.count += 1

    def refuse(self, order: Order) -> None:
        """Tell the procedure that control keeps its arm in place of that of an order."""
        self._row["refused"] = order.number

    def reference(self, now: float, drive: float, q: Joints, v: Joints) -> Reference:
        """Return the reference at a time [s], with the arm at `q` [rad] and velocity `v` [rad/s].

        A path without a guide begins when the feedback is there in full (`drive` 1).
        """
        self._row["q_observed"], self._row["v"] = q, v
        if self._guide is not None:
            self._held = q.copy()
            return self._guide(q, v)
        path = None if self.order is None else self.order.path
        if path is None:
            return Reference(self._held, self._still, self._still)
        if np.isnan(self._begun_at) and drive >= 1.0:
            self._begun_at = now
        tick = self._tick(now)
        if tick < 0:
            return Reference(self._held, self._still, self._still)
        q, v, a = path.at(min(tick, len(path) - 1))
        self._held = q
        return Reference(q, v, a) if tick < len(path) else Reference(q, self._still, self._still)

    def told(self, now: float, q: Joints, tau: Joints) -> None:
        """Send one tick to the procedure: measured position [rad] and torque [N·m]."""
        if self.order is None:
            return
        row = self._row
        row["now"], row["order"], row["tick"] = now, self.order.number, self._tick(now)
        row["q"], row["tau"] = q, tau
        if (guide := self._guide) is not None:
            row["grip"], row["target"] = guide.grip, guide.target
        if isinstance(guide, PathGuide | MirrorGuide):
            row["state"], row["waited_s"], row["pull"] = STATES.index(guide.state), guide.waited_s, guide.tau
        self._tell(row)

    def _tick(self, now: float) -> int:
        return -1 if np.isnan(self._begun_at) else round((now - self._begun_at) / self._period_s)
