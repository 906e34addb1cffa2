"""Motion of the exoskeleton as `_motion.tsv`: angles, velocities and torques, at a reduced rate."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exograv.recording import Recording, RecordingPass
from exograv.recording.device_stream import clock_ticks

from .channels import COLUMNS, PER_TICK, MotionChannel, counts, exo_channels
from .decimation import CUTOFF, HALF_STEPS, Decimation, DecimationReport, RowBlock
from .files import MISSING, number_rows, write_json, write_table
from .names import EXO, SessionPlace

TOPICS = ("/task", "/event", "/stream", "/correction")
"""Topics that events and other devices need, read in the same pass."""

FILTERED = ("q_measured", "v", "tau_measured", "tau_commanded")
"""Fields of a tick that are filtered, in the order of `filtered_channels`."""

IN_DEGREES = frozenset({"q_measured", "v"})

GAPS_TOLD = 100


@dataclass(frozen=True)
class MotionSummary:
    """Data of the motion that the other files of a session need."""

    recording: Recording
    """Settings and the messages of `TOPICS`, with a selection of ticks for the clocks."""

    first_t: float
    """Time of the first tick, with which the motion file begins, on the rig's clock [s]."""

    account: DecimationReport


def write_motion(
    source: Path, root: Path, place: SessionPlace, rates_Hz: tuple[float, float], about: Mapping[str, Any]
) -> MotionSummary:
    """Write the files of the tracking system `exo`.

    Args:
        source: The recording, which has ticks.
        root: Folder of the data set.
        place: Paths of the session in the data set.
        rates_Hz: Nominal rate of the ticks, and wanted rate of the rows. Every n-th tick gives a row, with the nearest
            whole n.
        about: Content that all sidecars of the session share.

    Raises:
        RecordingError: The recording cannot be read.
    """
    passing, (tick_rate, wanted) = RecordingPass(source, TOPICS), rates_Hz
    step = max(1, round(tick_rate / wanted))
    decimation, first_t, clocks = Decimation(step, tick_rate), np.nan, list[np.ndarray]()
    table = root / place.motion(EXO, "motion.tsv")
    table.parent.mkdir(parents=True, exist_ok=True)
    with table.open("wb") as file:
        for ticks in passing.ticks():
            first_t = ticks["t"][0] if np.isnan(first_t) else first_t
            clocks.append(clock_ticks(ticks))
            filtered = np.column_stack([_in_file_units(name, ticks[name]) for name in FILTERED])
            plain = np.column_stack([ticks[channel.name].astype(float) for channel in PER_TICK])
            for block in decimation.feed(ticks["t"], ticks["sequence"], filtered, plain):
                file.write(_rows(block, first_t))
        for block in decimation.end():
            file.write(_rows(block, first_t))
    some = passing.recording()
    recording = Recording(
        some.path, some.settings, np.concatenate(clocks), some.remark, {name: some.messages(name) for name in TOPICS}
    )
    channels = exo_channels(recording.joints)
    write_channels(root, place, EXO, channels, tick_rate / step)
    model = recording.settings.get("title") or recording.settings.get("rig")
    sidecar = {
        "TrackingSystemName": EXO,
        "ManufacturersModelName": model,
        **_sampling(decimation.account, tick_rate, step),
    }
    write_json(root / place.motion(EXO, "motion.json"), {**about, **sidecar, **counts(channels)})
    return MotionSummary(recording, float(first_t), decimation.account)


def write_channels(
    root: Path, place: SessionPlace, system: str, channels: Sequence[MotionChannel], rate_Hz: float
) -> None:
    """Write the description of the columns, `_channels.tsv`."""
    write_table(root / place.motion(system, "channels.tsv"), COLUMNS, [channel.row(rate_Hz) for channel in channels])


def _in_file_units(name: str, values: np.ndarray) -> np.ndarray:
    values = values.astype(float)
    return np.rad2deg(values) if name in IN_DEGREES else values


def _rows(block: RowBlock, first_t: float) -> bytes:
    columns = [block.t - first_t, *block.filtered.T, *block.plain.T]
    joints = block.filtered.shape[1] // len(FILTERED)
    return number_rows(columns, [channel.decimals for channel in exo_channels([""] * joints)])


def _sampling(account: DecimationReport, tick_rate: float, step: int) -> dict[str, Any]:
    """Return the part of the sidecar about rows and ticks."""
    told = account.gaps[:GAPS_TOLD]
    first = "every tick" if step == 1 else f"every {step}th tick"
    effective = account.steady / account.steady_s / step if account.steady_s > 0.0 else None
    low_pass = {
        "Kind": "symmetric FIR, Hamming window, no delay",
        "Taps": 2 * HALF_STEPS * step + 1,
        "HalfAmplitude_Hz": round(0.5 * CUTOFF * tick_rate / step, 6),
        "AtGaps": "each stretch without a missing tick is filtered separately, continued by point reflection",
    }
    return {
        "SamplingFrequency": tick_rate / step,
        "SamplingFrequencyEffective": MISSING if effective is None else round(effective, 6),
        "MissingValues": MISSING,
        "RowCount": account.rows,
        "RecordingDuration": round(account.rows / (tick_rate / step), 6),
        "SoftwareFilters": {"AntiAliasing": low_pass} if step > 1 else MISSING,
        "RowsAre": f"{first}; a row whose tick is missing has a latency but no other values",
        "TickFrequency": tick_rate,
        "TickCount": account.ticks,
        "TicksLeftOut": account.dropped,
        "RowsWithoutTick": account.missing,
        "GapCount": len(account.gaps),
        "Gaps": [{"LastTickBefore": round(a, 6), "FirstTickAfter": round(b, 6)} for a, b in told],
    }
