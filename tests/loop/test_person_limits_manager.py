"""The knowledge of the wearer sets the guard's limits: all plausible arms, then this arm, or a weighed weight."""

from collections.abc import Iterator

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.prior import prior
from exograv.loop import plausible_table
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.person_limits_manager import V_MORE_RAD_S, PersonLimitsManager
from exograv.model.anthropometry import Body
from exograv.model.arm import held_weight
from exograv.model.description import load_rig
from exograv.model.support import assemble, sample_postures
from exograv.options import HEAVIEST_KG
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.safety.envelope import Envelope
from exograv.signals import Reference

DT = 0.001
STILL = np.zeros(4)


class Dressed:
    """Controller of the table's arm, and a guard with limits of the wearer."""

    def __init__(self):
        description = load_rig("recupera_like_qdd")
        self.assembly = assemble(description, Body(1.78, 75.0, "male"))
        machine = nominal_machine(description, self.assembly.exo.phi)
        self.mean, self.covariance = prior(self.assembly, machine)
        self.envelope = Envelope(limits(description), DT)
        self.worn = PersonLimitsManager(self.envelope, self.assembly, machine, self.mean)
        self.controller = ArmController(self.assembly, machine, self.mean, DT)
        self.postures = sample_postures(description, 16)[1:8]
        self.phi = ParameterLayout.of(self.assembly).phi

    def kept_back(self, x: np.ndarray, weight_kg: float = 0.0) -> np.ndarray:
        """Largest torque that the guard removes from carrying this arm and a weight in the hand, by joint [N·m]."""
        person, most = self.envelope.person, np.zeros(4)
        assert person is not None
        for q in self.postures:
            self.controller.step(q, STILL, Reference(q, STILL, STILL))
            tau = self.controller.torque_at_rest(q, x, held_weight(self.assembly.arm, weight_kg))
            person.look(q.tolist(), [0.0] * 4)
            most = np.maximum(most, np.abs(np.subtract(person.bounded(tau.tolist()), tau)))
        return most


@pytest.fixture(scope="module")
def dressed() -> Iterator[Dressed]:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(plausible_table, "CHECKED", 256)  # The certified error does not matter here.
        yield Dressed()


def arm_times(dressed: Dressed, factor: float) -> np.ndarray:
    x = dressed.mean.copy()
    x[dressed.phi] *= factor
    return x


def test_before_anybody_is_identified_every_arm_that_is_believed_possible_is_carried(dressed: Dressed):
    dressed.worn.expect(dressed.mean, dressed.covariance, 1.0)
    values, vectors = np.linalg.eigh(dressed.covariance)
    spread = vectors * np.sqrt(np.maximum(values, 0.0))
    for draw in np.random.default_rng(2).standard_normal((6, len(values))):
        x = dressed.mean.copy()
        x[dressed.phi] += (spread @ draw)[dressed.phi]
        assert (dressed.kept_back(x) == 0.0).all()


def test_an_arm_of_ten_times_the_weight_is_kept_back_known_or_not(dressed: Dressed):
    for tell in (
        lambda: dressed.worn.expect(dressed.mean, dressed.covariance, 1.0),
        lambda: dressed.worn.know(dressed.mean),
    ):
        tell()
        assert (dressed.kept_back(dressed.mean) == 0.0).all()
        assert dressed.kept_back(arm_times(dressed, 10.0))[0] > 20.0


def test_the_heaviest_weight_is_plausible_only_while_it_is_weighed_and_once_it_is_known(dressed: Dressed):
    dressed.worn.know(dressed.mean)
    assert dressed.kept_back(dressed.mean, HEAVIEST_KG)[0] > 2.0
    dressed.worn.weigh(dressed.mean, "hand", 0.7)
    for kg in (0.0, 0.5, 1.0, 1.5, HEAVIEST_KG):
        assert (dressed.kept_back(dressed.mean, kg) == 0.0).all()
    dressed.worn.know(dressed.mean, held_weight(dressed.assembly.arm, HEAVIEST_KG))
    assert (dressed.kept_back(dressed.mean, HEAVIEST_KG) == 0.0).all()


def test_only_who_is_known_has_the_small_tank_and_the_machine_s_own_speed(dressed: Dressed):
    def now() -> tuple[float, float, float]:
        person = dressed.envelope.person
        assert person is not None
        return person.limits.v_trip_rad_s, person.limits.tank_max_J, person.limits.path_W

    dressed.worn.weigh(dressed.mean, "hand", 0.7)
    v_trip, tank_J, path_W = now()
    assert v_trip == 0.7 + V_MORE_RAD_S
    assert tank_J > 3.0
    assert path_W > 0.0
    dressed.worn.know(dressed.mean)
    assert now() == (np.inf, 1.0, 0.0)


def test_the_gravity_level_outlives_a_change_of_person(dressed: Dressed):
    dressed.worn.know(dressed.mean)
    assert dressed.envelope.person is not None
    dressed.envelope.person.gravity_level = 0.4
    dressed.worn.know(arm_times(dressed, 1.1))
    assert dressed.envelope.person.gravity_level == 0.4
    dressed.envelope.person.gravity_level = 0.0
