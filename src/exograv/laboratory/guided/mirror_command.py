"""Complete runs of mirroring: prepare both arms, let one lead, and report how well the other followed."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exograv.laboratory.preparation import prepare
from exograv.laboratory.virtual_laboratory import driven_laboratory
from exograv.loop.pilot import Progress
from exograv.loop.tick_sample import ObservedMotion
from exograv.procedures.rehabilitation.guided.floating_arm import GuardRecord
from exograv.procedures.rehabilitation.guided.mirror import MEETS_S, MirrorFigures, mirror
from exograv.procedures.rehabilitation.guided.mirror_following import Following, followed
from exograv.procedures.rehabilitation.guided.mirror_guide import MirrorGuide
from exograv.procedures.rehabilitation.guided.mirror_map import MirrorMap
from exograv.procedures.rehabilitation.guided.options import MirrorOptions
from exograv.procedures.rehabilitation.guided.repeat import SETTLE_S
from exograv.results import MERGED, json_value

from .guided_command import GuidedResult, Preparing, floating_twin, guided_result, writer_of
from .therapist_and_wearer import Holding, Therapist, drawn_movement, of_joints

HOLDS_AFTER_S = 5.0
"""Time from the first motion of the leading arm until a person who overrules holds the following arm [s]."""


@dataclass(frozen=True)
class FollowedFigures:
    """Session with one arm that follows the other."""

    session: MirrorFigures = field(metadata=MERGED)
    following: Following = field(metadata=MERGED)
    guard: GuardRecord


def run_mirror(
    options: MirrorOptions, folder: Path, progress: Progress, preparing: Preparing = prepare
) -> GuidedResult[FollowedFigures]:
    """Let one arm lead by simulated muscles, while the other arm follows its mirror image.

    Raises:
        ConfigError: The machine does not have two mirrored arms, or an option is not valid.
        RigError: The envelope stopped the run.
    """
    laboratory = driven_laboratory(options.rig, options.side, options.level, options.seed, options.world)
    description, assembly = laboratory.description, laboratory.assembly()
    which = MirrorMap.of(description, assembly.exo, options.lead)
    recorded = folder / "mirror.mcap"
    with writer_of(recorded, options, laboratory, "exograv run mirror") as recording:
        known = preparing(laboratory, options.seed, progress)
        arms = floating_twin(laboratory, known, options.seed, recording, progress)
        twin = arms.rig
        begins_s = twin.t + SETTLE_S + MEETS_S
        holding = Holding(twin, begins_s + HOLDS_AFTER_S, np.inf, _slice(which.follow))
        leader: list[Therapist] = []
        at: list[np.ndarray] = []

        def act() -> bool:
            if twin.t < begins_s:
                return False
            if not leader:
                one = drawn_movement(description, options.seed, twin.truth.q, twin.period_s)
                leader.append(Therapist(twin, of_joints(one, which.lead.tolist()), _slice(which.lead)))
            leader[0].act()
            if options.person == "overrules":
                holding.act()
            return options.person == "lets-go" and twin.t > begins_s + HOLDS_AFTER_S

        def watch(guide: MirrorGuide, _moment: ObservedMotion) -> None:
            if leader and not guide.has_let_go:
                q = twin.truth.q
                at.append(np.concatenate([which.mirrored(q)[which.follow], q[which.follow]]))

        done = mirror(arms, options.lead, options.seconds, act, watch)
        found = FollowedFigures(done.figures, followed(np.array(at), twin.period_s), arms.guard_record)
        recording.write("/result", twin.t, {"task": json_value(found), "rig": options.rig})
    return guided_result(found, options, laboratory, recorded, options.lead)


def _slice(joints: np.ndarray) -> slice:
    """Slice of one arm's joints, which are adjacent."""
    return slice(int(joints[0]), int(joints[-1]) + 1)
