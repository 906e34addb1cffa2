"""Names, blocks and vector of all parameters agree, and the conversion of a drive's gain is invertible."""

import numpy as np
import pytest

from exograv.dynamics import parameters
from exograv.dynamics.actuator import ActuatorGain
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig, rig_names
from exograv.model.support import assemble

LAYOUT = parameters.ParameterLayout(segments=2, freedoms=4, arms=1, joints=4)


@pytest.mark.parametrize("rig", rig_names())
def test_every_entry_has_one_name_and_every_name_one_entry(rig: str):
    some = assemble(load_rig(rig), Body(1.75, 75.0, "male"))
    names = [name for name, _ in parameters.names_and_units(some)]
    assert len(names) == parameters.ParameterLayout.of(some).count == len(set(names))


def test_the_blocks_stand_where_their_names_say(assembly):
    assert parameters.ParameterLayout.of(assembly) == LAYOUT
    names = np.array([name for name, _ in parameters.names_and_units(assembly)])
    assert names[LAYOUT.phi][0] == "upper_arm.mass"
    assert names[LAYOUT.phi][10] == "forearm.mass"
    for block, kind in (
        (LAYOUT.stiffness, "stiffness"),
        (LAYOUT.spring_offset, "spring_offset"),
        (LAYOUT.damping, "damping"),
        (LAYOUT.rotor, "rotor_inertia"),
        (LAYOUT.coulomb, "coulomb"),
        (LAYOUT.viscous, "viscous"),
    ):
        assert [name.split(".")[1] for name in names[block]] == [kind] * 4
    assert names[LAYOUT.fit][0] == "shoulder_offset_x"


def test_the_blocks_cover_the_vector_without_overlap():
    covered = np.zeros(LAYOUT.count, dtype=int)
    for block in (
        LAYOUT.phi,
        LAYOUT.stiffness,
        LAYOUT.spring_offset,
        LAYOUT.damping,
        LAYOUT.fit,
        LAYOUT.rotor,
        LAYOUT.coulomb,
        LAYOUT.viscous,
    ):
        covered[block] += 1
    np.testing.assert_array_equal(covered, 1)


def test_the_tables_arm_has_no_springs_and_sits_aligned(assembly):
    x = parameters.table_parameters(assembly.arm, np.full(4, 0.2), np.full(4, 2.0), np.full(4, 1.0))
    np.testing.assert_array_equal(x[LAYOUT.phi], assembly.arm.phi)
    for unknown in (LAYOUT.stiffness, LAYOUT.spring_offset, LAYOUT.damping, LAYOUT.fit):
        np.testing.assert_array_equal(x[unknown], 0.0)
    assert (x[LAYOUT.rotor] == 0.2).all()
    assert (x[LAYOUT.coulomb] == 2.0).all()
    assert (x[LAYOUT.viscous] == 1.0).all()


def test_current_to_torque_and_back_is_the_same_current():
    gains = ActuatorGain(np.array([6.75, 4.5]), np.array([0.1, 0.1]))
    current = np.array([2.0, -3.0])
    np.testing.assert_allclose(gains.torque(current), [13.5, -13.5])
    np.testing.assert_allclose(gains.current(gains.torque(current)), current)
