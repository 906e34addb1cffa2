"""Simulated drives for `exograv dev drive-sim`: the twin as a machine that is only reachable over its bus."""

import contextlib
import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from exograv.errors import ConfigError, RigError
from exograv.laboratory.attentive_wearer import AttentiveHold
from exograv.laboratory.cooperative_wearer import ArmHold
from exograv.laboratory.dummy_arm import with_dummy
from exograv.laboratory.guided.therapist_and_wearer import Therapist, drawn_movement, of_joints
from exograv.laboratory.options import DriveSimOptions
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory, machine_of, with_twin
from exograv.loop.machine_limits import refuse_motorless
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.motion import Trajectory
from exograv.options import Bus
from exograv.procedures.acceptance.dummy import load_dummy
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.procedures.calibration.breakaway_test import starting_posture
from exograv.rig.drives.settings import Drives, load_drives
from exograv.rig.drives.simulated.bench import SimulatedBench
from exograv.rig.drives.simulated.devices import SimulatedDevices
from exograv.rig.drives.simulated.opening import simulated_devices
from exograv.rig.drives.simulated.plant import Plant, Wiring
from exograv.rig.twin import Disturbances, Twin
from exograv.runtime.clock.realtime import GUARD_PRIORITY, realtime
from exograv.safety.modes import RAMP_IN_S, REST_BEFORE_RAMP_S, Mode
from exograv.storage.twin_file import read_twin
from exograv.task.protocol import load_protocol

from .weak_wearer import WeakWearerBehindDrives
from .wearer_behind_drives import WearerBehindDrives

Say = Callable[[str], None]
Hear = Callable[[str], None]

DRIVES_PRIORITY = GUARD_PRIORITY + 10
"""Priority of simulated drives in real time. Real ones have a computer of their own: no other program delays them."""


def run_drive_sim(
    options: DriveSimOptions,
    folder: Path,
    say: Say,
    examine: Callable[[SimulatedDevices], object] = lambda _: None,
) -> None:
    """Serve until the input `quit`, or Ctrl-C; `examine` gets the drives before the first step.

    Raises:
        ConfigError: An option or a file is not valid.
        RigError: The bus is not available.
    """
    description = load_rig(options.rig, options.side)
    refuse_motorless(description)
    has_motor_encoders = options.twin == "drawn" or read_twin(description).has_motor_encoders
    file = options.drives or written(folder / "drive_sim", description, options.bus, has_motor_encoders)
    drives = load_drives(file, description)
    wiring = _wiring(options, drives.joints)
    make = front_end(options.bus, drives)
    wearer = _virtual_participant(options)
    if wearer is not None:
        plant = _pointing(wearer, drives, wiring)
    else:
        of_person = _weak if options.person == "weak" else _plant
        plant = of_person(options, description, drives, wiring)
    device = make(plant, drives, lock_step=options.lock_step, say=say)
    bench = SimulatedBench(drives.joints, plant, device, say, options.ends_with_input)
    _hear_keyboard(bench, options.lock_step)
    examine(device)
    say(_greeting(options, drives, device, file))
    is_over = bench.obey
    with contextlib.ExitStack() as stack:
        if wearer is not None:
            say(f"The virtual participant listens for the session at port {wearer.port}.")
            stack.callback(wearer.close)
            is_over = _welcoming(wearer, bench)
        stack.enter_context(device)
        stack.enter_context(_punctual(options.lock_step))
        device.run(is_over)


def _hear_keyboard(bench: SimulatedBench, is_lock_step: bool) -> None:
    """Let the bench read standard input: in real time between two steps, otherwise by a thread."""
    if not is_lock_step and sys.platform.startswith("linux"):
        with contextlib.suppress(OSError):  # Input that is no file has no descriptor.
            bench.watch(sys.stdin.fileno())
            return
    bench.listen(sys.stdin)


