"""The maker's own transport and controller work with the simulated drives as with real ones."""

import asyncio
import math
from typing import Any

import moteus
import pytest

from exograv.rig.drives.moteus.simulated.bus import MoteusDevices
from exograv.rig.drives.settings import Drives

R = moteus.Register
BY_KV = 8.26993
"""Torque constant times Kv, as moteus_tool prints them [N·m/A · 1/min/V]."""


async def _talk(path: str) -> tuple[Any, Any, bytes]:
    transport = moteus.Fdcanusb(path)
    try:
        controller = moteus.Controller(id=2, transport=transport)
        await controller.set_stop(query=True)
        stood = await controller.query()
        while (moved := await _torque(controller)).values[R.MODE] != moteus.Mode.POSITION:
            await asyncio.sleep(0.01)
        await asyncio.sleep(0.005)
        moved = await _torque(controller)
        stream = moteus.Stream(controller, use_flow_control=False)
        said = await stream.command(b"conf get servo.max_current_A")
        return stood, moved, said
    finally:
        transport.close()


async def _torque(controller: Any) -> Any:
    return await controller.set_position(
        position=math.nan, velocity=0.0, feedforward_torque=2.0, kp_scale=0.0, kd_scale=0.0, ilimit_scale=0.0,
        watchdog_timeout=1.0, query=True,
    )  # fmt: skip


def test_the_makers_library_reads_moves_and_configures_them(devices: MoteusDevices, drives: Drives):
    assert drives.settings.moteus is not None
    stood, moved, said = asyncio.run(asyncio.wait_for(_talk(drives.settings.moteus.path), 60.0))
    assert stood.values[R.MODE] == moteus.Mode.STOPPED
    assert stood.values[R.POSITION] == pytest.approx(1.0 / (2.0 * math.pi), rel=1e-6)
    assert moved.values[R.TORQUE] == pytest.approx(2.0, rel=1e-6)
    assert float(said) == drives.each[1].current_max_A
    config = devices.nodes[1].config
    per_ampere = BY_KV / config["motor.Kv"] / config["motor_position.rotor_to_output_ratio"]
    assert devices.plant.outputs[1].current == pytest.approx(2.0 / per_ampere, rel=1e-5)
