"""Orders of a procedure reach control in order, are carried out tick by tick, and are the same in a recording."""

import json
from collections import deque
from collections.abc import Callable
from unittest.mock import Mock

import numpy as np
import pytest

from exograv.errors import RigError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate
from exograv.live.arm_worker import LearnedArm
from exograv.live.live_guided import LiveGuided
from exograv.live.live_moved import LiveMoved
from exograv.live.live_procedure import STOPPED, LiveFloat
from exograv.live.procedure_orders import (
    STATES,
    Order,
    OrderedMotion,
    OrderMemory,
    TaughtRows,
    followed_dtype,
    read_order,
    written_order,
)
from exograv.loop.moved_machine import MovedMachine
from exograv.loop.person_limits_manager import LimitsMaker
from exograv.model.anthropometry import Body
from exograv.model.arm import Arm
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.motion import Cycles, Passage, Planned
from exograv.procedures.identification.identify import planned_excitation
from exograv.procedures.rehabilitation.guided.grip import DROP_S, GripOutcome
from exograv.procedures.rehabilitation.guided.guided_arm import GuidedArm, GuidedArms
from exograv.procedures.rehabilitation.guided.mirror_guide import MIDDLE_M
from exograv.procedures.rehabilitation.guided.mirror_plan import MirrorPlan
from exograv.procedures.rehabilitation.guided.repeat import RepeatResult, repeat
from exograv.runtime.processes.shared_memory import MessageRing, Ring
from exograv.signals import Reference

RIG = load_rig("recupera_like")
JOINTS, DT = len(RIG.joints), 0.004
LOW, HIGH = np.array([0.1, 0.2, 0.0, 0.4]), np.array([0.5, 0.3, 0.1, 0.9])
STILL = np.zeros(JOINTS)
PASSAGE = Passage.planned(LOW, HIGH, 0.6, 0.1, DT)
CYCLES = Cycles(LOW, HIGH, 3.0, 1, 1.0, DT)
HARMONICS = planned_excitation(RIG.excitation, 4.0, DT)


@pytest.mark.parametrize("path", [None, PASSAGE, CYCLES, HARMONICS])
def test_an_order_in_a_recording_is_the_same_order_to_the_last_bit(path: Planned | None):
    order = Order(3, True, path, place="forearm", mass_kg=1.0 / 3.0, is_load_known=False)
    again = read_order(json.loads(json.dumps(written_order(order))))
    assert (again.number, again.is_led, again.place, again.mass_kg, again.is_load_known) == (
        3, True, "forearm", 1.0 / 3.0, False,
    )  # fmt: skip
    if path is None:
        assert again.path is None
        return
    assert again.path is not None
    assert len(again.path) == len(path)
    np.testing.assert_array_equal(again.path.at(77), path.at(77))


def test_the_arm_of_an_order_in_a_recording_is_the_same_to_the_last_bit():
    x = tuple(np.random.default_rng(0).normal(size=5).tolist())
    again = read_order(json.loads(json.dumps(written_order(Order(1, True, x=x)))))
    assert again.x is not None
    assert again.x == x


ROWS = TaughtRows([(LOW + share * (HIGH - LOW)).tolist() for share in np.linspace(0.0, 1.0, 40)], 0.04)


class Given:
    """Control's part with orders from a list."""

    def __init__(self, *orders: Order):
        self.waiting, self.rows = deque(orders), list[np.ndarray]()
        self.motion = OrderedMotion(RIG, DT, self.next, lambda row: self.rows.append(row.copy()))

    def next(self) -> Order | None:
        return self.waiting.popleft() if self.waiting else None


def test_a_path_begins_only_with_the_full_feedback_and_ends_where_it_leads():
    given = Given(Order(1, True, PASSAGE))
    motion = given.motion
    assert motion.take(HIGH) is not None
    np.testing.assert_array_equal(motion.reference(0.0, 0.5, LOW, STILL).q, HIGH)
    motion.told(0.0, HIGH, HIGH)
    np.testing.assert_array_equal(motion.reference(1.0, 1.0, LOW, STILL).q, PASSAGE.at(0)[0])
    motion.told(1.0, HIGH, HIGH)
    end = motion.reference(1.0 + len(PASSAGE) * DT, 1.0, LOW, STILL)
    np.testing.assert_allclose(end.q, HIGH)
    np.testing.assert_array_equal(end.v, 0.0)
    assert [int(row["tick"]) for row in given.rows] == [-1, 0]


def test_a_weight_alone_moves_nothing():
    given = Given(Order(1, True, PASSAGE), Order(2, True, place="hand", mass_kg=1.0))
    motion = given.motion
    motion.take(LOW)
    motion.reference(0.0, 1.0, LOW, STILL)
    held = motion.reference(0.2, 1.0, LOW, STILL).q
    assert motion.take(LOW) is not None
    np.testing.assert_array_equal(motion.reference(0.3, 1.0, LOW, STILL).q, held)
    assert motion.count == 2


