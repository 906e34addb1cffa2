"""Identification motions by name: all start and end at rest in their time, within the same limits."""

from typing import get_args

import numpy as np
import pytest

from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import ConfigError
from exograv.identification.baselines.anthropometric import Anthropometric
from exograv.identification.core.prior import prior
from exograv.identification.excitation import MotionLimits
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.motion import Trajectory
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import build_method, table_guess
from exograv.procedures.identification.identify import identification_motion
from exograv.procedures.identification.method_names import WITH_UNCERTAINTY, MethodName, MotionName
from exograv.procedures.identification.motions import motion_parts

DT = 0.01


@pytest.fixture(scope="module")
def assembly() -> Assembly:
    return assemble(load_rig("recupera_like"), Body(1.70, 70.0, "female"))


@pytest.fixture(scope="module")
def machine(assembly: Assembly) -> CalibratedMachine:
    return nominal_machine(assembly.description, assembly.exo.phi)


def parts(name: MotionName, assembly: Assembly, machine: CalibratedMachine, seconds: float) -> list[Trajectory]:
    method = Anthropometric(table_guess(assembly, machine), prior(assembly, machine)[1])
    return list(motion_parts(name, assembly, machine, method, seconds, DT))


def test_the_designed_motion_is_the_machines_own(assembly: Assembly, machine: CalibratedMachine):
    (path,) = parts("designed", assembly, machine, 20.0)
    np.testing.assert_array_equal(path.q, identification_motion(assembly, 20.0, DT).q)


@pytest.mark.parametrize(
    "name", ["fixed", pytest.param("fourier", marks=pytest.mark.slow), pytest.param("adaptive", marks=pytest.mark.slow)]
)
def test_a_motion_goes_from_rest_to_rest_within_the_limits(
    assembly: Assembly, machine: CalibratedMachine, name: MotionName
):
    found = parts(name, assembly, machine, 20.0)
    assert sum(path.seconds for path in found) == pytest.approx(20.0)
    for path in found:
        np.testing.assert_allclose(path.v[[0, -1]], 0.0, atol=0.02)
        # The ramps at the ends add a little acceleration to that of the motion.
        assert not MotionLimits.of(assembly).broken_by_motion(path.q, path.v, 0.8 * path.a).any()


def test_the_fixed_motion_moves_one_joint_at_a_time_through_its_range_and_back(
    assembly: Assembly, machine: CalibratedMachine
):
    path, _check = parts("fixed", assembly, machine, 70.0)
    limits = MotionLimits.of(assembly)
    assert np.sum(np.abs(path.v) > 1e-6, axis=1).max() == 1
    reach = path.q.max(axis=0) - path.q.min(axis=0)
    np.testing.assert_allclose(reach, limits.upper - limits.lower, rtol=0.05)


def test_nothing_is_planned_from_a_method_that_states_no_uncertainty(assembly: Assembly, machine: CalibratedMachine):
    method = build_method("gradient", assembly, machine)
    with pytest.raises(ConfigError, match=r"--motion adaptive plans for uncertain parameters.*gradient"):
        motion_parts("adaptive", assembly, machine, method, 20.0, DT)


@pytest.mark.parametrize("name", get_args(MethodName))
def test_the_names_without_uncertainty_are_the_methods_that_state_none_before_their_motion(
    assembly: Assembly, machine: CalibratedMachine, name: MethodName
):
    assert (build_method(name, assembly, machine).estimate().covariance is not None) == (name in WITH_UNCERTAINTY)
