"""Incomplete relaxation of a wearer: slow muscle torque and occasional bursts at the joints of the true arm."""

import numpy as np
from jaxtyping import Float

from exograv.rig.twin.disturbances.ornstein_uhlenbeck import BLOCK, OrnsteinUhlenbeck
from exograv.rig.twin.disturbances.streams import stream

from .wearer import RestlessArm

BURST_TORQUE = (2.0, 6.0)
"""Range of a burst's torque at shoulder and elbow [N·m]."""

BURST_DURATION = (0.3, 1.0)
"""Range of a burst's duration [s]."""


class Muscles:
    """Muscle torque of one arm, tick by tick. The same seed and owner give the same torques."""

    def __init__(self, unrest: RestlessArm, seed: int, period_s: float, owner: str = "run") -> None:
        self._unrest, self._n = unrest, len(unrest.bias_rms)
        self._period = period_s
        self._bias = OrnsteinUhlenbeck(
            unrest.bias_rms, unrest.bias_correlation, period_s, stream(seed, owner, "slow_bias")
        )
        self._burst_stream = stream(seed, owner, "bursts")
        self._next_burst, self._burst_ticks_max = self._pause(), round(BURST_DURATION[1] / period_s)
        self._overhang = np.zeros((0, self._n))
        self.block = self.next_block()
        """Torques of the present block of periods [N·m]; the next block overwrites them."""
        self._tick = 0

    def next_torque(self) -> Float[np.ndarray, " freedom"]:
        """Torque at the arm's joints for the next period [N·m]; a view, valid until the next call."""
        return self.block[self.advance()]

    def advance(self) -> int:
        """Advance by one period, and return its row in `block`."""
        if self._tick == BLOCK:
            self.block[:], self._tick = self.next_block(), 0
        self._tick += 1
        return self._tick - 1

    def next_block(self) -> Float[np.ndarray, "tick freedom"]:
        """Torque at the arm's joints for the next `BLOCK` periods [N·m]."""
        return self._bias.block() + self._draw_bursts()

    def _draw_bursts(self) -> Float[np.ndarray, "tick freedom"]:
        """Draw half waves of either sign, each at one joint, that begin at random times.

        The part of a wave behind the end of the block is kept for the next blocks.
        """
        torque = np.zeros((BLOCK + max(self._burst_ticks_max, len(self._overhang)), self._n))
        torque[: len(self._overhang)] = self._overhang
        while self._next_burst < BLOCK:
            size = self._burst_stream.uniform(*BURST_TORQUE) * self._burst_stream.choice([-1.0, 1.0])
            ticks = int(self._burst_stream.uniform(*BURST_DURATION) / self._period)
            joint = self._burst_stream.integers(self._n)
            wave = size * self._unrest.burst_share[joint] * np.sin(np.pi * (np.arange(ticks) + 0.5) / ticks)
            begin = int(self._next_burst)
            torque[begin : begin + ticks, joint] += wave
            self._next_burst += self._pause()
        self._next_burst -= BLOCK
        self._overhang = torque[BLOCK:]
        return torque[:BLOCK]

    def _pause(self) -> float:
        """Return the number of ticks until the next burst."""
        if self._unrest.bursts_per_minute == 0.0:
            return np.inf
        return self._burst_stream.exponential(60.0 / self._unrest.bursts_per_minute) / self._period