def test_after_a_stop_no_order_is_in_force_and_the_load_counts_as_known():
    motion = Given(Order(1, True, is_load_known=False)).motion
    motion.take(LOW)
    assert motion.is_led
    assert not motion.is_load_known
    motion.drop()
    assert not motion.is_led
    assert motion.is_load_known


def test_an_arm_that_is_taken_again_is_moved_by_no_order_from_before():
    given = Given(Order(1, True, PASSAGE), Order(2, True, PASSAGE), Order(3, True))
    given.motion.take(LOW)
    given.motion.discard()
    assert not given.motion.is_led
    assert given.motion.take(LOW) is None
    assert given.motion.count == 3


def test_the_procedure_hears_which_arm_control_has_refused():
    given = Given(Order(1, True, x=(0.0,)), Order(2, True, x=(1.0,)))
    for _ in range(2):
        given.motion.take(LOW)
        given.motion.told(0.0, LOW, LOW)
        order = given.motion.order
        assert order is not None
        given.motion.refuse(order)
    given.motion.told(0.0, LOW, LOW)
    assert [(int(row["order"]), int(row["refused"])) for row in given.rows] == [(1, 0), (2, 1), (2, 2)]


BOTH = assemble(load_rig("recupera_like_dual"), Body(1.75, 70.0, "female"))
PLAN = MirrorPlan.of(BOTH, "right")
NEAR, FAR = MIDDLE_M - 0.01, MIDDLE_M + 0.05


def hands_at(distance_m: float) -> tuple[list[list[float]], list[list[float]]]:
    """Points of two arms: fingertip, wrist, elbow and shoulder of each, with the right hand near the middle."""
    right = [[distance_m, 0.5, 0.0], [distance_m, 0.4, 0.0], [0.2, 0.2, 0.0], [0.2, 0.0, 0.0]]
    return [], [*right, *([-x, y, z] for x, y, z in reversed(right))]


def mirrored(distance_m: float = FAR) -> tuple[Given, np.ndarray]:
    """Control's part with both arms, whose right arm leads, and its first posture [rad]."""
    given, q = Given(Order(1, True, guide="mirror")), 0.5 * np.sum(BOTH.description.workspace, axis=0)
    given.motion = OrderedMotion(
        BOTH.description, DT, given.next, lambda row: given.rows.append(row.copy()), mirrored=PLAN
    )
    given.motion.skeleton = lambda _q: hands_at(distance_m)
    given.motion.take(q)
    return given, q


def held(given: Given, q: np.ndarray, seconds: float) -> Reference:
    """Let control compute its reference for a time with both arms at `q` [rad]; return the last one."""
    still = np.zeros_like(q)
    reference = Reference(q, still, still)
    for _ in range(round(seconds / DT)):
        reference = given.motion.reference(0.0, 1.0, q, still)
        given.motion.told(0.0, q, still)
    return reference


def test_one_arm_leads_the_other_from_the_order_to_the_floating_arm():
    given, q = mirrored()
    assert given.motion.leading == "right"
    q[PLAN.which.lead] += 0.1
    pull = held(given, q, 3.0).q - q
    assert np.abs(pull[PLAN.which.follow]).min() > 0.0
    assert not pull[PLAN.which.lead].any()
    assert [int(row["state"]) for row in given.rows[-1:]] == [STATES.index(GripOutcome.LED)]
    given.waiting.append(Order(2, True, lets_go=True))
    given.motion.take(q)
    np.testing.assert_array_equal(held(given, q, 2.0 * DROP_S).q, q)
    given.waiting.append(Order(3, False))
    given.motion.take(q)
    assert given.motion.leading is None


def test_control_itself_looks_at_the_hands():
    given, q = mirrored(NEAR)
    q[PLAN.which.lead] += 0.1
    held(given, q, 3.0)
    assert given.rows[-1]["waited_s"] == pytest.approx(3.0)
    assert not given.rows[-1]["pull"].any()


def test_after_a_stop_no_arm_leads():
    given, _ = mirrored()
    given.motion.drop()
    assert given.motion.leading is None


