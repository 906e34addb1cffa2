"""Replay of a run in lock-step: pilots, controllers and their commands, as recorded."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from exograv.control.controller_acts import (
    CarryWeight,
    ControllerAct,
    ForceParameters,
    HangWeight,
    LeadArm,
    PublishParameters,
    read_act,
)
from exograv.control.exo_tick import ExoTick
from exograv.control.tick import ControlMode
from exograv.errors import RecordingError
from exograv.loop.arm_controller import ArmController
from exograv.loop.output_feedback import NoTorque, OutputFeedback
from exograv.loop.pilot import Progress
from exograv.loop.replay_log import read_actuators, read_machine, read_person
from exograv.recording.fields import Message
from exograv.signals import Reference

from .columns import Columns, ReplayedDecisions, ReplayedPiece
from .guard_replay import SETTLED_S, GuardReplay
from .recorded_run import RecordedRun, readable
from .what_if import ReplayOverrides


class Lockstep:
    """Replay of the ticks of one recording."""

    def __init__(self, recorded: RecordedRun, instead: ReplayOverrides):
        self._recorded, self._instead = recorded, instead
        self._again = ReplayedDecisions.of(0, len(recorded.recording.joints))
        self._told = 0
        self._pilot: _Pilot | None = None

    def fly(self, progress: Progress) -> Iterator[ReplayedPiece]:
        """Replay all ticks in pieces, or those before the first that cannot be replayed.

        Raises:
            RecordingError: The commands to control are missing or cannot be read.
            ConfigError: A replacement for something recorded cannot be used.
        """
        total = self._recorded.recording.tick_count
        for columns in self._recorded.pieces():
            progress("Replaying", columns.first / total)
            self._again.begin(len(columns))
            for k in range(len(columns)):
                self._tick(k, columns)
            yield columns, self._again
        progress("Replaying", 1.0)

    def _tick(self, k: int, columns: Columns) -> None:
        self._tell(columns.control[k])
        pilot = self._pilot
        if pilot is None:
            raise RecordingError(
                f"{self._recorded.recording.path}: the first tick has no pilot. Another program wrote this file; "
                "replay only recordings of exograv."
            )
        if columns.lost[k] and not pilot.is_new:
            self._again.gaps.append((columns.t[k], columns.lost[k]))
            pilot.lose(k, columns)
        pilot.tick(k, columns)

    def _tell(self, until: int) -> None:
        messages, path = self._recorded.control, self._recorded.recording.path
        if until > len(messages):
            raise RecordingError(
                f"{path} holds {len(messages)} of the {until} messages to control. Use a complete copy of the file."
            )
        with readable(path):
            for message in messages[self._told : until]:
                if message["act"] == "pilot":
                    self._pilot = _Pilot(self._recorded, self._instead, self._again, message)
                elif self._pilot is not None:
                    self._pilot.hear(message)
        self._told = until


class _Pilot:
    """Machine with its guard, its observer and the controllers of a run."""

    def __init__(
        self,
        recorded: RecordedRun,
        instead: ReplayOverrides,
        again: ReplayedDecisions,
        message: Message,
    ):
        self._recorded, self._instead, self._again = recorded, instead, again
        self._period_s, joints = message["period_s"], len(recorded.recording.joints)
        actuators, is_other = read_actuators(message["actuators"]), instead.is_anything
        self._guarding = GuardReplay(recorded.description, actuators, self._period_s, is_other_run=is_other)
        self._guarding.know(recorded.guard_states)
        self._feedback, self._recorded_torque = OutputFeedback(joints, self._period_s), NoTorque(joints)
        self._controllers: list[ExoTick | ArmController | None] = []
        self._flying: ExoTick | ArmController | None = None
        self._settles_at = -np.inf
        self.is_new = True

    def hear(self, message: Message) -> None:
        """Apply a recorded command to control before the next tick."""
        act, flying = message["act"], self._flying
        if act == "fly":
            if "kind" in message:
                self._controllers.append(self._made(message))
            self._flying = self._controllers[message["controller"]]
        elif act == "wear":
            person = None if message["person"] is None else read_person(message["person"])
            self._guarding.wear(person, message.get("gravity_level", 0.0), message.get("is_driven", False))
        elif act == "level":
            self._guarding.feel(message["gravity_level"], message["is_driven"])
        elif flying is not None:
            self._tell(flying, read_act(message), message["t"])

    def _made(self, message: Message) -> ExoTick | ArmController | None:
        recorded, instead = self._recorded, self._instead
        if message["kind"] == "empty":
            return ExoTick(recorded.description, recorded.tree)
        if message["kind"] == "arm":
            assembly = replace(recorded.assembly, slid_m=tuple(message.get("slid_m", ())))
            machine = instead.machine(read_machine(message["machine"]), assembly)
            x = instead.parameters(np.array(message["x"]), machine, assembly)
            return ArmController(assembly, machine, x, self._period_s)
        return None

    def _tell(self, flying: ExoTick | ArmController, act: ControllerAct, t: float) -> None:
        if isinstance(flying, ExoTick):
            if isinstance(act, HangWeight):
                flying.hang(act.place, act.mass_kg)
        elif isinstance(act, LeadArm):
            flying.let_lead(act.side)
        elif isinstance(act, CarryWeight):
            self._compare(act, flying.carry(act.place, act.mass_kg, act.q), t)
        elif isinstance(act, PublishParameters | ForceParameters) and self._instead.person is None:
            x = self._instead.parameters(act.x, flying.machine, flying.assembly)
            if isinstance(act, ForceParameters):
                flying.put_in_force(x)
            else:
                self._compare(act, flying.publish(x, act.q), t)

    def _compare(self, act: CarryWeight | PublishParameters, is_taken: bool, t: float) -> None:
        if is_taken != act.taken:
            verb = "took" if is_taken else "refused"
            self._again.surprises.append(f"At {t:.3f} s control {verb} a command, unlike in the run ({act.act}).")

    def lose(self, k: int, columns: Columns) -> None:
        """Restart the filters after a gap of ticks before tick `k`, because their memory is out of date."""
        self._guarding.lose(k, columns)
        self._feedback.forget()
        self._settles_at = columns.t[k] + SETTLED_S
        for controller in self._controllers:
            if isinstance(controller, ArmController):
                controller.forget()

    def tick(self, k: int, columns: Columns) -> None:
        """Take one tick as the pilot did."""
        self.is_new = False
        again, feedback, flying = self._again, self._feedback, self._flying
        if flying is None:
            # This controller was not recorded, so its recorded torque takes its place.
            self._recorded_torque.tau_feedforward = columns["tau_desired"][k]
        feedback.controller = self._recorded_torque if flying is None else flying
        feedback.reference = Reference(*(columns[name][k] for name in ("q_reference", "v_reference", "a_reference")))
        if isinstance(flying, ArmController):
            self._set_mode(flying.mode, *columns.mode[k])
        again.is_rebuilt[k] = flying is not None
        again.knows_control[k] = columns.t[k] >= self._settles_at
        decision = self._guarding.take(k, columns, feedback, again)
        if decision.submitted is not None:
            again.tau_desired[k] = decision.submitted.tau

    def _set_mode(self, mode: ControlMode, drive: float, gravity_level: float, arm_share: float) -> None:
        instead = self._instead.gravity_level
        mode.drive, mode.arm_share = drive, arm_share
        mode.gravity_level = gravity_level if instead is None else instead
