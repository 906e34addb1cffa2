"""Virtual participant who reaches from the lap to the believed place of the target, and returns.

The place of a touch results from muscles, from the felt posture of the arm, and from the residual torque of the
    machine;
no deviation is prescribed. The constants are in `Habits`, the equations in
    docs/explanation/virtual_participant.md. The
model shows that the software works; it is no evidence about people.
"""

import enum
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.laboratory.movements import REST_DEG, TARGET_DEG
from exograv.motion import Trajectory
from exograv.rig.twin.behaviour.acting_wearer import ActingWearer, Physiology, usual_physiology
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics
from exograv.rig.twin.disturbances.ornstein_uhlenbeck import BLOCK, OrnsteinUhlenbeck
from exograv.rig.twin.world.surroundings import Surroundings
from exograv.storage.session_checkpoint import LearnedState
from exograv.task.picture import ParticipantPicture

from .adaptation import Adaptation
from .habits import Habits
from .reach_planning import ReachPaths

PerFreedom = Float[np.ndarray, " arm"]
OnScreen = Float[np.ndarray, " 2"]

TABLE_S = 0.02
"""Time between two samples of the torque that a movement needs [s]."""


class Movement(NamedTuple):
    """Planned movement of the arm."""

    path: Trajectory
    known: Float[np.ndarray, "tick arm"]
    """Torque that the person expects to need (tick, arm) [N·m]."""


Thinker = Callable[[Callable[[], Movement]], Callable[[], Movement | None]]
"""Function that begins to plan a movement, and returns a function that gives the movement, or None until it is planned.
"""


def at_once(plan: Callable[[], Movement]) -> Callable[[], Movement | None]:
    """Plan now. The caller waits, so that only a simulation that can wait uses it."""
    movement = plan()
    return lambda: movement


class Activity(enum.Enum):
    """Activity of the participant."""

    LYING = "the arm lies on its support, relaxed"
    READY = "the arm is held above it"
    REACHING = "on the way to the target"
    RETURNING = "on the way back"


