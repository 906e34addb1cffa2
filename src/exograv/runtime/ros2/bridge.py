"""The bridge's process: looks at the newest tick of a live run, publishes it, and passes on what it is asked for."""

import contextlib
import math
import os
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np

from exograv.errors import ConfigError
from exograv.runtime.recorder.recorder_process import Inlet
from exograv.safety.guard import SafeState

from .messages import FLOAT64, JOINT_STATE, STRING, float64, joint_state, read_float64, string
from .node import Ros2Node

NODE = "exograv"
JOINT_STATES = "/joint_states"
GRAVITY_LEVEL = "/exograv/gravity_level"
SAFE_STATE = "/exograv/safe_state"
REMARK = "/exograv/remark"
WANTED = "/exograv/gravity_level_wanted"

RATE_HZ = 100
"""Of the joint states, and at most of the levels that are passed on."""

SLOW_EVERY = 10
"""Joint states to one gravity level and safe state."""

BEHIND = 10
"""Niceness: guard and control come first where they have no real-time rights."""


@dataclass(frozen=True)
class BridgeJob:
    """What a bridge is started with."""

    inlet: Inlet
    joints: tuple[str, ...]
    router: str
    domain: int


def bridge_process(job: BridgeJob, parent: Connection) -> None:
    """Be the bridge: until the parent says that the run is over, or is gone.

    It only reads the ring of ticks, of which the recorder alone says what may be overwritten.
    """
    os.nice(BEHIND)
    try:
        bridge = Bridge(job)
    except ConfigError as error:
        parent.send(error)
        return
    with contextlib.closing(bridge), contextlib.suppress(EOFError, OSError):
        parent.send("ready")
        _run(bridge, parent)


def _run(bridge: "Bridge", parent: Connection) -> None:
    due = time.monotonic()
    while True:
        due = max(due + 1.0 / RATE_HZ, time.monotonic())  # what is late is left out, and not made up for
        while parent.poll(max(due - time.monotonic(), 0.0)):
            word = parent.recv()
            if word is None:
                parent.send(bridge.published)
                return
            bridge.remark(word)
        bridge.publish()
        if (level := bridge.asked()) is not None:
            parent.send(level)


class Bridge:
    """A node with the topics of a run."""

    def __init__(self, job: BridgeJob):
        """Join the graph.

        Raises:
            ConfigError: Zenoh is not installed, or does not begin.
        """
        self._names, self._node = job.joints, Ros2Node(NODE, job.router, job.domain)
        self._joint_states = self._node.publisher(JOINT_STATES, JOINT_STATE)
        self._gravity_level = self._node.publisher(GRAVITY_LEVEL, FLOAT64)
        self._safe_state = self._node.publisher(SAFE_STATE, STRING)
        self._remark = self._node.publisher(REMARK, STRING)
        self._asked: bytes | None = None
        self._node.subscribe(WANTED, FLOAT64, self._take)
        self._ticks, self._seen = job.inlet.ticks(), 0

    @property
    def published(self) -> int:
        """Joint states so far."""
        return self._joint_states.sent

    def publish(self) -> None:
        """Send the newest tick, if there is a new one."""
        newest = self._ticks.newest()
        if newest is None or newest[0] == self._seen:
            return
        self._seen, row = newest
        if not math.isfinite(row["monotonic"]):
            return
        q, v, tau = (known(row[name]) for name in ("q_measured", "v", "tau_measured"))
        self._joint_states.send(joint_state(stamp_ns(row), self._names, q, v, tau))
        if self.published % SLOW_EVERY == 1:
            if math.isfinite(row["gravity_level"]):
                self._gravity_level.send(float64(float(row["gravity_level"])))
            self._safe_state.send(string(SafeState(int(row["safe_state"]) - 1).name.lower()))

    def asked(self) -> float | None:
        """The gravity level that was asked for since the last question; of several, the last."""
        message, self._asked = self._asked, None
        if message is None:
            return None
        level = read_float64(message)
        if level is None:
            self.remark(f"What came on {WANTED} is no {FLOAT64.name}.")
        return level

    def remark(self, text: str) -> None:
        """Tell whoever listens."""
        self._remark.send(string(text))

    def close(self) -> None:
        """Leave the graph, and let go of the memory."""
        self._node.close()
        self._ticks.close()

    def _take(self, message: bytes) -> None:
        self._asked = message


def known(values: np.ndarray) -> list[float]:
    """One value a joint; none where one of them is unknown, which is how a `JointState` says it."""
    return values.tolist() if np.isfinite(values).all() else []


def stamp_ns(row: np.void) -> int:
    """When a tick's measurement was taken, by the computer's wall clock, which is ROS time [ns]."""
    measured_s = float(row["monotonic"] + (row["t"] - row["now"]))
    return time.time_ns() - (time.monotonic_ns() - round(1e9 * measured_s))
