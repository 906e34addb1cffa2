"""Control and identification agree on one order of all parameters, and a drive's gain turns one way and back."""

import numpy as np

from exograv.dynamics import parameters
from exograv.dynamics.actuator import ActuatorGain

JOINTS = ("one", "two", "three", "four")
NAMED = list(parameters.names_and_units(JOINTS))


def test_every_entry_has_one_name_and_every_name_one_entry():
    names = [name for name, _ in NAMED]
    assert len(names) == parameters.count(4) == len(set(names))


def test_the_blocks_stand_where_their_names_say():
    names = np.array([name for name, _ in NAMED])
    assert names[parameters.PHI][0] == "upper_arm.mass"
    assert names[parameters.PHI][10] == "forearm.mass"
    for block, kind in (
        (parameters.STIFFNESS, "stiffness"),
        (parameters.SPRING_OFFSET, "spring_offset"),
        (parameters.DAMPING, "damping"),
        (parameters.rotor(4), "rotor_inertia"),
        (parameters.coulomb(4), "coulomb"),
        (parameters.viscous(4), "viscous"),
    ):
        assert [name.split(".")[1] for name in names[block]] == [kind] * 4
    assert names[parameters.FIT_OF_ARM][0] == "shoulder_offset_x"


def test_the_blocks_cover_the_vector_without_overlap():
    covered = np.zeros(parameters.count(4), dtype=int)
    for block in (
        parameters.PHI,
        parameters.STIFFNESS,
        parameters.SPRING_OFFSET,
        parameters.DAMPING,
        parameters.FIT_OF_ARM,
        parameters.rotor(4),
        parameters.coulomb(4),
        parameters.viscous(4),
    ):
        covered[block] += 1
    np.testing.assert_array_equal(covered, 1)


def test_the_tables_arm_has_no_springs_and_sits_aligned(assembly):
    x = parameters.table_parameters(assembly.arm, np.full(4, 0.2), np.full(4, 2.0), np.full(4, 1.0))
    np.testing.assert_array_equal(x[parameters.PHI], assembly.arm.phi)
    for unknown in (parameters.STIFFNESS, parameters.SPRING_OFFSET, parameters.DAMPING, parameters.FIT_OF_ARM):
        np.testing.assert_array_equal(x[unknown], 0.0)
    assert (x[parameters.rotor(4)] == 0.2).all()
    assert (x[parameters.coulomb(4)] == 2.0).all()
    assert (x[parameters.viscous(4)] == 1.0).all()


def test_current_to_torque_and_back_is_the_same_current():
    gains = ActuatorGain(np.array([6.75, 4.5]), np.array([0.1, 0.1]))
    current = np.array([2.0, -3.0])
    np.testing.assert_allclose(gains.torque(current), [13.5, -13.5])
    np.testing.assert_allclose(gains.current(gains.torque(current)), current)
