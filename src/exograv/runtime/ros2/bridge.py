"""Bridge process: publishes the newest tick of a live run, and passes on requests."""

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
"""Rate of joint states, and largest rate of levels that are passed on [Hz]."""

SLOW_EVERY = 10
"""Number of joint states per gravity level and safe state."""

ALIVE_EVERY_S = 0.5
"""Time between two reports of the number of published messages, which are also the signs of life [s]."""

OVER = "over"
"""Last message of the bridge."""

BEHIND = 10
"""Niceness of the bridge process: guard and control take precedence even without real-time rights."""


@dataclass(frozen=True)
class BridgeJob:
    """Start arguments of a bridge."""

    inlet: Inlet
    joints: tuple[str, ...]
    router: str
    domain: int


def bridge_process(job: BridgeJob, parent: Connection) -> None:
    """Run the bridge, until the parent ends the run or is gone.

    The bridge only reads the ring of ticks; the recorder alone frees its slots.
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
    due = told = time.monotonic()
    while True:
        if time.monotonic() - told >= ALIVE_EVERY_S:
            parent.send(bridge.published)
            told = time.monotonic()
        due = max(due + 1.0 / RATE_HZ, time.monotonic())  # a late message is left out, not repeated
        while parent.poll(max(due - time.monotonic(), 0.0)):
            word = parent.recv()
            if word is None:
                parent.send(bridge.published)
                parent.send(OVER)
                return
            bridge.remark(word)
        bridge.publish()
        if (level := bridge.asked()) is not None:
            parent.send(level)


class Bridge:
    """Node with the topics of a run."""

    def __init__(self, job: BridgeJob):
        """Join the graph.

        Raises:
            ConfigError: Zenoh is not installed, or does not start.
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
        """Number of joint states so far."""
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
        """Return the last gravity level requested since the previous call; None if there was none."""
        message, self._asked = self._asked, None
        if message is None:
            return None
        level = read_float64(message)
        if level is None:
            self.remark(f"The message on {WANTED} is no {FLOAT64.name}.")
        return level

    def remark(self, text: str) -> None:
        """Publish a sentence on the topic for remarks."""
        self._remark.send(string(text))

    def close(self) -> None:
        """Leave the graph and release the shared memory."""
        self._node.close()
        self._ticks.close()

    def _take(self, message: bytes) -> None:
        self._asked = message


def known(values: np.ndarray) -> list[float]:
    """Return one value per joint; an empty list if any is unknown, as `JointState` demands."""
    return values.tolist() if np.isfinite(values).all() else []


def stamp_ns(row: np.void) -> int:
    """Time of a tick's measurement on the computer's wall clock, which is ROS time [ns]."""
    measured_s = float(row["monotonic"] + (row["t"] - row["now"]))
    return time.time_ns() - (time.monotonic_ns() - round(1e9 * measured_s))
