"""Mirror therapy on drives (`run mirror`): live identification of both arms, then one arm follows the other."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exograv.live.live_guided import LiveGuided
from exograv.live.live_moved import LiveMoved
from exograv.live.options import ReturningPerson
from exograv.loop.pilot import Progress
from exograv.loop.tick_sample import ObservedMotion
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import ArmSide, load_rig
from exograv.procedures.bring_up.hands import BenchHands, Hands
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.procedures.rehabilitation.guided.mirror import MEETS_S, MirrorFigures, mirror
from exograv.procedures.rehabilitation.guided.mirror_following import Following, followed
from exograv.procedures.rehabilitation.guided.mirror_guide import MirrorGuide
from exograv.procedures.rehabilitation.guided.mirror_map import MirrorMap
from exograv.procedures.rehabilitation.guided.options import MirrorOptions
from exograv.results import MERGED, json_value

from .arm_files import stored_arm
from .connection import Say
from .float_command import Procedure, fly_on_drives
from .guided import AROUND_S, GuidedFlight, released
from .support_level import live_options

LEAD = "Move the {} arm now; the other arm follows its mirror image."
"""Instruction to the person."""


@dataclass(frozen=True)
class MirrorOnDrives:
    """Result of `exograv run mirror` on drives."""

    session: MirrorFigures = field(metadata=MERGED)
    following: Following = field(metadata=MERGED)
    """Distance of the arms by the encoders of the machine."""
    lead: ArmSide
    flight: GuidedFlight = field(metadata=MERGED)


def run_mirror_on_drives(
    options: MirrorOptions,
    person: ReturningPerson,
    folder: Path,
    progress: Progress,
    say: Say,
    wearer: SimulatedWearer | None = None,
) -> MirrorOnDrives:
    """Identify both arms of a person in a machine on drives, or check stored ones, and guide one after the other.

    Raises:
        ConfigError: The machine does not have two mirrored arms, or a file or an option cannot be used.
        ExogravError: The machine is not ready.
        RigError: The machine was stopped before the end.
    """
    description = load_rig(options.rig, options.side)
    which = MirrorMap.of(description, read_exoskeleton(description), options.lead)
    files = stored_arm(person, options, folder)
    done: list[tuple[MirrorFigures, Following]] = []

    def move(machine: LiveMoved, hands: Hands, _shown: Progress) -> None:
        arms, at = LiveGuided(machine), list[np.ndarray]()
        is_released = released(options, machine, say)
        begins_s, is_told = np.inf, False

        def act() -> bool:
            nonlocal is_told
            if not is_told and machine.floating.t >= begins_s:
                is_told = True
                if isinstance(hands, BenchHands):
                    hands.tell(f"lead {options.lead}")
                else:
                    say(LEAD.format(options.lead))
            return is_released()

        def watch(guide: MirrorGuide, moment: ObservedMotion) -> None:
            nonlocal begins_s
            begins_s = min(begins_s, machine.floating.t + MEETS_S)  # from the first tick of the guide on
            if is_told and not guide.has_let_go:
                at.append(np.concatenate([which.mirrored(moment.q)[which.follow], moment.q[which.follow]]))

        found = mirror(arms, options.lead, options.seconds, act, watch)
        rows = np.array(at).reshape(len(at), 2 * len(which.follow))
        done.append((found.figures, followed(rows, arms.period_s)))
        task = json_value({"session": found.figures, "following": done[-1][1]})
        machine.floating.write("/result", machine.floating.t, {"task": task, "rig": options.rig})

    procedure = Procedure("run mirror", files=files, recording_name="mirror.mcap", moves=move, leading=options.lead)
    live = live_options(options, options.identify_s, AROUND_S + options.seconds)
    run = fly_on_drives(live, person, folder, progress, say, wearer, procedure)
    session, following = done[-1]
    return MirrorOnDrives(session, following, options.lead, GuidedFlight.of(description, run, options.simulate))
