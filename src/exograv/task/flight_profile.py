"""Emulated flight: samples of the aircraft with noise, and the effect of the network on their datagrams."""

import heapq
import itertools
from collections.abc import Iterable, Iterator
from typing import Annotated

import numpy as np
from pydantic import Field

from exograv.model.rig_settings import Settings

from .aircraft_line import DAY_MS, RATE_HZ, AircraftSample, clock_of, line_of
from .levels import EARTH, LEVELS

Share = Annotated[float, Field(ge=0.0, le=1.0)]
PEAK_EVERY_S = 2.0
"""Mean time between peaks of residual g [s]."""


class FlightProfile(Settings):
    """Parabolas of equal length. The default is the cycle of 180 s of docs/explanation/task.md."""

    parabolas: Annotated[int, Field(ge=1, le=100)] = 31
    level: Annotated[float, Field(ge=0.0, le=0.9)] = LEVELS["weightless"]
    hyper_level: Annotated[float, Field(ge=1.0, le=3.0)] = LEVELS["hyper"]
    before_s: Annotated[float, Field(gt=0.0, le=600.0)] = 5.0
    ramp_s: Annotated[float, Field(gt=0.0, le=60.0)] = 5.0
    hyper_s: Annotated[float, Field(gt=0.0, le=120.0)] = 20.0
    window_s: Annotated[float, Field(gt=0.0, le=120.0)] = 22.0
    after_s: Annotated[float, Field(gt=0.0, le=3600.0)] = 93.0
    noise_g: Annotated[float, Field(ge=0.0, le=0.5)] = 0.02
    """Noise of the vertical axis; the other axes have half of it. Three of four samples are within this value."""

    peak_g: Annotated[float, Field(ge=0.0, le=0.5)] = 0.05
    pitch_deg: Annotated[float, Field(ge=-30.0, le=30.0)] = 11.0
    """Pitch of the measuring axes against the vertical, as in the published example."""

    start_ms: Annotated[int, Field(ge=0, lt=DAY_MS)] = 34_000_000
    """Time of the first sample since midnight."""

    @property
    def corners(self) -> tuple[tuple[float, float], ...]:
        """Times in the cycle [s] and levels [-] of the profile, which is linear between them."""
        durations = (self.before_s, self.ramp_s, self.hyper_s, self.ramp_s, self.window_s)
        times = tuple(itertools.accumulate((*durations, self.ramp_s, self.hyper_s, self.ramp_s, self.after_s)))
        levels = (EARTH, self.hyper_level, self.hyper_level, self.level, self.level, self.hyper_level, self.hyper_level)
        return ((0.0, EARTH), *zip(times, (*levels, EARTH, EARTH), strict=True))

    @property
    def cycle_s(self) -> float:
        """Time from parabola to parabola [s]."""
        return self.corners[-1][0]

    @property
    def windows_s(self) -> tuple[tuple[float, float], ...]:
        """Start and end of each window after the first sample [s]."""
        opens, closes = self.corners[4][0], self.corners[5][0]
        return tuple((k * self.cycle_s + opens, k * self.cycle_s + closes) for k in range(self.parabolas))


class Network(Settings):
    """Faults of the network."""

    loss: Share = 0.0
    double: Share = 0.0
    jitter_s: Annotated[float, Field(ge=0.0, le=5.0)] = 0.0
    """Mean delay. A datagram with a delay above one sample period is overtaken."""

    silent_s: tuple[tuple[float, float], ...] = ()
    """Intervals in which no datagram arrives, as start and end."""


def samples(profile: FlightProfile, seed: int) -> Iterator[tuple[float, AircraftSample]]:
    """Yield the time after the first sample [s], and the sample."""
    rng = np.random.default_rng(seed)
    times, levels = (np.array(column) for column in zip(*profile.corners, strict=True))
    tilt = np.deg2rad(profile.pitch_deg)
    for k in range(round(profile.parabolas * profile.cycle_s * RATE_HZ)):
        t = k / RATE_HZ
        cycle, in_cycle = divmod(t, profile.cycle_s)
        level = float(np.interp(in_cycle, times, levels))
        noise = np.clip(rng.normal(0.0, profile.noise_g / 1.15, 3), -2.0 * profile.noise_g, 2.0 * profile.noise_g)
        if rng.random() < 1.0 / (PEAK_EVERY_S * RATE_HZ):
            noise[2] = profile.peak_g * rng.choice([-1.0, 1.0])
        lost = 0.5 * noise[:2]
        g = (
            level * float(np.sin(tilt)) + float(lost[0]),
            float(lost[1]),
            level * float(np.cos(tilt)) + float(noise[2]),
        )
        ms = (profile.start_ms + round(1e3 * t)) % DAY_MS
        is_level = in_cycle < times[1] or in_cycle >= times[-2]
        parabola = int(cycle) + (1 if in_cycle >= times[1] else 0)
        # The announcement in level flight is the only one that is known. The invented text must not look like one of a
        # real aircraft.
        text = "STEADY FLIGHT" if is_level else "EMULATED PARABOLA"
        yield t, AircraftSample(ms, clock_of(ms), g, 19.0, 46.2, 944.0, parabola, text)


def datagrams(
    flown: Iterable[tuple[float, AircraftSample]], network: Network, seed: int
) -> Iterator[tuple[float, bytes]]:
    """Yield arrival time after the first transmission [s] and datagram, in order of arrival."""
    rng, under_way = np.random.default_rng(seed + 1), list[tuple[float, int, bytes]]()
    for count, (t, sample) in enumerate(flown):
        while under_way and under_way[0][0] <= t:
            arrives, _, datagram = heapq.heappop(under_way)
            yield arrives, datagram
        for _ in range(1 + int(rng.random() < network.double)):
            delay = float(rng.exponential(network.jitter_s)) if network.jitter_s > 0.0 else 0.0
            is_silent = any(low <= t < high for low, high in network.silent_s)
            if rng.random() >= network.loss and not is_silent:
                heapq.heappush(under_way, (t + delay, count, line_of(sample)))
    while under_way:
        arrives, _, datagram = heapq.heappop(under_way)
        yield arrives, datagram
