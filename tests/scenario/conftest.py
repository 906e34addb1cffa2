"""Fixtures of the scenarios: a common demonstration, and a short way to a worn machine."""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.preloaded import exograv

from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.machine import CalibratedMachine
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess
from exograv.rig.twin import Twin
from exograv.safety.envelope import Envelope

SEED = 1012
"""Figures are reported on other seeds (docs/explanation/disturbances.md)."""


@dataclass
class Demo:
    """Result files of a demonstration."""

    result: dict[str, Any]
    recording: Path


def fly(folder: Path, *words: str) -> None:
    exograv(*words, "--seed", str(SEED), "--out", str(folder), "--json", str(folder / "result.json"), check=True)


def demo_in(folder: Path) -> Demo:
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return Demo(result, Path(result["recording"]))


@pytest.fixture(scope="session")
def run_demo(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Demo]:
    def run(*words: str) -> Demo:
        folder = tmp_path_factory.mktemp("demo")
        fly(folder, *words)
        return demo_in(folder)

    return run


@pytest.fixture(scope="session")
def demo(prepare_once: Callable[..., Path]) -> Demo:
    """Run a demonstration at level 2, with half a minute of motion."""
    words = ("demo", "--seconds", "30")
    return demo_in(prepare_once((*words, "--seed", str(SEED)), lambda folder: fly(folder, *words)))


@dataclass
class Worn:
    """Wearer in a machine, and its pilot."""

    twin: Twin
    pilot: Pilot
    controller: ArmController
    machine: CalibratedMachine
    table: np.ndarray


@pytest.fixture(scope="session")
def put_on() -> Callable[..., Worn]:
    """Put a wearer of a level and a seed into a machine with known gains and friction, as after a perfect stage 0."""

    def put(level: int = 0, seed: int = SEED, rig: str = "recupera_like") -> Worn:
        laboratory = draw_laboratory(rig, "right", level, seed)
        assembly = laboratory.assembly()
        machine, truth = nominal_machine(laboratory.description, assembly.exo.phi), laboratory.machine
        friction = replace(machine.friction, coulomb=truth.friction.coulomb, viscous=truth.friction.viscous)
        machine = replace(machine, friction=friction, rotor_inertia=truth.drives.rotor_inertia)
        twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, seed)
        gain = truth.drives.gain
        pilot = Pilot(twin, ActuatorGain(gain, 0.005 * gain), Envelope(limits(laboratory.description), twin.period_s))
        table = table_guess(assembly, machine)
        return Worn(twin, pilot, ArmController(assembly, machine, table, twin.period_s), machine, table)

    return put
