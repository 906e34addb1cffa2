"""Virtual machine with a virtual wearer: measurements as of a real machine, and the truth behind them."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import TracebackType

import mujoco
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.errors import RigError
from exograv.model.description import RigDescription
from exograv.rig.native_period import NativeMuscles, NativePeriod
from exograv.rig.twin.machine.drive import OMEGA, TAU_MOTOR, THETA
from exograv.rig.twin.machine.machine import Machine
from exograv.rig.twin.machine.sensors import Sensors
from exograv.rig.twin.wearer.arm_bodies import let_soft_tissue_hang
from exograv.rig.twin.wearer.muscles import Muscles
from exograv.rig.twin.wearer.wearer import Wearer
from exograv.rig.twin.world.cuff_sensors import CuffSensors, Wrenches
from exograv.rig.twin.world.engine_code import engine_addresses, engine_halves
from exograv.rig.twin.world.forces import late_name, measured_truth, pass_clock, step_forces
from exograv.rig.twin.world.poles import shoulder_poles
from exograv.rig.twin.world.scene import TIMESTEP, build_scene
from exograv.rig.twin.world.statics import Statics
from exograv.rig.twin.world.surroundings import Surroundings, TouchedScreen
from exograv.signals import Command, JointState, TorqueSource

SUBSTEPS = 2
PERIOD = SUBSTEPS * TIMESTEP
"""Time between two measurements [s]."""

# Friction reaches most of its fall within 30 min of running, which is three of these time constants [s].
WARM_UP_TIME = 600.0

OWNERS = "run", "run, second arm"
"""Owners of the random numbers of the arms: with the same numbers, both arms would move at the same time."""

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class Truth:
    """True state of the twin, which only examiners and tests may read."""

    machine: Machine
    wearer: Wearer | None
    q: Joints
    """Positions of the machine's joints [rad]."""

    v: Joints
    """Velocities of the machine's joints [rad/s]."""

    q_arm: Float[np.ndarray, " arm"]
    """Positions of the freedoms of the wearer's arms, the right arm first [rad]."""

    v_arm: Float[np.ndarray, " arm"]
    """Velocities of the freedoms of the wearer's arms [rad/s]."""

    tau_motor: Joints
    """Torque of the motors at the joint, before friction [N·m]."""

    tau_muscle: Float[np.ndarray, " arm"]
    """Muscle torque of the wearer, voluntary and involuntary [N·m]."""


class TwinDivergedError(RigError):
    """Simulation whose velocities are not finite any more."""


