"""Faults of machines whose signals look right: frozen images, slow changes, another person's file, changed weights."""

from dataclasses import replace

import numpy as np

from exograv.loop.arm_controller import ArmController
from exograv.model.arm import held_weight
from exograv.signals import Command, JointState

from .control_faults import first_moment
from .fault_plant import FaultParticipant, World
from .injector import Injector

BOARD_TORQUE_NM = 1.0
"""Commanded torque above which a frozen board must be detected [N·m]: a third of the torque that the guard may miss."""


class FrozenMachine(Injector):
    """F41: the process image freezes: all signals keep their bits while sequence and time go on."""

    def draw(self) -> None:
        self.kept: dict[str, np.ndarray] = {}

    def measured(self, state: JointState, tick: int) -> JointState:
        self.kept = self.kept or signals_of(state)
        return state._replace(**self.kept)


class FrozenBoard(Injector):
    """F41: one board freezes: all signals of a joint keep their bits while sequence and time go on."""

    def draw(self) -> None:
        self.kept: dict[str, np.ndarray] = {}

    def measured(self, state: JointState, tick: int) -> JointState:
        self.kept = self.kept or signals_of(state)
        kept = self.kept
        return state._replace(
            **{
                name: self.at_joint(values, lambda _, name=name: float(kept[name][self.joint]))
                for name, values in signals_of(state).items()
            }
        )

    def shows(self, told: np.ndarray, moves: np.ndarray, noise_Nm: np.ndarray) -> np.ndarray:
        """Ticks in which the joint moves or carries a torque."""
        is_loaded = np.abs(told[:, self.joint]) > BOARD_TORQUE_NM
        return super().shows(told, moves, noise_Nm) & (moves[:, self.joint] | is_loaded)


def signals_of(state: JointState) -> dict[str, np.ndarray]:
    """Copy all signals that the drives measure or count, by the names of their fields."""
    fields = state._asdict()
    return {name: value.copy() for name, value in fields.items() if isinstance(value, np.ndarray)}


class TiltingBase(Injector):
    """F45: the base tilts by 10° within 5 s."""

    ANGLE_RAD, LASTS_MS, EVERY_MS = np.deg2rad(10.0), 5000, 10

    def draw(self) -> None:
        self.heading = float(self.generator.uniform(-np.pi, np.pi))

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        since = tick - self.onset
        if since % self.ticks(self.EVERY_MS) == 0 and since <= self.ticks(self.LASTS_MS):
            angle = self.ANGLE_RAD * since / self.ticks(self.LASTS_MS)
            level = np.array([np.cos(self.heading), np.sin(self.heading)])
            world.feel_gravity(np.array([*(np.sin(angle) * level), np.cos(angle)]))


class DriveTorqueConstantDrift(Injector):
    """F46: the torque constant of a motor falls by 40 % or rises by 60 % within 10 s."""

    LASTS_MS, EVERY_MS = 10_000, 10

    def draw(self) -> None:
        self.factor = float(self.generator.choice([0.6, 1.6]))
        self.now = 1.0

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        since = tick - self.onset
        if since % self.ticks(self.EVERY_MS) == 0 and since <= self.ticks(self.LASTS_MS):
            wanted = 1.0 + (self.factor - 1.0) * since / self.ticks(self.LASTS_MS)
            world.turn_motor(self.joint, wanted / self.now)
            self.now = wanted


class TorqueConstantDrift(DriveTorqueConstantDrift):
    """F46: the torque constant of a motor falls by 40 % or rises by 60 % within 10 s."""

    def commanded(self, command: Command, tick: int) -> Command:
        return command._replace(current=self.at_joint(command.current, lambda i: self.now * i))

    def measured(self, state: JointState, tick: int) -> JointState:
        return state._replace(current=self.at_joint(state.current, lambda i: i / self.now))


class CommonEncoderSlip(Injector):
    """F47: both encoders of a joint slip together, by 15° within 1 to 10 s."""

    def draw(self) -> None:
        self.size = float(self.generator.choice([-1.0, 1.0]) * np.deg2rad(15.0))
        self.lasts = self.ticks(int(self.generator.integers(1000, 10_000)))

    def measured(self, state: JointState, tick: int) -> JointState:
        off = min((tick - self.onset + 1) / self.lasts, 1.0) * self.size
        q = self.at_joint(state.q, lambda q: q + off)
        motor = None if state.q_motor is None else self.at_joint(state.q_motor, lambda q: q + off)
        return state._replace(q=q, q_motor=motor)


class OtherPerson(Injector):
    """F48: the file of another person is in force for this machine's wearer."""

    begins_at_once = True

    def draw(self) -> None:
        self.choice = float(self.generator.random())

    def known(self, participant: FaultParticipant) -> FaultParticipant:
        self.stranger = participant.strangers[int(self.choice * len(participant.strangers))]
        x = participant.prepared.x.copy()
        self.unbalanced = first_moment(self.stranger - x[: len(self.stranger)]) / first_moment(x[: len(self.stranger)])
        x[: len(self.stranger)] = self.stranger
        return replace(participant, person=participant.limits_with(x))

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            # The weight of the other arm comes at the rate of every handover, as it does in a session.
            x = controller.x.copy()
            x[: len(self.stranger)] = self.stranger
            controller.publish(x, world.q)


class CuffSlide(Injector):
    """F49: a cuff slides by 30 mm along the limb within 1 s."""

    WAY_M, LASTS_MS, EVERY_MS = 0.03, 1000, 10

    def draw(self) -> None:
        self.place = float(self.generator.random())
        self.way = float(self.generator.choice([-1.0, 1.0])) * self.WAY_M

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        since = tick - self.onset
        if 0 < since <= self.ticks(self.LASTS_MS) and since % self.ticks(self.EVERY_MS) == 0:
            cuffs = controller.assembly.cuffs
            cuff = cuffs[int(self.place * len(cuffs))].name
            world.slide_cuff(cuff, self.way * since / self.ticks(self.LASTS_MS))


class WeightDropped(Injector):
    """F50: a known weight of 1 to 2 kg, which the machine carries, falls out of the hand.

    The motors begin without the weight. The hand then moves at up to 0.2 m/s and is at rest again before the onset.
    """

    def draw(self) -> None:
        self.mass_kg = float(self.generator.uniform(1.0, 2.0))

    def known(self, participant: FaultParticipant) -> FaultParticipant:
        prepared, arm = participant.prepared, participant.prepared.assembly.arm
        x, added = prepared.x.copy(), held_weight(arm, self.mass_kg)
        x[: len(added)] += added
        # At full support of the arm, a weight in its parameters is carried like a known payload.
        return replace(participant, prepared=replace(prepared, x=x), person=participant.limits_with(x))

    def begin(self, world: World) -> None:
        world.hang("hand", self.mass_kg)

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            world.hang("hand", 0.0)


class WeightTakenUp(Injector):
    """F51: the wearer takes up an unknown weight of 1 to 2 kg while the arm floats."""

    def draw(self) -> None:
        self.mass_kg = float(self.generator.uniform(1.0, 2.0))

    def act(self, world: World, controller: ArmController, tick: int) -> None:
        if tick == self.onset:
            world.hang("hand", self.mass_kg)
