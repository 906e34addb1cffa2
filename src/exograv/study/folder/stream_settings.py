"""Statements about recorded EEG and EMG streams that LSL does not transmit (`[streams.NAME]` of `study.toml`)."""

from typing import Annotated, Literal

from pydantic import Field

from exograv.model.rig_settings import Settings

BiosignalType = Literal["EEG", "EMG"]

Short = Annotated[str, Field(max_length=200)]


class StreamSettings(Settings):
    """Statements about the streams of one name or type. Each of them may be left out."""

    type: BiosignalType | None = None
    """Type of the data, if the stream states another type."""

    unit_uV: Annotated[float, Field(gt=0.0)] | None = None
    """Microvolts of one unit of the stream. Replaces the units that the stream states."""

    labels: list[Short] = Field(default=[])
    """Label of each channel. Replaces the labels that the stream states."""

    muscles: list[Short] = Field(default=[])
    """Muscle of each channel of EMG."""

    reference: Short = ""
    """Reference electrode, or `bipolar`."""

    ground: Short = ""
    """Ground electrode."""

    placement: Short = ""
    """Scheme of the electrodes' places, such as `10-20` for EEG or `SENIAM` for EMG."""

    power_line_Hz: Annotated[float, Field(gt=0.0)] | None = None
    """Frequency of the mains [Hz]."""

    contraction_window: Annotated[int, Field(ge=1)] | None = None
    """Number of the window with the reference contraction of EMG, whose effort is 1."""

    contraction_protocol: Short = ""
    """Protocol of the session with this window; empty for each session's own window."""
