"""Channels of an EEG or EMG stream: from LSL's description, completed by the study's settings."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from exograv.recording.device_stream import DeviceStream
from exograv.study.folder.stream_settings import BiosignalType, StreamSettings

MICROVOLTS = {
    "v": 1e6, "volt": 1e6, "volts": 1e6,
    "millivolt": 1e3, "millivolts": 1e3,
    "uv": 1.0, "µv": 1.0, "μv": 1.0, "microvolt": 1.0, "microvolts": 1.0,
    "nv": 1e-3, "nanovolt": 1e-3, "nanovolts": 1e-3,
}  # fmt: skip
"""Microvolts of one unit, by its name in small letters. "mV" is not here, because "MV" has the same small letters."""

VOLTAGES = frozenset({"EEG", "EMG", "EOG", "HEOG", "VEOG", "ECG", "REF"})
"""Types of BIDS whose values must be voltages."""

OTHERS = frozenset(
    {"ACCEL", "ADC", "AUDIO", "DAC", "EYEGAZE", "GSR", "GYRO", "MAGN", "MISC", "PD", "PPG", "PUPIL", "RESP", "TEMP"}
)
"""Further types of BIDS that a channel may have."""

STEPPED = frozenset({"TRIG", "MISC"})
"""Types whose values may jump: they are not interpolated."""

TRIGGERS = frozenset({"TRIG", "TRIGGER", "STIM", "MARKER", "STATUS"})
LABEL_MAX, UNIT_MAX = 16, 8
"""Longest label and unit in a BDF file."""


@dataclass(frozen=True)
class BiosignalChannel:
    """Channel of an EEG or EMG stream in the terms of BIDS."""

    name: str
    type: str
    unit: str
    """Unit in the file: `uV` for a voltage; empty for none."""

    scale: float
    """Value in the file of one unit of the stream."""

    muscle: str = ""
    place_mm: tuple[float, float, float] | None = None
    """Place of the electrode in the axes of `exograv`'s coordinate file; None if the stream does not state one."""

    @property
    def is_stepped(self) -> bool:
        """Return True if the values may jump."""
        return self.type in STEPPED


Stated = Mapping[str, StreamSettings]
"""Statements of the study about streams, by name or type."""


def statements_on(stream: DeviceStream, stated: Stated) -> StreamSettings:
    """Return the statements on a stream: by its name, else by its type, in capital or small letters."""
    by_type = {key.upper(): value for key, value in stated.items()}
    return stated.get(stream.name) or by_type.get(stream.kind.strip().upper()) or StreamSettings()


def type_of(stream: DeviceStream, stated: StreamSettings) -> BiosignalType | None:
    """Return the data type of a stream; None for a stream that is neither EEG nor EMG."""
    text = stream.kind.strip().upper()
    return stated.type or ("EEG" if text == "EEG" else "EMG" if text == "EMG" else None)


def channels_of(stream: DeviceStream, kind: BiosignalType, stated: StreamSettings) -> list[BiosignalChannel] | str:
    """Return the channels of a stream, or the reason why it cannot be exported as `kind`."""
    described = list(stream.description.iterfind("desc/channels/channel"))
    count = stream.channels
    if stated.labels and len(stated.labels) != count:
        return f"it has {count} channels, but `labels` in study.toml has {len(stated.labels)}"
    if stated.muscles and len(stated.muscles) != count:
        return f"it has {count} channels, but `muscles` in study.toml has {len(stated.muscles)}"
    described = [described[k] if k < len(described) else ElementTree.Element("channel") for k in range(count)]
    labels = stated.labels or [one.findtext("label") or "" for one in described]
    names, found = unique_labels(labels, kind), list[BiosignalChannel]()
    for k, one in enumerate(described):
        type_ = _type_of(one.findtext("type") or "", kind)
        unit = (one.findtext("unit") or "").strip()
        muscle = stated.muscles[k] if stated.muscles else ""
        if type_ not in VOLTAGES:
            found.append(BiosignalChannel(names[k], type_, _ascii(unit)[:UNIT_MAX], 1.0))
            continue
        scale = stated.unit_uV or microvolts(unit)
        if scale is None:
            told = "none" if not unit else "one that is no voltage"
            return f"channel {k + 1} needs a unit and states {told}: give `unit_uV` in study.toml"
        found.append(BiosignalChannel(names[k], type_, "uV", scale, muscle, _place(one)))
    if not any(channel.type == kind for channel in found):
        return f"no channel has the type {kind}"
    return found


def microvolts(unit: str) -> float | None:
    """Return the microvolts of one unit; None if it is no voltage."""
    return 1e3 if unit == "mV" else MICROVOLTS.get(unit.lower()) if unit != "MV" else None


def unique_labels(labels: Sequence[str], kind: BiosignalType) -> list[str]:
    """Return different labels of ASCII characters; a label that is missing or taken gets the channel's number."""
    found = list[str]()
    for k, text in enumerate(labels, start=1):
        short = re.sub(r"[^0-9A-Za-z _+-]", "", text).strip()[:LABEL_MAX].strip()
        name = short or f"{kind}{k}"
        while name in found:
            name = f"{name[: LABEL_MAX - len(str(k)) - 1]}-{k}"
        found.append(name)
    return found


def _type_of(text: str, kind: BiosignalType) -> str:
    text = text.strip().upper()
    if not text:
        return kind
    if text in VOLTAGES or text in OTHERS:
        return text
    return "TRIG" if text in TRIGGERS else "MISC"


def _place(channel: ElementTree.Element) -> tuple[float, float, float] | None:
    try:
        x, y, z = (float(channel.findtext(f"location/{axis}") or "") for axis in "XYZ")
    except ValueError:
        return None
    return x, y, z


def _ascii(text: str) -> str:
    return text.replace("µ", "u").replace("μ", "u").replace("°", "deg").encode("ascii", "ignore").decode().strip()
