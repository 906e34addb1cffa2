"""A line of the aircraft is read as published. Other bytes are rejected without an exception."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.task.aircraft_line import DAY_MS, AircraftSample, clock_of, line_of, newer_by_ms, parse_line

EXAMPLE = b"34439807;33:59.8;0.18307;-0.013731;0.950486;19;46.2;944;0;STEADY FLIGHT"


def parsed(line: bytes) -> AircraftSample:
    sample = parse_line(line)
    assert isinstance(sample, AircraftSample), sample
    return sample


def test_the_published_example_is_level_flight_by_its_norm():
    sample = parsed(EXAMPLE)
    assert sample.norm_g == pytest.approx(0.968, abs=5e-4)
    assert (sample.since_midnight_ms, sample.parabola, sample.announcement) == (34439807, 0, "STEADY FLIGHT")
    assert (sample.temperature_C, sample.humidity_percent, sample.pressure_mbar) == (19.0, 46.2, 944.0)
    assert clock_of(sample.since_midnight_ms) == sample.clock == "33:59.8"


@pytest.mark.parametrize("end", [b"", b"\r\n", b";", b";\r\n"])
def test_ends_of_lines_and_unknown_announcements_are_no_reason_to_refuse(end: bytes):
    assert parsed(EXAMPLE.replace(b"STEADY FLIGHT", b"30 SECONDS") + end).announcement == "30 SECONDS"


@given(g=st.tuples(*[st.floats(-3.0, 3.0)] * 3), ms=st.integers(0, DAY_MS - 1), parabola=st.integers(0, 31))
def test_a_sample_is_the_same_again_from_its_line(g, ms: int, parabola: int):
    sample = AircraftSample(ms, clock_of(ms), g, 19.0, 46.2, 944.0, parabola, "STEADY FLIGHT")
    again = parsed(line_of(sample))
    assert again.g == pytest.approx(g, abs=1e-6)
    assert (again.since_midnight_ms, again.parabola, again.clock) == (ms, parabola, sample.clock)


HOSTILE = {
    "nothing": b"",
    "binary": bytes(range(256)),
    "huge": b"9" * 100_000,
    "huge of fields": b";" * 300,
    "no number": EXAMPLE.replace(b"0.18307", b"nan"),
    "infinite": EXAMPLE.replace(b"0.18307", b"inf"),
    "exponent": EXAMPLE.replace(b"0.18307", b"1e5"),
    "digits of another script": EXAMPLE.replace(b"0.18307", "٣".encode()),
    "underscore": EXAMPLE.replace(b"34439807", b"3443_807"),
    "past midnight": EXAMPLE.replace(b"34439807", b"86400000"),
    "negative time": EXAMPLE.replace(b"34439807", b"-4439807"),
    "200 g": EXAMPLE.replace(b"0.18307", b"200.0"),
    "too few": EXAMPLE.replace(b";944", b""),
    "control characters": EXAMPLE + b"\x1b[2J",
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_bytes_are_refused_with_a_short_reason(case: str):
    why = parse_line(HOSTILE[case])
    assert isinstance(why, str)
    assert len(why) < 120


@given(st.binary(max_size=500))
def test_no_bytes_at_all_raise(datagram: bytes):
    parse_line(datagram)


@given(place=st.integers(0, len(EXAMPLE) - 1), byte=st.integers(0, 255))
def test_one_changed_byte_gives_a_reason_or_a_sample_within_its_limits(place: int, byte: int):
    sample = parse_line(EXAMPLE[:place] + bytes([byte]) + EXAMPLE[place + 1 :])
    assert isinstance(sample, str) or (sample.norm_g < 20.0 and sample.since_midnight_ms < DAY_MS)


@given(earlier=st.integers(0, DAY_MS - 1), step=st.integers(-DAY_MS // 2 + 1, DAY_MS // 2 - 1))
def test_time_goes_on_across_midnight(earlier: int, step: int):
    assert newer_by_ms((earlier + step) % DAY_MS, earlier) == step