def _punctual(lock_step: bool) -> contextlib.AbstractContextManager[object]:
    """Take real-time priority on another processor than the loop's: a real drive does not wait for other programs."""
    if lock_step or not sys.platform.startswith("linux"):
        return contextlib.nullcontext()
    return realtime(min(os.sched_getaffinity(0)), DRIVES_PRIORITY)


def _greeting(options: DriveSimOptions, drives: Drives, device: SimulatedDevices, file: Path) -> str:
    who = "with its wearer" if options.worn else "empty"
    who = who if options.dummy is None else "with a dummy arm"
    clock = "each measurement is a step" if options.lock_step else "real time"
    return (
        f"Simulated drives of {drives.settings.rig} ({', '.join(drives.joints)}), {who}, disturbance level "
        f"{options.level}, seed {options.seed}, {clock}; serial '{drives.settings.serial}'. Reached at "
        f"{device.where}, as in {file}. Type help for the commands of the bench; press Ctrl-C to end."
    )


def front_end(bus: Bus, drives: Drives) -> Callable[..., SimulatedDevices]:
    """Return a function that makes simulated drives of a plant on this bus.

    Raises:
        ConfigError: The drives are on another bus, or a package is missing.
    """
    if getattr(drives.settings, bus) is None:
        raise ConfigError(f"--drives has no [{bus}] bus. Give the file of that bus, or the bus of the file.")
    return simulated_devices(bus)


def _plant(options: DriveSimOptions, description: RigDescription, drives: Drives, wiring: dict[str, Wiring]) -> Plant:
    if not options.worn:
        machine = machine_of(
            description, Disturbances.at_level(options.level, options.world), options.seed, options.twin
        )
        twin = Twin(description, machine, None, options.seed, starting_posture(read_exoskeleton(description)))
        return Plant(twin, drives, wiring)
    laboratory = _twin_of(
        options, draw_laboratory(options.rig, options.side, options.level, options.seed, world=options.world)
    )
    if options.dummy is not None:
        laboratory = with_dummy(laboratory, load_dummy(options.dummy), options.seed)
    twin = laboratory.twin(options.seed)
    plant = Plant(twin, drives, wiring)
    hold, plant.hear = _relaxed(plant, twin, laboratory)
    plant.before_step, plant.therapist = _with_therapist(hold, twin, description, options.seed)
    return plant


def _with_therapist(
    hold: Callable[[], None], twin: Twin, description: RigDescription, seed: int
) -> tuple[Callable[[], None], Callable[[str | None], None]]:
    """Return the acts of wearer and therapist in each step, and the function with which the therapist begins."""
    therapist: list[Therapist] = []

    def act() -> None:
        hold()
        if therapist:
            therapist[0].act()

    def begin(side: str | None) -> None:
        movement = drawn_movement(description, seed, twin.truth.q, twin.period_s)
        therapist[:] = [Therapist(twin, movement) if side is None else _of_one_arm(twin, movement, description, side)]

    return act, begin


def _of_one_arm(twin: Twin, movement: Trajectory, description: RigDescription, side: str) -> Therapist:
    """Return a therapist who moves one of two arms.

    Raises:
        RigError: The machine has no such arm.
    """
    if len(description.arm_sides) < 2 or side not in description.arm_sides:
        raise RigError(
            f"'lead {side}' moves one of two arms. Arms of this machine: {', '.join(description.arm_sides)}."
        )
    own = [k for k, name in enumerate(description.joints) if name.startswith(f"{side}_")]
    return Therapist(twin, of_joints(movement, own), slice(own[0], own[-1] + 1))


def _relaxed(plant: Plant, twin: Twin, laboratory: VirtualLaboratory) -> tuple[Callable[[], None], Hear]:
    """Return the acts of a wearer who holds the arm until the machine carries it: in each step, and at a new mode."""
    own = laboratory.own_arm()
    grip, attentive = ArmHold(twin, own), AttentiveHold(twin, own)
    is_told = is_attentive = False

    def hear(mode_name: str) -> None:
        """Let the wearer follow the mode that the machine announces, instead of a fixed time."""
        nonlocal is_attentive
        is_attentive = True
        attentive.hear(mode_name)

    def hold() -> None:
        nonlocal is_told
        if is_attentive:
            attentive.act()
            return
        if not is_told and all(drive.is_enabled for drive in plant.each):
            is_told = True
            grip.give_over(plant.now + REST_BEFORE_RAMP_S, RAMP_IN_S)
        grip.act()

    return hold, _checked(hear)


