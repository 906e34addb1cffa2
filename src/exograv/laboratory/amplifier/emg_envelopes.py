"""Simulated EMG envelopes of a wearer: size of each muscle's signal above rest, as a share of a maximum contraction.

An amplifier with a low-pass filter gives such envelopes. Each freedom of the arm has a muscle in each direction. Its
envelope follows the torque through a gain that is unknown and drifts, with crosstalk, common contraction, and an error.
"""

import numpy as np
from jaxtyping import Float

from exograv.rig.twin.disturbances.ornstein_uhlenbeck import BLOCK, OrnsteinUhlenbeck
from exograv.rig.twin.disturbances.streams import stream

CONTRACTION_NM = 60.0
"""Torque of a maximum voluntary contraction at shoulder or elbow [N·m]: the order of healthy adults."""

ERROR_NM = (0.96, 1.43)
"""Range of the error (RMS) of torque from EMG [N·m] (arXiv 2601.16712)."""

ERROR_LASTS_S = (0.2, 5.0)
"""Correlation times of the two parts of the error [s]; both have the same variance. Assumed."""

GAIN_LOG_SD, DRIFT_LOG_SD, DRIFT_LASTS_S = 0.4, 0.2, 60.0
"""Standard deviation of the logarithm of a channel's gain and of its drift [-], and time of the drift [s]. Assumed."""

COMMON, CROSSTALK = 0.2, 0.1
"""Share of a muscle's torque that its opponent also contracts for, and share of each channel in its neighbours [-].
Assumed."""

Envelopes = Float[np.ndarray, " channel"]


class EmgEnvelopes:
    """Envelopes of one wearer, tick by tick."""

    def __init__(self, freedoms: int, period_s: float, seed: int, error_factor: float = 1.0):
        """Draw gains and errors of a wearer with this many freedoms.

        Args:
            freedoms: Freedoms of the arm.
            period_s: Time between two ticks [s].
            seed: Draws gains and errors.
            error_factor: Multiple of the published error of the torque that the envelopes show [-].
        """
        draw, channels = stream(seed, "wearer", "emg"), 2 * freedoms
        rms = error_factor * draw.uniform(*ERROR_NM, freedoms)
        self._gain = np.exp(GAIN_LOG_SD * draw.standard_normal(channels)) / CONTRACTION_NM
        lasts_s = np.repeat(ERROR_LASTS_S, freedoms)
        self._error = OrnsteinUhlenbeck(np.tile(np.sqrt(0.5) * rms, 2), lasts_s, period_s, draw)
        self._drift = OrnsteinUhlenbeck(np.full(channels, DRIFT_LOG_SD), DRIFT_LASTS_S, period_s, draw)
        self._mix = np.eye(channels) + CROSSTALK * (np.eye(channels, k=1) + np.eye(channels, k=-1))
        self._freedoms = freedoms
        self._errors, self._drifts, self._row = np.zeros((0, freedoms)), np.zeros((0, channels)), BLOCK

    @property
    def channels(self) -> int:
        """Number of channels: two per freedom."""
        return 2 * self._freedoms

    def next(self, torque_Nm: Float[np.ndarray, " freedom"]) -> Envelopes:
        """Return the envelopes of the next tick [-], from the torque of the muscles [N·m]."""
        if self._row == BLOCK:
            self._errors = self._error.block().reshape(BLOCK, 2, self._freedoms).sum(axis=1)
            self._drifts, self._row = np.exp(self._drift.block()), 0
        shown = torque_Nm + self._errors[self._row]
        lifts, lowers = np.maximum(shown, 0.0), np.maximum(-shown, 0.0)
        torque = np.concatenate([lifts + COMMON * lowers, lowers + COMMON * lifts])
        row, self._row = self._drifts[self._row], self._row + 1
        return self._gain * row * (self._mix @ torque)
