"""Measured g opens and closes each of 31 windows once, despite noise, loss and disorder. Silence is noticed."""

from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from exograv.sentence import Sentence
from exograv.task.aircraft_line import DAY_MS, AircraftSample, parse_line
from exograv.task.aircraft_watch import GAP_MS, AircraftWatch
from exograv.task.events import CloseWindow, FeedBack, FeedLost, OpenWindow, Start, Tick
from exograv.task.flight_profile import FlightProfile, Network, datagrams, samples
from exograv.task.levels import EARTH, LEVELS
from exograv.task.plan import TaskPlan
from exograv.task.protocol import load_protocol
from exograv.task.records import AlarmRaised, PhaseBegan, WindowClosed, WindowOpened
from exograv.task.run import TaskRun
from exograv.task.task_settings import AircraftSettings

SETTINGS = AircraftSettings()
SHORT = FlightProfile(parabolas=2, after_s=10.0)
ROUNDING_S = 1e-6


@dataclass
class Watched:
    """Events of a watch during a flight, and the samples that it accepted."""

    said: list = field(default_factory=list)
    accepted: list[tuple[float, float]] = field(default_factory=list)
    """Time of the sample and of its arrival [s]."""


def observed(profile: FlightProfile, network: Network, seed: int, settings: AircraftSettings = SETTINGS) -> Watched:
    """Watch a flight."""
    watch, result = AircraftWatch(settings, profile.level), Watched()
    for t, datagram in datagrams(samples(profile, seed), network, seed):
        sample = parse_line(datagram)
        assert isinstance(sample, AircraftSample)
        watch, events = watch.with_sample(sample, t)
        result.said += events
        if watch.last is sample:
            result.accepted.append((1e-3 * ((sample.since_midnight_ms - profile.start_ms) % DAY_MS), t))
    return result


def watched(profile: FlightProfile, network: Network, seed: int, settings: AircraftSettings = SETTINGS) -> list:
    """All events of a watch during a flight."""
    return observed(profile, network, seed, settings).said


def spans(said: list) -> list[tuple[float, float]]:
    opened = [one.t for one in said if isinstance(one, OpenWindow)]
    return list(zip(opened, [one.t for one in said if isinstance(one, CloseWindow)], strict=True))


def assert_windows_are_found(profile: FlightProfile, flight: Watched) -> None:
    """Each window is found once, and opens and closes at its time.

    The level crosses a limit on a ramp, at `limit / slope` from its corner. Noise moves this by `noise / slope`.
    The dwell is counted between samples: it begins at the latest with the first accepted sample after the crossing, and
    ends with the first one after the dwell. Each is late by at most the longest gap between accepted samples, and the
    last one arrives after its delay:

        crossing - noise / slope + dwell <= event <= crossing + noise / slope + dwell + 2 gap + delay
    """
    found = spans(flight.said)
    assert len(found) == profile.parabolas
    # The length of g is wrong by at most the length of the noise, of which each horizontal axis has a half.
    noise_g = float(np.hypot(max(2.0 * profile.noise_g, profile.peak_g), np.sqrt(2.0) * profile.noise_g))
    slope = (profile.hyper_level - profile.level) / profile.ramp_s
    opens_s, closes_s = -SETTINGS.open_within_g / slope, SETTINGS.close_beyond_g / slope
    for (opened, closed), (truly_opens, truly_closes) in zip(found, profile.windows_s, strict=True):
        # After the ramp no noise reaches the limit for opening.
        assert noise_g < SETTINGS.open_within_g
        assert_in_time(flight, opened, truly_opens + opens_s - noise_g / slope, truly_opens)
        assert_in_time(flight, closed, *(truly_closes + closes_s + sign * noise_g / slope for sign in (-1.0, 1.0)))


def assert_in_time(flight: Watched, event: float, crosses_from: float, crosses_until: float) -> None:
    """Check the time of an event against the samples around the crossing. A gap above `GAP_MS` restarts the dwell."""
    assert event >= crosses_from + SETTINGS.dwell_s - ROUNDING_S
    longest = 1e-3 * GAP_MS
    until = crosses_until + SETTINGS.dwell_s + 2.0 * longest
    times = [t for t, _ in flight.accepted]
    first, last = bisect_right(times, crosses_until) - 1, bisect_right(times, until)
    around = flight.accepted[first : last + 1]
    gap = max(later - earlier for (earlier, _), (later, _) in pairwise(around))
    delay = max(arrived - t for t, arrived in around)
    if gap <= longest:
        assert event <= crosses_until + SETTINGS.dwell_s + 2.0 * gap + delay + ROUNDING_S