class Carried:
    """Procedure's part of a machine whose control is computed here, one tick at each wait."""

    def __init__(self, lost: tuple[int, ...] = ()):
        memory = OrderMemory(JOINTS)
        self.orders, self.followed, self.lost = memory.order_ring(), memory.followed_ring(), lost
        self.motion = OrderedMotion(RIG, DT, self.orders.take, self.tell, ROWS.trajectory(DT))
        self.now, self.is_stopped, self.holds = 0.0, False, False
        learned = Mock(spec=LearnedArm, floated=Mock(spec=Estimate, x=np.zeros(3)))
        self.floating = Mock(spec=LiveFloat, t=0.0, q=LOW.copy(), drive=1.0, learned=learned)
        self.floating.wait.side_effect = self.tick
        limits = Mock(spec=LimitsMaker)
        model = Mock(spec=ArmModel, assembly=Mock(spec=Assembly, arm=Mock(spec=Arm), description=RIG))
        self.moved = LiveMoved(self.floating, (self.orders, self.followed), limits, model, DT, lambda *_: None)

    def tell(self, row: np.ndarray) -> None:
        if int(row["tick"]) not in self.lost:
            self.followed.put(row)

    def tick(self) -> None:
        if self.is_stopped:
            raise RigError(STOPPED)
        self.now += DT
        self.floating.t, self.floating.drive = self.now, float(self.motion.is_led)
        self.motion.take(self.floating.q)
        reference = self.motion.reference(self.now, 1.0, self.floating.q, STILL)
        guide = self.motion._guide
        if guide is None:
            q = reference.q
        elif not self.holds:  # the person lets the guide lead
            q = self.floating.q = guide.target.copy()
        else:
            q = self.floating.q
        self.motion.told(self.now, q, 10.0 * q)

    def close(self) -> None:
        self.orders.close()
        self.followed.close()


@pytest.fixture
def carried():
    made = Carried()
    yield made
    made.close()


def test_a_live_machine_is_one_that_a_procedure_may_move(carried: Carried):
    assert isinstance(carried.moved, MovedMachine)


@pytest.mark.parametrize("lost", [(), (5, 6, 7), (0,)])
def test_every_tick_of_a_path_is_heard_once_and_few_lost_ones_are_interpolated(lost: tuple[int, ...]):
    carried = Carried(lost)
    heard = list[np.ndarray]()
    carried.moved.follow(CYCLES, "Moving", lambda q, tau: heard.append(np.array([q, tau])))
    carried.close()
    assert len(heard) == len(CYCLES) - (0 in lost)
    q = CYCLES.table().q[int(0 in lost) :]
    np.testing.assert_allclose([one[0] for one in heard], q, atol=1e-4)
    np.testing.assert_allclose([one[1] for one in heard], 10.0 * q, atol=1e-3)


def test_a_stop_ends_a_path(carried: Carried):
    carried.is_stopped = True
    with pytest.raises(RigError, match=STOPPED):
        carried.moved.follow(PASSAGE, "Moving")


def test_an_unknown_weight_silences_the_monitor_until_the_guard_knows_it(carried: Carried):
    x = np.zeros(3)
    carried.moved.expect_weight(x, "hand", 0.7)
    carried.tick()
    assert not carried.motion.is_load_known
    carried.moved.carry("hand", 1.5)
    carried.tick()
    assert carried.moved.weights == {"hand": 1.5}
    assert not carried.motion.is_load_known
    carried.moved.carry("hand", 0.0)
    assert carried.moved.weights == {}


def test_the_guard_takes_the_limits_before_control_takes_the_order(carried: Carried):
    acts = list[str]()
    carried.floating.wear.side_effect = lambda *_args, **_options: acts.append("wear")
    carried.floating.write.side_effect = lambda *_: acts.append("order")
    carried.moved.expect_weight(np.zeros(3), "hand", 0.7)
    assert acts == ["wear", "order"]


def test_both_rings_have_the_sizes_of_one_machine():
    memory = OrderMemory(JOINTS)
    orders, followed = memory.order_ring(), memory.followed_ring()
    assert isinstance(orders, MessageRing)
    assert isinstance(followed, Ring)
    assert followed_dtype(JOINTS)["q"].shape == (JOINTS,)
    orders.close()
    followed.close()


def repeated(carried: Carried, act: Callable[[], bool] = lambda: False) -> RepeatResult:
    return repeat(LiveGuided(carried.moved), ROWS.trajectory(DT), 1.0, 2, act)


def test_a_guided_live_arm_is_one_that_a_procedure_may_lead(carried: Carried):
    assert isinstance(LiveGuided(carried.moved), GuidedArm)
    assert isinstance(LiveGuided(carried.moved), GuidedArms)


@pytest.mark.long
def test_an_arm_that_follows_is_led_along_the_taught_path_and_floats_again(carried: Carried):
    result = repeated(carried)
    assert (result.state, result.repetitions) == (GripOutcome.ARRIVED, 2)
    assert max(result.figures.tracking_rms_deg) < 0.1
    assert not carried.motion.is_led
    assert [one.kwargs or one.args[1:] for one in carried.floating.wear.call_args_list][-1] == (False,)


@pytest.mark.long
def test_a_person_who_holds_is_released_and_the_arm_floats_again(carried: Carried):
    def act() -> bool:
        carried.holds = carried.now > 8.0
        return False

    result = repeated(carried, act)
    assert result.state is GripOutcome.OVERRULED
    assert result.repetitions == 0
    assert not carried.motion.is_led


@pytest.mark.long
def test_a_release_on_request_reaches_control(carried: Carried):
    result = repeated(carried, lambda: carried.now > 7.0)
    assert result.state is GripOutcome.RELEASED
    guide = carried.motion._guide
    assert guide is not None
    assert guide.grip == 0.0
