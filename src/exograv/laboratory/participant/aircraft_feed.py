"""Emulated flight in lock-step: the room is accelerated, and datagrams that pass the network open windows."""

from collections.abc import Callable, Sequence
from typing import Protocol as Interface
from typing import runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv.task.aircraft_line import AircraftSample, parse_line
from exograv.task.aircraft_watch import AircraftWatch
from exograv.task.events import Event
from exograv.task.flight_profile import FlightProfile, Network, datagrams, samples
from exograv.task.protocol_schema import Protocol, level_value

NETWORK = Network(loss=0.01, jitter_s=0.01)
"""Network in the cabin (assumed)."""


@runtime_checkable
class AcceleratedRoom(Interface):
    """Room that can be accelerated, with a clock."""

    @property
    def t(self) -> float:
        """Time of the room's clock [s]."""
        ...

    def fly(self, g: Float[np.ndarray, " 3"]) -> None:
        """Accelerate the room, as `Twin.fly`."""
        ...


Flown = Sequence[tuple[float, AircraftSample]]
"""Times after the first sample [s], and samples."""


def upright(up: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 3"]:
    """Return the rotation from the axes of a sensor to those of the room, whose third axis is vertical.

    A sensor is mounted in any orientation. Its mean acceleration is nearly vertical: aircraft fly parabolas so that the
    acceleration keeps its direction in the cabin.

    Args:
        up: Mean acceleration along the sensor's axes, of any length.
    """
    vertical = up / np.linalg.norm(up)
    ahead = np.eye(3)[np.argmin(np.abs(vertical))]  # the sensor's axis that is farthest from the vertical
    ahead = ahead - (ahead @ vertical) * vertical
    ahead = ahead / np.linalg.norm(ahead)
    return np.array([ahead, np.cross(vertical, ahead), vertical])


class AircraftFeed:
    """Source of the aircraft's events, which also accelerates the twin's room."""

    def __init__(
        self,
        protocol: Protocol,
        twin: AcceleratedRoom,
        seed: int,
        heard: Callable[[float, AircraftSample], None],
        recorded: Flown | None = None,
    ):
        """Start the flight now.

        Args:
            protocol: Protocol with the limits of the windows.
            twin: Room that flies.
            seed: Seed of the network, and of an emulated flight.
            heard: Receives every sample that arrives, with its time.
            recorded: Flight that a sensor recorded; an emulated one if absent.
        """
        level, high = protocol.windows.level_of(protocol.windows.first_number).start, protocol.hypergravity
        profile = FlightProfile(
            parabolas=protocol.windows.count, level=level, window_s=protocol.windows.duration_s
        )  # fmt: skip
        if high is not None:
            changes = {
                "hyper_level": level_value(high.level), "hyper_s": high.duration_s, "ramp_s": high.ramp_s
            }  # fmt: skip
            profile = profile.model_copy(update=changes)
        self.profile = profile
        self._twin, self._heard, self._begun = twin, heard, twin.t
        self._watch = AircraftWatch(protocol.aircraft, level)
        self._flown = iter(samples(profile, seed) if recorded is None else recorded)
        self._sent = datagrams(samples(profile, seed) if recorded is None else recorded, NETWORK, seed)
        self._next_flown, self._next_sent = next(self._flown, None), next(self._sent, None)
        tilt = np.deg2rad(profile.pitch_deg)
        self._level_axes = np.array(
            [[np.cos(tilt), 0.0, -np.sin(tilt)], [0.0, 1.0, 0.0], [np.sin(tilt), 0.0, np.cos(tilt)]]
        )
        if recorded is not None:
            self._level_axes = upright(np.sum([sample.g for _, sample in recorded], axis=0))

    def __call__(self, t: float) -> tuple[Event, ...]:
        """Apply the aircraft's acceleration of time `t` [s] to the twin; return the events received until `t`."""
        while self._next_flown is not None and self._begun + self._next_flown[0] <= t:
            self._twin.fly(self._level_axes @ np.array(self._next_flown[1].g))
            self._next_flown = next(self._flown, None)
        events = list[Event]()
        while self._next_sent is not None and self._begun + self._next_sent[0] <= t:
            sample = parse_line(self._next_sent[1])
            if not isinstance(sample, str):
                self._heard(t, sample)
                self._watch, more = self._watch.with_sample(sample, t)
                events += more
            self._next_sent = next(self._sent, None)
        self._watch, more = self._watch.at(t)
        return (*events, *more)