@pytest.mark.slow
def test_a_flight_of_31_parabolas_takes_93_minutes_and_has_31_windows():
    profile = FlightProfile()
    assert profile.cycle_s == 180.0
    assert profile.cycle_s * profile.parabolas == 93 * 60
    flight = observed(profile, Network(loss=0.05, jitter_s=0.02, double=0.02), seed=1000)
    assert_windows_are_found(profile, flight)
    assert [one.parabola for one in flight.said if isinstance(one, OpenWindow)] == list(range(1, 32))


@settings(max_examples=8)
@example(seed=9745, loss=0.125, double=0.28125, jitter_s=0.125)  # closes 1.507 s after the corner of its ramp
@given(
    seed=st.integers(1000, 10**6), loss=st.floats(0.0, 0.2), double=st.floats(0.0, 0.3), jitter_s=st.floats(0.0, 0.15)
)
def test_loss_doubles_and_disorder_open_no_window_twice(seed: int, loss: float, double: float, jitter_s: float):
    flight = observed(SHORT, Network(loss=loss, double=double, jitter_s=jitter_s), seed)
    if not any(isinstance(one, FeedLost) for one in flight.said):
        assert_windows_are_found(SHORT, flight)


@pytest.mark.parametrize("level", [LEVELS["moon"], LEVELS["mars"], 0.5])
def test_partial_gravity_is_a_window_of_its_own_level(level: float):
    profile = FlightProfile(parabolas=2, level=level)
    assert_windows_are_found(profile, observed(profile, Network(), seed=1001))


def test_midnight_in_the_middle_of_a_window_changes_nothing():
    profile = FlightProfile(parabolas=1, start_ms=DAY_MS - 45_000)
    times = [sample.since_midnight_ms for _, sample in samples(profile, 1000)]
    assert min(times) == 0
    assert_windows_are_found(profile, observed(profile, Network(), seed=1000))


def test_the_residual_g_of_an_emulated_window_is_that_of_the_literature():
    weightless = [
        sample for t, sample in samples(SHORT, 1000) if any(low + 1 < t < high for low, high in SHORT.windows_s)
    ]
    vertical = [abs(sample.g[2]) for sample in weightless]
    assert max(vertical) <= 0.05
    assert 0.6 < sum(g <= 0.02 for g in vertical) / len(vertical) < 0.9
    assert max(abs(sample.g[1]) for sample in weightless) <= 0.02


@pytest.mark.parametrize(
    ("meanings", "confirmed"),
    [({}, None), ({"EMULATED PARABOLA": "window"}, True), ({"EMULATED PARABOLA": "level"}, False)],
)
def test_an_announcement_confirms_a_window_or_not_and_never_opens_it(meanings: dict, confirmed: bool | None):
    flight = observed(SHORT, Network(), 1000, AircraftSettings(announcements={"STEADY FLIGHT": "level", **meanings}))
    assert [one.confirmed for one in flight.said if isinstance(one, OpenWindow)] == [confirmed] * 2
    assert_windows_are_found(SHORT, flight)


def test_a_single_sample_within_the_limits_opens_nothing():
    watch, said = AircraftWatch(SETTINGS, 0.0), []
    for k in range(30):
        sample = parsed_level(0.0, 100 * k) if k % 4 == 0 else parsed_level(EARTH, 100 * k)
        watch, events = watch.with_sample(sample, 0.1 * k)
        said += events
    assert said == []


def parsed_level(level: float, ms: int) -> AircraftSample:
    return AircraftSample(ms, "00:00.0", (0.0, 0.0, level), 19.0, 46.0, 944.0, 1, "")


def test_a_sender_whose_clock_was_set_back_is_believed_after_two_seconds():
    watch = AircraftWatch(SETTINGS, 0.0)
    for k in range(60):
        watch, _ = watch.with_sample(parsed_level(EARTH, 5_000_000 + 100 * k if k < 10 else 100 * k), 0.1 * k)
    assert watch.last is not None
    assert watch.last.since_midnight_ms == 5900


