"""Search for streams on the network, their description, and the choice of streams to record."""

import re
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from exograv.errors import ConfigError
from exograv.recording.stream_block import TOPICS, StreamFormat

from .library import lsl

LOOK_S = 1.0
"""Time of one search [s]: liblsl asks again every half second, and an answer takes less."""


@dataclass(frozen=True)
class FoundStream:
    """Stream in its own description."""

    name: str
    source_id: str
    host: str
    channels: int
    rate_Hz: float
    value_type: str
    type: str

    @property
    def predicate(self) -> str:
        """XPath 1.0 expression that finds the stream again, at any time and on any computer."""
        properties = {"name": self.name, "type": self.type, "source_id": self.source_id}
        return " and ".join(f"{name}={quoted(text)}" for name, text in properties.items())


def quoted(text: str) -> str:
    """Return the text as a literal of XPath 1.0, which has no escapes.

    Raises:
        ConfigError: The text has both kinds of quotation marks.
    """
    if '"' in text and "'" in text:
        raise ConfigError(f"The stream {text} has both kinds of quotation marks in its name. Rename it in its program.")
    return f"'{text}'" if '"' in text else f'"{text}"'


def described(info: Any) -> FoundStream:
    """Return the description in a `StreamInfo`."""
    from pylsl.lib import string2fmt

    types = {number: name for name, number in string2fmt.items()}
    return FoundStream(
        info.name(),
        info.source_id(),
        info.hostname(),
        info.channel_count(),
        info.nominal_srate(),
        types[info.channel_format()],
        info.type(),
    )


def visible(within_s: float = LOOK_S) -> list[FoundStream]:
    """Return all visible streams, sorted by name."""
    found = {described(info): None for info in lsl().resolve_streams(within_s)}
    return sorted(found, key=lambda one: (one.name, one.type, one.source_id))


def choose(wanted: Sequence[str], within_s: float) -> list[FoundStream]:
    """Return the streams of these names or, if no stream has the name, of this type.

    Raises:
        ConfigError: A stream is not found within the time; the message names those that are there.
    """
    until = time.monotonic() + within_s
    while True:
        there = visible()
        chosen = {one: _matching(there, one) for one in wanted}
        if all(chosen.values()):
            return list(dict.fromkeys(stream for streams in chosen.values() for stream in streams))
        if time.monotonic() > until:
            missing = ", ".join(f"'{one}'" for one, streams in chosen.items() if not streams)
            seen = "; ".join(f"{one.name} ({one.type}, {one.host})" for one in there) or "none"
            raise ConfigError(
                f"No stream has the name or type {missing}, after {within_s:g} s. Streams there: {seen}. "
                "Start the device's program, or give another name; `exograv data streams` shows what is there."
            )


def _matching(there: Sequence[FoundStream], wanted: str) -> list[FoundStream]:
    return [one for one in there if one.name == wanted] or [one for one in there if one.type == wanted]


def formats(streams: Sequence[FoundStream]) -> tuple[StreamFormat, ...]:
    """Return channel and value type of each stream in the recording. Each channel name is unique."""
    topics = list[str]()
    for stream in streams:
        first = topic = TOPICS + (re.sub(r"[^A-Za-z0-9_-]+", "_", stream.name) or "stream")
        number = 1
        while topic in topics:
            number += 1
            topic = f"{first}_{number}"
        topics.append(topic)
    return tuple(StreamFormat(topic, one.value_type) for topic, one in zip(topics, streams, strict=True))