def _weak(options: DriveSimOptions, description: RigDescription, drives: Drives, wiring: dict[str, Wiring]) -> Plant:
    """Return the plant of a weak person who follows instructions at the bench."""
    laboratory = draw_laboratory(options.rig, options.side, options.level, options.seed, world=options.world)
    wearer = WeakWearerBehindDrives(_twin_of(options, laboratory), options)
    plant = Plant(wearer.twin, drives, wiring)
    wearer.hold, plant.hear = _relaxed(plant, wearer.twin, wearer.laboratory)
    plant.before_step, plant.person = wearer.act, wearer
    return plant


def _checked(hear: Hear) -> Hear:
    """Return the function that passes on the names of modes only, so that the wearer stays as before a wrong one."""

    def checked(mode_name: str) -> None:
        if mode_name.upper() not in Mode.__members__:
            raise RigError(f"No mode '{mode_name}'. The modes are {', '.join(mode.name.lower() for mode in Mode)}.")
        hear(mode_name)

    return checked


def _virtual_participant(options: DriveSimOptions) -> WearerBehindDrives | None:
    """Draw the participant who points; None for another wearer.

    Raises:
        ConfigError: The machine is empty, or the protocol cannot be read.
        RigError: Another process listens at the port of the line.
    """
    if options.person != "relaxed" and not options.worn:
        raise ConfigError(f"--person is {options.person}, but the machine is empty. Add --worn.")
    if options.person != "virtual":
        return None
    laboratory = draw_laboratory(
        options.rig, options.side, options.level, options.seed, donning=options.donning, world=options.world
    )
    laboratory = _twin_of(options, laboratory)
    protocol = load_protocol(options.protocol).settings
    return WearerBehindDrives(laboratory, protocol, options)


def _twin_of(options: DriveSimOptions, laboratory: VirtualLaboratory) -> VirtualLaboratory:
    return with_twin(laboratory, options.twin, Disturbances.at_level(options.level, options.world), options.seed)


def _welcoming(wearer: WearerBehindDrives, bench: SimulatedBench) -> Callable[[], bool]:
    """Return the bench's function of each step, with a look for a session that has connected."""

    def is_over() -> bool:
        wearer.look()
        return bench.obey()

    return is_over


def _pointing(wearer: WearerBehindDrives, drives: Drives, wiring: dict[str, Wiring]) -> Plant:
    """Return the plant of a participant who points."""
    plant = Plant(wearer.twin, drives, wiring)
    plant.before_step, plant.watch, plant.hear = wearer.act, wearer.feel, _checked(wearer.hear)
    return plant


def _wiring(options: DriveSimOptions, joints: tuple[str, ...]) -> dict[str, Wiring]:
    factors = dict(_factor(text) for text in options.wrong_scale)
    named = {*options.wrong_sign, *options.wrong_encoder, *factors}
    if unknown := sorted(named - set(joints)):
        raise ConfigError(f"No joint {', '.join(unknown)} for wrong wiring. The joints are {', '.join(joints)}.")
    return {
        joint: Wiring(
            factors.get(joint, 1.0) * (-1.0 if joint in options.wrong_sign else 1.0),
            -1.0 if joint in options.wrong_encoder else 1.0,
        )
        for joint in named
    }


def _factor(text: str) -> tuple[str, float]:
    joint, _, factor = text.partition(":")
    try:
        value = float(factor)
    except ValueError:
        value = np.nan
    if not 0.0 < value < 100.0:
        raise ConfigError(f"--wrong-scale is '{text}'; give JOINT:FACTOR with a factor above 0, such as elbow:0.5.")
    return joint, value
