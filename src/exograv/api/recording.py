"""Recording of a session as arrays, tables and a figure."""

from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from exograv.errors import ConfigError, RecordingError
from exograv.recording import open_recording, tick_pieces
from exograv.recording.encoding import empty_ticks
from exograv.recording.schema import CHANNELS, TICK
from exograv.recording.stored_ticks import rows_at

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

PLOT_POINTS = 2000
"""Largest number of points of a curve in `Recording.plot`; more would not be visible."""

PLOTTED = ("t", "q_measured", "tau_measured", "tau_commanded")
"""Fields of a tick that `Recording.plot` shows."""


class Recording:
    """Recording of a session (MCAP); its ticks stay in the file until `ticks` is asked for."""

    def __init__(self, path: str | Path):
        """Check a whole recording.

        Raises:
            RecordingError: The file does not exist, or is not a recording of exograv.
        """
        self._read = open_recording(Path(path))

    @property
    def path(self) -> Path:
        """File of the recording."""
        return self._read.path

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of every array."""
        return self._read.joints

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the run, stored in the recording."""
        return dict(self._read.settings)

    @property
    def is_simulated(self) -> bool:
        """True if the machine or the participant was simulated."""
        return self._read.is_simulated

    @property
    def remark(self) -> str | None:
        """Damage of the file as a sentence; None for a complete file."""
        return self._read.remark

    @cached_property
    def ticks(self) -> np.ndarray:
        """Structured array with one record per tick, in memory; fields: docs/reference/recording_format.md."""
        ticks, start = empty_ticks(self._read.tick_count, len(self.joints)), 0
        for piece in tick_pieces(self.path):
            ticks[start : start + len(piece)] = piece
            start += len(piece)
        return ticks

    @cached_property
    def channels(self) -> dict[str, int]:
        """Number of messages of each channel that has any."""
        counts = {topic: len(self._read.messages(topic)) for topic, channel in CHANNELS.items() if channel is not TICK}
        return {TICK.topic: self._read.tick_count, **{topic: count for topic, count in counts.items() if count}}

    def to_pandas(self, channel: str = TICK.topic) -> "pd.DataFrame":
        """Return one channel as a table: ticks with one column per joint, or messages with one column per field.

        Raises:
            ConfigError: The recording has no such channel.
        """
        import pandas as pd

        if channel not in self.channels:
            raise ConfigError(f"{self.path} has no channel '{channel}'. Channels: {', '.join(self.channels)}.")
        if channel != TICK.topic:
            return pd.DataFrame(list(self._read.messages(channel)))
        columns: dict[str, np.ndarray] = {}
        for name in self.ticks.dtype.names or ():
            values = self.ticks[name]
            if values.ndim == 1:
                columns[name] = values
            else:
                columns |= {f"{name}.{joint}": values[:, k] for k, joint in enumerate(self.joints)}
        return pd.DataFrame(columns)

    def emg(
        self,
        t: ArrayLike,
        rest_s: tuple[float, float],
        contraction_s: tuple[float, float],
        power_line_Hz: float | None = 50.0,
    ) -> "pd.DataFrame":
        """Return the envelopes of the recorded EMG at given times, one column per channel, as `identify` takes them.

        Each value is the size above rest, as a share of the size in the contraction [-].

        Args:
            t: Times on the machine's clock, as the field `t` of `ticks` [s].
            rest_s: Interval in which the muscles rest, on the same clock [s].
            contraction_s: Interval with a maximum voluntary contraction of every muscle [s].
            power_line_Hz: Frequency of the mains; None to leave them in.

        Raises:
            RecordingError: There is no EMG, its times are not known, or an interval or a time has no samples.
        """
        import pandas as pd

        from exograv.study.measures.emg_envelopes import envelopes_at

        times = np.asarray(t, dtype=float)
        found = envelopes_at(self.path, times, rest_s, contraction_s, power_line_Hz)
        if (missing := ~np.isfinite(found.values).all(axis=1)).any():
            raise RecordingError(
                f"{self.path}: EMG samples are missing at {missing.sum()} of {len(times)} times, the first at "
                f"{times[missing][0]:.3f} s. Leave these times out."
            )
        return pd.DataFrame(found.values, columns=pd.Index(found.labels), index=pd.Index(times, name="t"))

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw position and torque of each joint over time, phases shaded; save it if `path` is given."""
        from matplotlib.figure import Figure

        rows = np.arange(0, self._read.tick_count, max(1, self._read.tick_count // PLOT_POINTS))
        none = empty_ticks(0, len(self.joints))[list[str](PLOTTED)]
        ticks = rows_at(chain([none], self._read.pieces(PLOTTED)), rows)
        figure = Figure(figsize=(10, 1.0 + 1.7 * len(self.joints)), layout="constrained")
        panels = figure.subplots(len(self.joints), 2, sharex=True, squeeze=False)
        for k, (joint, (left, right)) in enumerate(zip(self.joints, panels, strict=True)):
            left.plot(ticks["t"], np.rad2deg(ticks["q_measured"][:, k]), color="tab:blue", lw=1.0)
            left.set(title=joint.replace("_", " "), ylabel="position [°]")
            right.plot(ticks["t"], ticks["tau_measured"][:, k], color="tab:gray", lw=0.8, label="measured")
            right.plot(ticks["t"], ticks["tau_commanded"][:, k], color="tab:blue", lw=0.8, label="commanded")
            right.set(title=joint.replace("_", " "), ylabel="torque [N·m]")
        for number, phase in enumerate(self._read.messages("/phase")):
            for axis in panels.ravel() if number % 2 == 0 else ():
                axis.axvspan(phase["t"], self._end_of_phase(number), color="0.94", zorder=0)
        panels[0, 1].legend(fontsize=8, loc="upper right")
        for axis in panels[-1]:
            axis.set_xlabel("time [s]")
        if path is not None:
            figure.savefig(path, dpi=120)
        return figure

    @cached_property
    def _last_t(self) -> float:
        """Time of the last tick [s]."""
        return [float(ticks["t"][-1]) for ticks in self._read.pieces(("t",)) if len(ticks)][-1]

    def _end_of_phase(self, number: int) -> float:
        phases = self._read.messages("/phase")
        return phases[number + 1]["t"] if number + 1 < len(phases) else self._last_t
