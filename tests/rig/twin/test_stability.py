"""The worn twin is stable along the machine's own excitation, at every level."""

from dataclasses import replace

import numpy as np
import pytest

from exograv import motion
from exograv.dynamics.actuator import ActuatorGain
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.identify import identification_motion
from exograv.rig.twin import Disturbances, Twin
from exograv.safety.envelope import Envelope
from exograv.signals import Command

CALM_RAD_S = 5.0  # four times the excitation's fastest joint
SECONDS = 20.0


def fastest(laboratory: VirtualLaboratory, seed: int) -> float:
    """Speed of the wearer's fastest joint while the machine tracks its excitation by the weak PD [rad/s]."""
    assembly = laboratory.assembly()
    machine = nominal_machine(laboratory.description, assembly.exo.phi)
    twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, seed)
    generous = replace(limits(laboratory.description), v_damping_rad_s=1e3, v_trip_rad_s=2e3)
    pilot = Pilot(
        twin, ActuatorGain(machine.actuators.gain, machine.actuators.gain_sd), Envelope(generous, twin.period_s)
    )
    controller = ArmController(assembly, machine, table_guess(assembly, machine), twin.period_s)
    controller.mode.drive = 1.0
    path = identification_motion(assembly, SECONDS, twin.period_s)
    speeds: list[float] = []
    approach = motion.go_to(pilot.q, path.q[0], 0.6, twin.period_s)
    pilot.run(controller, motion.joined([approach, path]), "Tracking", lambda _: speeds.append(_speed(twin)))
    return max(speeds)


def _speed(twin: Twin) -> float:
    truth = twin.truth
    return float(max(np.abs(truth.v).max(), np.abs(truth.v_arm).max()))


@pytest.mark.slow
@pytest.mark.parametrize("level", range(5))
def test_at_every_level_the_worn_machine_follows_its_excitation_calmly(level: int):
    assert fastest(draw_laboratory("recupera_like", "right", level, 1000 + level), 1000 + level) < CALM_RAD_S


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1002, 1006])
def test_drives_without_friction_do_not_ring_in_the_feedback(seed: int):
    # Machine 1006 was once unstable at 12 Hz: rotation and elbow turn little inertia, and the torque is late.
    assert fastest(draw_laboratory("recupera_like_qdd", "right", 2, seed), seed) < CALM_RAD_S


@pytest.mark.slow
def test_the_wearer_whose_shoulder_once_left_its_path_keeps_to_it():
    # Wearer 1005 was once unstable: the penalty that keeps the shoulder's shift on its path was too stiff for the time
    # step.
    assert fastest(draw_laboratory("recupera_like", "right", 2, 1005), 1005) < CALM_RAD_S


@pytest.mark.slow
def test_a_sudden_stop_of_the_motors_does_not_shake_the_shoulder_out_of_its_path(make_twin):
    twin = make_twin(Disturbances.at_level(2), seed=1005, start_posture=np.deg2rad([80.0, 30.0, 20.0, 90.0]))
    for _ in range(3000):
        state = twin.read()
        twin.write(Command(state.t, state.sequence, state.t + 0.005, np.zeros(4), np.zeros(4)))
    assert _speed(twin) < CALM_RAD_S