class PointingPerson:
    """Participant with the twin's own arm, delayed and noisy muscles, and a small error of the felt posture."""

    def __init__(
        self,
        own: ArmInverseDynamics,
        worn_inertia: Float[np.ndarray, "arm arm"],
        surroundings: Surroundings,
        target: OnScreen,
        too_short: str,
        seed: int,
        period_s: float,
        habits: Habits | None = None,
    ):
        """Start in the lying state, without experience of weightlessness.

        Args:
            own: The participant's knowledge of the own arm.
            worn_inertia: Inertia of the machine, to which the participant is used [kg·m²].
            surroundings: Place of the screen.
            target: Place of the target, right and up of the screen's centre [m].
            too_short: Shape of the arrow that means a touch too soon, as instructed.
            seed: Seed of the personal map, and with the day (`begin_day`) of all noise.
            period_s: Time between two calls of `act` [s].
            habits: Constants of this participant.
        """
        self.inner_ear: Callable[[], float] = lambda: 1.0
        """Gravity at the head, relative to Earth's [-]. Support of the arm does not change it."""
        self.think: Thinker = at_once
        """Planner of the movements. Until a movement is planned, the person goes on as before."""
        self._thought: Callable[[], Movement | None] | None = None
        self._next, self._next_s = Activity.LYING, 0.0
        self.habits, self._own = habits or Habits(), own
        self._surroundings, self._target, self._too_short, self._dt = surroundings, target, too_short, period_s
        freedoms = len(worn_inertia)
        self._worn = self.habits.knows_machine * worn_inertia
        self._rest, self._usual = (
            np.deg2rad([*angles, *[0.0] * (freedoms - len(angles))]) for angles in (REST_DEG, TARGET_DEG)
        )
        self._body = physiology_of(self.habits, freedoms)
        self._muscles = ActingWearer(self._body, period_s)
        self._muscles.tension = np.full(freedoms, self.habits.tension)
        self._seed = seed
        self._bias = np.deg2rad(self.habits.bias_sd_deg) * np.random.default_rng([seed, 31]).standard_normal(freedoms)
        self.begin_day(0)
        self._effort, self._effort_follows = np.zeros(freedoms), 1.0 - np.exp(-period_s / self.habits.effort_s)
        self._relaxed = np.zeros(freedoms)
        self.doing, self._tension = Activity.LYING, 0.0
        self._aim_off, self._depth, self._is_felt = np.zeros(2), self.habits.depth_m, False
        self._shift = self._shift_per_level()
        # The hand is clear of the support: an arm that lies partly on it would feel too light.
        above = own.fingertip(self._rest) + np.array([0.0, 0.0, self.habits.lift_m])
        self._ways = ReachPaths(own, surroundings, self._usual, self.habits, period_s)
        self._rest = self._ways.reached(above, self._rest, self._rest, 8)
        self._interval_s, self._begins, self._ends = self.habits.interval_s, np.inf, np.inf
        self._began, self._takes_s = 0.0, self.habits.reach_s
        self._contact: float | None = None
        self._arrow: str | None = None
        self._is_task, self._is_first = False, True
        self._wants = self._q_felt = self._rest
        self._is_awaited, self._left_s = False, np.inf

    def begin_day(self, day: int) -> None:
        """Start a day without experience of weightlessness. The person is the same, the noise is the day's own."""
        habits, each = self.habits, np.ones(len(self._bias))
        # Each kind of noise has its own generator, so that more samples of one kind do not change the others.
        felt, noise, self._random, contexts = (np.random.default_rng([self._seed, 31, k, day]) for k in range(1, 5))
        self._felt = OrnsteinUhlenbeck(np.deg2rad(habits.felt_sd_deg) * each, habits.felt_s, self._dt, felt)
        self._noise = OrnsteinUhlenbeck(habits.motor_noise * each, habits.motor_noise_s, self._dt, noise)
        self.adaptation = Adaptation(habits.rates, contexts)
        self._draw()

    def see(self, t: float, picture: ParticipantPicture) -> None:
        """Start when the target appears, get ready shortly before, and rest when it has disappeared."""
        is_task = picture.screen == "task"
        self._arrow = None if picture.arrow is None else picture.arrow.shape
        if is_task and not self._is_task:
            self._is_first = True  # The first touch does not wait for the pace.
            self._is_felt = False
            self._aim_off = self.habits.keeps_aim * self._aim_off
            self._begins = t + self.habits.reaction_s + (self.habits.full_s if self.doing is Activity.LYING else 0.0)
        self._is_task = is_task
        comes = (
            picture.screen == "rest" and picture.countdown_s is not None and picture.countdown_s < self.habits.ready_s
        )
        self._is_awaited = is_task or comes
        if not is_task:
            self._begins = np.inf
        self._left_s = picture.countdown_s if is_task and picture.countdown_s is not None else np.inf

    def touched(self, t: float, off: OnScreen | None) -> None:
        """Learn from the seen deviation and from the held torque, and time the next touch."""
        if not self.is_under_way or self._thought is not None:
            return
        habits = self.habits
        self._contact = t
        if off is not None:
            self._learn(off + habits.seen_sd_m * self._random.standard_normal(2))
        if self._arrow is not None and not self._is_first:
            slower = 1.0 if self._arrow == self._too_short else -1.0
            self._interval_s *= 1.0 + habits.hurries * slower
        self._is_first = False
        missed_by = 1.0 + habits.interval_sd * float(self._random.standard_normal())
        self._takes_s += 0.5 * (t - self._began - self._takes_s)
        self._begins = t + max(self._interval_s * missed_by - self._takes_s, 0.0)
        # The push continues: a finger that yields at once would bounce.
        stays = motion.hold(self._q_felt + self._muscles.error, habits.touch_s, self._dt)
        self._begin(t, Activity.REACHING, self._expected(stays), habits.touch_s)

    def _learn(self, seen: OnScreen) -> None:
        by_weight = float(seen @ self._shift / (self._shift @ self._shift))
        self._aim_off = self._aim_off - self.habits.learns_aim * seen
        before = self.gravity_expected
        self.adaptation.learn(by_weight / (1.0 - self.habits.trusts_felt))
        # Weight that is now anticipated needs no held torque. Without held torque the weight moves the arm next time.
        weight, changed = self._weight(self._wants), before - self.gravity_expected
        held = -float(self._muscles.hold @ weight / (weight @ weight))
        self._muscles.hold = self._muscles.hold + np.clip(held, min(changed, 0.0), max(changed, 0.0)) * weight

    @property
    def is_under_way(self) -> bool:
        """True if the next contact is the intended touch."""
        return self.doing is Activity.REACHING and self._contact is None

    @property
    def gravity_expected(self) -> float:
        """Share of the arm's weight for which the muscles are prepared [-]."""
        known = self.adaptation.expected
        return known + self.habits.trusts_felt * (self.adaptation.felt - known)

    @property
    def inertia_expected(self) -> float:
        """Share of the arm's inertia for which the muscles are prepared [-].

        A person who feels no weight underestimates the mass.
        """
        return 1.0 - self.habits.mass_doubt * (1.0 - self.adaptation.felt)

    @property
    def learned(self) -> LearnedState:
        """State for the next session."""
        return LearnedState(slow=self.adaptation.slow, aim=(float(self._aim_off[0]), float(self._aim_off[1])))

    def remember(self, learned: LearnedState) -> None:
        """Restore the state of former sessions, or of an interrupted one."""
        self.adaptation.remember(learned.slow)
        self._aim_off = np.array(learned.aim)

    def act(self, t: float, q_arm: PerFreedom, v_arm: PerFreedom) -> PerFreedom:
        """Muscle torque (arm,) [N·m]."""
        self._decide(t, q_arm)
        change = self._dt / self.habits.full_s
        self._tension = (
            max(self._tension - change, 0.0) if self.doing is Activity.LYING else min(self._tension + change, 1.0)
        )
        if self._tension == 0.0:
            return self._relaxed
        if self._row == BLOCK:
            self._draw()
        self._q_felt = q_arm + self._offs[self._row]
        tau = self._tension * self._gains[self._row] * self._muscles.step(t, self._q_felt, v_arm)
        self._row += 1
        self._effort += self._effort_follows * (tau - self._effort)
        return tau

    def _draw(self) -> None:
        """Draw the error of the felt posture and the gain error of the muscles for the next ticks."""
        self._offs, self._gains, self._row = self._bias + self._felt.block(), 1.0 + self._noise.block(), 0

    def look_at(self, target: OnScreen) -> None:
        """See the target at this place, right and up of the screen's centre [m]."""
        self._target = target

    def rehearse(self) -> None:
        """Plan a reach and forget it: the first plan imports and compiles for a tenth of a second."""
        self._expected(self._way_to_target())

    def _decide(self, t: float, q_arm: PerFreedom) -> None:
        if self._thought is not None:
            self._begin_thought(t)
            return
        doing = self.doing
        if doing is Activity.LYING and self._is_awaited:
            self._muscles.hold = np.zeros_like(self._muscles.hold)
            felt = q_arm + self._offs[min(self._row, BLOCK - 1)]
            self._intend(t, Activity.READY, lambda: motion.go_to(felt, self._rest, 0.6, self._dt), np.inf)
        elif doing is Activity.READY and t >= self._begins and self._left_s > self._takes_s:
            self._feel()
            self._begins, self._began, self._contact = np.inf, t, None
            self._intend(t, Activity.REACHING, self._way_to_target, self.habits.reach_s + 2.0 * self.habits.touch_s)
        elif doing is Activity.REACHING and t >= self._ends:
            if self._contact is None:
                self._depth, self._begins = self._depth + 0.01, t + self.habits.reach_s
            self._intend(t, Activity.RETURNING, self._way_back, self.habits.reach_s)
        elif doing is Activity.RETURNING and t >= self._ends:
            self.doing = Activity.READY
        elif doing is Activity.READY and not self._is_awaited:
            self.doing = Activity.LYING

    def _way_to_target(self) -> Trajectory:
        believed = self._target + self._seen_higher() + self._aim_off
        return self._ways.to_screen(self._rest, self._ways.posture_at(believed, self._depth))

    def _way_back(self) -> Trajectory:
        return motion.backwards(self._ways.to_screen(self._rest, self._wants))

    def _seen_higher(self) -> OnScreen:
        """Upward shift of the perceived target for the gravity at the head [m]."""
        return np.array([0.0, self.habits.sees_higher_m * (self.inner_ear() - 1.0)])

    def _feel(self) -> None:
        """Infer the context from the holding effort, before the first reach of a window."""
        if self._is_felt:
            return
        self._is_felt = True
        weight, still = self._weight(self._rest), np.zeros_like(self._rest)
        # The person knows the elasticity of the own joints.
        felt = self._effort - self._own.torque(self._rest, still, still, 0.0)
        share = float(felt @ weight / (weight @ weight))
        self.adaptation.window(share)
        # Effort that is not weight is held as before. The weight is now anticipated, as far as it is trusted.
        self._muscles.hold = felt - share * weight

    def _intend(self, t: float, doing: Activity, path: Callable[[], Trajectory], lasts_s: float) -> None:
        """Begin an activity as soon as its movement is planned."""
        self._next, self._next_s = doing, lasts_s
        self._thought = self.think(lambda: self._expected(path()))
        self._begin_thought(t)

    def _begin_thought(self, t: float) -> None:
        movement = None if self._thought is None else self._thought()
        if movement is not None:
            self._thought = None
            self._begin(t, self._next, movement, self._next_s)

    def _begin(self, t: float, doing: Activity, movement: Movement, lasts_s: float) -> None:
        self.doing, self._wants, self._ends = doing, movement.path.q[-1], t + lasts_s
        self._muscles.want(movement.path, movement.known, t)

    def _expected(self, path: Trajectory) -> Movement:
        is_moving = path.v.any()
        every = max(1, round(TABLE_S / self._dt)) if is_moving else len(path)
        rows = np.unique([*range(0, len(path), every), len(path) - 1]) if is_moving else np.zeros(1, dtype=int)
        known = np.array([self._needed(path.q[k], path.v[k], path.a[k]) for k in rows])
        ticks = np.arange(len(path))
        return Movement(path, np.column_stack([np.interp(ticks, rows, column) for column in known.T]))

    def _needed(self, q: PerFreedom, v: PerFreedom, a: PerFreedom) -> PerFreedom:
        return self._own.torque(q, v, a, self.gravity_expected, self.inertia_expected) + self._worn @ a

    def _weight(self, q: PerFreedom) -> PerFreedom:
        """Torque of the arm's whole weight at a posture [N·m]."""
        still = np.zeros_like(q)
        return self._own.torque(q, still, still, 1.0) - self._own.torque(q, still, still, 0.0)

    def _shift_per_level(self) -> OnScreen:
        """Displacement of the finger, right and up, for an expected but absent weight, by stiffness and reflex [m]."""
        stiffness = self._body.stiffness * self._muscles.tension * (1.0 + self._body.nerves.reflex_share)
        turn, tip = self._weight(self._usual) / stiffness, self._own.fingertip(self._usual)
        moved = (self._own.fingertip(self._usual + 1e-3 * turn) - tip) / 1e-3
        return self._surroundings.screen_axes[:, :2].T @ moved


def physiology_of(habits: Habits, freedoms: int) -> Physiology:
    """Make muscles and nerves of this person."""
    usual = usual_physiology(freedoms)
    return replace(
        usual,
        stiffness=habits.stiffness_share * usual.stiffness,
        damping=habits.damping_share * usual.damping,
        torque_max=habits.strength_share * usual.torque_max,
        nerves=habits.nerves,
    )