def flown(network: Network, seed: int = 1000, until_s: float = 193.0) -> tuple[TaskRun, list]:
    """Run of the shipped flight with the emulated aircraft."""
    loaded = load_protocol("flight")
    run, watch = TaskRun(TaskPlan(loaded, "passive")), AircraftWatch(loaded.settings.aircraft, 0.0)
    records = list(run.feed(Start(t=0.0)))
    arrivals = iter(datagrams(samples(SHORT, seed), network, seed))
    coming = next(arrivals, None)
    for k in range(1, round(20 * until_s)):
        t = 0.05 * k
        while coming is not None and coming[0] <= t:
            sample = parse_line(coming[1])
            assert isinstance(sample, AircraftSample)
            watch, events = watch.with_sample(sample, coming[0])
            for event in events:
                records += run.feed(event)
            coming = next(arrivals, None)
        watch, events = watch.at(t)
        for event in (*events, Tick(t=t)):
            records += run.feed(event)
    return run, records


def windows_of(records: list) -> list[WindowClosed]:
    return [record for record in records if isinstance(record, WindowClosed)]


def test_in_flight_the_aircraft_opens_and_closes_the_windows():
    _, records = flown(Network())
    assert [(one.window, one.by, one.marks) for one in windows_of(records)] == [
        (1, "aircraft", ()),
        (2, "aircraft", ()),
    ]
    assert not any(isinstance(record, (AlarmRaised, PhaseBegan)) for record in records)


def test_a_feed_that_stops_mid_parabola_leaves_the_window_to_the_clock_marked_and_with_an_alarm():
    opens, closes = SHORT.windows_s[0]
    _, records = flown(Network(silent_s=((opens + 8.0, closes + 10.0),)))
    first, second = windows_of(records)
    opened = next(record for record in records if isinstance(record, WindowOpened))
    assert (first.by, first.marks, first.is_complete) == ("clock", ("feed lost",), True)
    assert first.t - opened.t == pytest.approx(22.0)
    assert (second.by, second.marks) == ("aircraft", ())
    alarm = next(record for record in records if isinstance(record, AlarmRaised))
    assert "window 1 ends by the clock" in alarm.text
    assert opened.t + 6.0 < alarm.t < opened.t + 10.0


def test_a_feed_that_comes_back_within_the_window_closes_it_again():
    opens, _ = SHORT.windows_s[0]
    _, records = flown(Network(silent_s=((opens + 8.0, opens + 12.0),)), until_s=100.0)
    (first,) = windows_of(records)
    assert (first.by, first.marks) == ("aircraft", ("feed lost",))


def test_silence_is_told_once_and_its_end_too():
    said = watched(SHORT, Network(silent_s=((100.0, 130.0),)), seed=1000)
    told = [one for one in said if isinstance(one, (FeedLost, FeedBack))]
    assert [one.kind for one in told] == ["feed_lost", "feed_back"]
    assert told[0].t == pytest.approx(99.9 + SETTINGS.silent_s)
    assert told[1].t == pytest.approx(130.0)


def test_a_dwell_is_not_counted_across_a_gap_in_which_anything_may_have_been():
    watch, said = AircraftWatch(SETTINGS, 0.0), []
    for ms in (0, 700, 1400):
        watch, events = watch.with_sample(parsed_level(0.0, ms), 1e-3 * ms)
        said += events
    assert said == []


def test_an_alarm_keeps_its_code_when_a_run_goes_on_from_its_checkpoint():
    plan = TaskPlan(load_protocol("flight"), "passive")
    run = TaskRun(plan)
    for event in (Start(t=0.0), FeedLost(t=1.0), FeedBack(t=2.0), OpenWindow(t=3.0, by="aircraft"), FeedLost(t=4.0)):
        run.feed(event)
    again = TaskRun.from_kept(plan, run.kept())
    said = [alarm.text for alarm in again.state.alarms]
    assert said == [alarm.text for alarm in run.state.alarms]
    assert [text.code for text in said if isinstance(text, Sentence)] == ["aircraft.lost", "aircraft.lost_in_window"]