class Twin:
    """`Rig` simulated in MuJoCo.

    Each `write` advances it by one period. The same arguments and commands give the same run, bit for bit.
    """

    def __init__(
        self,
        description: RigDescription,
        machine: Machine,
        wearer: Wearer | None,
        seed: int,
        start_posture: Joints | None = None,
        t0: float = 0.0,
        lengths: Mapping[str, float] | None = None,
        surroundings: Surroundings | None = None,
    ) -> None:
        """Start at rest: the arm in balance in its cuffs, the motors with the torque that holds the posture.

        Args:
            description: Machine as its folder describes it.
            machine: True parameters of the machine.
            wearer: Wearer in the machine; `None` leaves it empty.
            seed: Seed of the run: noise and muscles.
            start_posture: True positions of the machine's joints [rad]; the donning posture if absent.
            t0: Time on the rig's clock, which starts when a cold machine is switched on [s].
            lengths: Adjustable lengths by segment [m]; if absent, those measured on the wearer, or the nominal ones.
            surroundings: Objects that the wearer's hand can touch; an empty room if absent.
        """
        self._description, self._machine, self._wearer, self._seed = description, machine, wearer, seed
        self._scene = build_scene(description, machine, wearer, lengths, surroundings)
        self._screen = surroundings and TouchedScreen(self._scene.model, self._scene.data, surroundings)
        self._forces = step_forces(self._scene, machine, wearer)
        memory = self._memory = self._forces.inputs
        self._current, self._damping, self._velocity = memory["current"], memory["damping"], self._scene.data.qvel
        self._valid_until, self._warmth = kernel.numbers(memory["valid_until"]), kernel.numbers(memory["warmth"])
        arms = () if wearer is None else wearer.arms
        ends = np.cumsum([0, *(len(place.freedoms) for place in self._scene.arms)]).tolist()
        self._muscle_torques = [
            (Muscles(arm.unrest, seed, PERIOD, owner), self._memory["tau_muscle"][begin:end])
            for arm, owner, (begin, end) in zip(arms, OWNERS, itertools.pairwise(ends), strict=False)
        ]
        truth = measured_truth(self._scene, machine)
        self._sensors = Sensors(machine, seed, truth, {name: self._memory[name] for name in truth.name_in()})
        self._poles = shoulder_poles(self._scene, wearer)
        self._no_torque = np.full(len(self.joints), np.nan)
        self._no_torque.flags.writeable = False  # all measurements share this array
        self._t0, self._steps = t0, 0
        self._measured: JointState | None = None
        self._wrenches: tuple[int, Wrenches] = (-1, np.empty((0, 6)))
        self.tau_voluntary = self._memory["tau_voluntary"]
        """Voluntary muscle torque of the wearer, in the order of `Truth.q_arm` [N·m]; examiners may write it."""
        self.tau_hand = self._memory["tau_hand"]
        """Torque (joint,) of a person who turns the machine's joints by hand [N·m]; examiners may write it."""
        self._start(description.donning_posture if start_posture is None else np.asarray(start_posture, dtype=float))

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints, in the order of every per-joint array."""
        return self._description.joints

    @property
    def period_s(self) -> float:
        """Time between two measurements [s]."""
        return PERIOD

    @property
    def t(self) -> float:
        """Time on the rig's clock [s]."""
        return self._t0 + self._steps * TIMESTEP

    @property
    def is_virtual(self) -> bool:
        """True: the wearer of the twin is virtual, too."""
        return True

    def __enter__(self) -> "Twin":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Do nothing: without steps the twin does not move, and it owns no hardware."""

    def read(self) -> JointState:
        """Return the measurement of this period; two calls in one period return the same one."""
        if self._measured is None:
            q, current, q_motor = self._sensors.measure()
            number = self._steps // SUBSTEPS
            self._measured = JointState(self.t, number, q, current, self._no_torque, TorqueSource.CURRENT, q_motor)
        return self._measured

    def write(self, command: Command) -> None:
        """Give the drives a current and advance by one period.

        Raises:
            RigError: The current is not finite.
            TwinDivergedError: A velocity is not finite.
        """
        # A sum of Python numbers, here and below: NumPy's reductions take ten times as long for four numbers.
        if not math.isfinite(sum(command.current.tolist())):
            joints = [joint for joint, i in zip(self.joints, command.current, strict=True) if not np.isfinite(i)]
            raise RigError(
                f"Command {command.sequence} asks {', '.join(joints)} for a current that is not finite; the drives "
                "reject it. The envelope must stop such a command before it is written."
            )
        self._current[:] = command.current
        self._damping[:] = 0.0 if command.damping is None else command.damping
        self._valid_until[0] = command.valid_until
        for muscles, tau in self._muscle_torques:
            tau[:] = muscles.next_torque()
        self._warmth[0] = 1.0 - np.exp(-self.t / WARM_UP_TIME)
        model, data, evaluate = self._scene.model, self._scene.data, self._forces.evaluate
        first_half, second_half = mujoco.mj_step1, mujoco.mj_step2
        for _ in range(SUBSTEPS):
            for pole in self._poles:
                pole.before_forces()
            first_half(model, data)
            evaluate()
            for pole in self._poles:
                pole.after_forces()
            second_half(model, data)
        self.end_native(not math.isfinite(sum(self._velocity.tolist())))

    @cached_property
    def native_period(self) -> NativePeriod | None:
        """Period for a caller in C; None if there is no native code, or in a subclass with a period of its own."""
        halves, forces, sensors = engine_halves(), self._forces.native, self._sensors.native
        if type(self) is not Twin or halves is None or forces is None or sensors is None:
            return None
        memory = self._memory
        return NativePeriod(
            sensors,
            self._sensors.noise,
            self._sensors.noise_now,
            self._sensors.measured,
            forces,
            halves,
            engine_addresses(self._scene.model, self._scene.data),
            SUBSTEPS,
            self._velocity,
            self._current,
            self._damping,
            memory["valid_until"],
            tuple(NativeMuscles(muscles.block, tau) for muscles, tau in self._muscle_torques),
            tuple(pole.native for pole in self._poles),
        )

    @property
    def is_unread(self) -> bool:
        """True if this period has not been measured yet."""
        return self._measured is None

    def begin_native(self) -> tuple[float, int, int, int]:
        """Prepare one period of native code, as `rig.native_period.NativelySimulated` says."""
        row = 0
        for muscles, _ in self._muscle_torques:
            row = muscles.advance()  # the same for both arms
        t = self.t
        self._warmth[0] = 1.0 - np.exp(-t / WARM_UP_TIME)
        return t, self._steps // SUBSTEPS, self._sensors.advance(), row

    def end_native(self, has_diverged: bool) -> None:
        """Note that the machine has advanced by one period.

        Raises:
            RigError: The simulation has diverged.
        """
        self._steps += SUBSTEPS
        self._measured = None
        if has_diverged:
            raise TwinDivergedError(
                f"The twin diverged before {self.t:.3f} s: a velocity is not finite. The cause is usually a command "
                "outside every limit; look at the commands before this time."
            )

    def pass_time(self, seconds: float) -> None:
        """Advance clock and warm-up [s] while nothing moves. All other states stay, commands in force included.

        Raises:
            RigError: The time is negative or not finite.
        """
        if not (math.isfinite(seconds) and seconds >= 0.0):
            raise RigError(f"{seconds} s cannot pass: the time must be finite and not negative. Give such a time.")
        self._t0 += seconds
        pass_clock(self._memory, seconds)
        if self._measured is not None:
            self._measured = self._measured._replace(t=self.t)

    def hang(self, mount: str, mass_kg: float) -> None:
        """Hang a known weight [kg] at a mount; zero removes it.

        Mounts are the names of the machine's mounts, and "calibration" for the first of them; "right_hand" and
        "left_hand" of the wearer, and "hand" for the first of these; and "right_forearm", "left_forearm" and "forearm"
        in the same way, half-way from elbow to wrist.

        Raises:
            RigError: The mount does not exist, the machine has no wearer to hold the weight, or the mass is negative.
        """
        self._scene.hang(mount, mass_kg)

    def slide_cuff(self, name: str, along_m: float) -> None:
        """Move the rest place of a cuff along the limb, away from where it was fastened [m]; for examiners only.

        Raises:
            RigError: The cuff does not exist, or the machine has no wearer.
        """
        self._scene.slide_cuff(name, along_m)

    def fly(self, g: Float[np.ndarray, " 3"]) -> None:
        """Accelerate the room as in an aircraft from now on.

        Args:
            g: Specific force that a scale in the room would show, over Earth's, along the axes of a level base [-]:
                (0, 0, 1) on the ground, zero on a parabola.
        """
        down = self._machine.gravity / np.linalg.norm(self._machine.gravity)
        # A tilted base keeps its tilt in the aircraft.
        lean = np.array([0.0, 0.0, -1.0]) - down
        size = float(np.linalg.norm(self._machine.gravity))
        self._scene.model.opt.gravity = size * (-np.asarray(g) - g[2] * lean)

    @property
    def room_gravity(self) -> float:
        """Gravity in the room relative to Earth's [-]: 1 on the ground, at any support of the arm."""
        return float(np.linalg.norm(self._scene.model.opt.gravity) / np.linalg.norm(self._machine.gravity))

    def turn_motor(self, joint: int, factor: float) -> None:
        """Multiply the torque of a motor by `factor`, the torque in its delay lines included; for examiners only.

        To simulate a motor with another torque constant, scale the current to and from this drive in the same way from
        then on.
        """
        memory, joints = self._memory, len(self._machine.drives.gain)
        self._drive_states()[TAU_MOTOR, joint] *= factor
        memory["commands"][joint] *= factor
        memory["measurements"][joints + joint] *= factor

    def warm_gain(self, celsius: Sequence[float]) -> Joints | None:
        """Return the factors of the motors' torques per current at these temperatures of the windings [°C].

        None if the temperatures change no gain. The twin itself has no windings: simulated drives have.
        """
        drives = self._machine.drives
        if drives.gain_slope is None or drives.gain_at is None or not drives.gain_slope.any():
            return None
        return 1.0 + drives.gain_slope * (np.array(celsius) - drives.gain_at)

    def cuff_wrenches(self) -> Wrenches:
        """Force and moment of each cuff on the arm from force/torque sensors, as in `rig.interface.CuffSensing`."""
        step, wrenches = self._wrenches
        if step != self._steps:
            wrenches = self._cuff_sensors.measure()
            self._wrenches = self._steps, wrenches
        return wrenches

    def put_surroundings(self, is_there: bool) -> None:
        """Add or remove the objects that the hand can touch. They are present at the start."""
        if self._screen is not None:
            self._screen.put(is_there)

    def finger_on_screen(self) -> Float[np.ndarray, " 2"] | None:
        """Finger position on the screen, right and up of its centre [m]; None without finger or screen."""
        return None if self._screen is None else self._screen.finger()

    @cached_property
    def _cuff_sensors(self) -> CuffSensors:
        """Sensors at the cuffs, made at the first use: most machines have none."""
        return CuffSensors(self._machine.cuff_sensors, self._seed, self._scene, self._wearer, self._memory)

    @property
    def truth(self) -> Truth:
        """State behind the measurements, as copies."""
        scene, data = self._scene, self._scene.data
        return Truth(
            machine=self._machine,
            wearer=self._wearer,
            q=data.qpos[scene.exo],
            v=data.qvel[scene.exo],
            q_arm=data.qpos[scene.arm],
            v_arm=data.qvel[scene.arm],
            tau_motor=self._drive_states()[TAU_MOTOR].copy(),
            tau_muscle=self._memory["tau_muscle"] + self.tau_voluntary,
        )

    def motion(self) -> tuple[Joints, Joints]:
        """Return positions [rad] and velocities [rad/s] of the joints as in `truth`, in a tenth of the time."""
        scene, data = self._scene, self._scene.data
        return data.qpos[scene.exo], data.qvel[scene.exo]

    def arm_motion(self) -> tuple[Float[np.ndarray, " arm"], Float[np.ndarray, " arm"]]:
        """Return positions [rad] and velocities [rad/s] of the arms' freedoms as in `truth`."""
        scene, data = self._scene, self._scene.data
        return data.qpos[scene.arm], data.qvel[scene.arm]

    def hand_speed(self) -> float:
        """Return the true speed of the hand of the first arm [m/s]; for examiners."""
        velocity = np.empty(6)
        scene = self._scene
        mujoco.mj_objectVelocity(scene.model, scene.data, mujoco.mjtObj.mjOBJ_BODY, scene.mounts["hand"], velocity, 0)
        return math.hypot(*velocity[3:].tolist())

    def drive_damping(self) -> Joints:
        """Coefficient with which each drive brakes its own motor since the last step (joint,) [N·m·s/rad]."""
        return self._forces.outputs["damping_in_force"].copy()

    def _drive_states(self) -> Float[np.ndarray, "state joint"]:
        """View of the drives' states; a kernel keeps the single column of a one-joint machine as a vector."""
        return self._memory["drives"].reshape(-1, len(self._machine.drives.gain), order="F")

    def _start(self, q: Joints) -> None:
        q_arm, tau = Statics(self._scene, self._wearer, with_passive=True).begin(q)
        memory = self._memory
        memory["start"][0] = self._t0
        drives = self._drive_states()
        # A joint without a motor cannot be held: it moves at once.
        tau = np.where(self._machine.drives.gain != 0.0, tau, 0.0)
        of_gain = np.ones(len(q)) if self._machine.foreign is None else self._machine.foreign.gain_at(q)
        drives[TAU_MOTOR] = tau / of_gain
        drives[THETA] = q + tau / self._machine.drives.gear_stiffness
        drives[OMEGA] = 0.0
        memory["hysteresis"].T[...] = q_arm
        let_soft_tissue_hang(self._scene.data, self._scene.arms)
        for place in self._scene.arms:
            if late_name(place) in memory:
                # A path with inertia has a second column, the speed, which is zero.
                np.atleast_2d(memory[late_name(place)])[:, 0] = self._scene.data.qpos[list(place.shifts)]
        # The delay lines are filled as if the machine had stood still for long. Transposed, a line of one step has the
        # same shape as a longer one.
        tau_asked = drives[TAU_MOTOR].tolist()
        np.atleast_2d(memory["commands"].T)[:] = [*tau_asked, *np.zeros(len(q)), math.inf]
        np.atleast_2d(memory["measurements"].T)[:] = [*q, *tau_asked, *drives[THETA]]
