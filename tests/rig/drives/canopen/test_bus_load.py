"""Frames that do not fit on the wire are refused before the bus is overloaded."""

from dataclasses import replace
from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.model.description import load_rig
from exograv.rig.drives.bus_load import frame_bits
from exograv.rig.drives.canopen import CanopenRig
from exograv.rig.drives.canopen.cycle import answer_bits, load
from exograv.rig.drives.settings import Drives, load_drives

EXAMPLE = Path(__file__).parents[4] / "examples" / "drives" / "canopen.toml"


def drives(**bus: object) -> Drives:
    """Settings of the example with another bus or period."""
    found = load_drives(EXAMPLE, load_rig("recupera_like"))
    assert found.settings.canopen is not None
    period = {"period_ms": bus.pop("period_ms")} if "period_ms" in bus else {}
    canopen = found.settings.canopen.model_copy(update=bus)
    return replace(found, settings=found.settings.model_copy(update={"canopen": canopen, **period}))


@pytest.mark.parametrize("size", range(9))
def test_a_frame_has_at_most_so_many_bits_as_the_literature_says(size: int):
    # Davis, Burns, Bril, Lukkien 2007, Controller Area Network (CAN) schedulability analysis, equation 2.
    assert frame_bits(size) == 55 + 10 * size


def test_half_the_bit_rate_or_half_the_period_is_twice_the_load():
    whole = load(drives(bitrate=1_000_000))
    assert load(drives(bitrate=500_000)) == pytest.approx(2.0 * whole)
    # Slow frames come with SYNCs; heartbeats of drives come with time.
    assert load(drives(period_ms=1)) == pytest.approx(2.0 * whole, rel=0.02)


def test_answers_are_waited_for_longer_than_the_wire_takes_for_them():
    one = drives()
    assert answer_bits(one) * 1e-6 < CanopenRig.answer_share * one.period_s


@pytest.mark.parametrize("bus", [{"period_ms": 1}, {"bitrate": 250_000}])
def test_a_machine_whose_frames_do_not_fit_is_refused_with_the_load(bus: dict):
    with pytest.raises(ConfigError, match=r"4 drives at period_ms = .* need \d+% of the CAN bus"):
        CanopenRig(drives(interface="socketcan", channel="can0", **bus))


def test_the_example_fits_a_real_bus():
    CanopenRig(drives(interface="socketcan", channel="can0"))
