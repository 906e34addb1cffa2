"""Complete runs of mirroring: prepare both arms, let one lead, and report how well the other followed."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.laboratory.preparation import prepare
from exograv.laboratory.virtual_laboratory import driven_laboratory
from exograv.loop.pilot import Progress
from exograv.motion import Trajectory
from exograv.procedures.rehabilitation.guided.floating_arm import GuardRecord
from exograv.procedures.rehabilitation.guided.mirror import MirrorFigures, mirror
from exograv.procedures.rehabilitation.guided.mirror_guide import MirrorGuide
from exograv.procedures.rehabilitation.guided.mirror_map import MirrorMap
from exograv.procedures.rehabilitation.guided.options import MirrorOptions
from exograv.procedures.rehabilitation.guided.repeat import SETTLE_S
from exograv.results import MERGED, json_value

from .guided_command import GuidedResult, Preparing, floating_twin, guided_result, writer_of
from .therapist_and_wearer import Holding, Therapist, drawn_movement

MEETS_S = 3.0
"""Time from the coupling of the following arm until the leading arm moves and the comparison starts [s]."""

HOLDS_AFTER_S = 5.0
"""Time after that at which a person who overrules holds the following arm [s]."""

LATE_MAX_S = 1.0
"""Largest delay of the following arm in the search for its delay [s]."""


@dataclass(frozen=True)
class Following:
    """Distance of the following arm from the mirror image of the leading one."""

    tracking_rms_deg: np.ndarray
    late_s: float | None
    """Delay at which the distance is smallest; None after too short a session."""
    late_rms_deg: np.ndarray
    """Distance at that delay."""


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
                leader.append(Therapist(twin, _columns(one, which), _slice(which.lead)))
            leader[0].act()
            if options.person == "overrules":
                holding.act()
            return options.person == "lets-go" and twin.t > begins_s + HOLDS_AFTER_S

        def watch(guide: MirrorGuide) -> None:
            if leader and not guide.has_let_go:
                q = twin.truth.q
                at.append(np.concatenate([which.mirrored(q)[which.follow], q[which.follow]]))

        done = mirror(arms, options.lead, options.seconds, act, watch)
        found = FollowedFigures(done.figures, followed(np.array(at), twin.period_s), arms.guard_record)
        recording.write("/result", twin.t, {"task": json_value(found), "rig": options.rig})
    return guided_result(found, options, laboratory, recorded, options.lead)


def followed(at: Float[np.ndarray, "tick both"], dt: float) -> Following:
    """Distance of the following arm from the mirror image, without delay and with the best delay.

    Args:
        at: True posture of the leading arm, mirrored, then that of the following arm [rad].
        dt: Period [s].
    """
    if len(at) < 2.0 * LATE_MAX_S / dt:
        return Following(np.zeros(0), None, np.zeros(0))
    image, own = np.split(np.rad2deg(at), 2, axis=1)

    def rms(late: int) -> Float[np.ndarray, " joint"]:
        return np.sqrt(np.mean((image[: len(image) - late] - own[late:]) ** 2, axis=0))

    lates = range(0, round(LATE_MAX_S / dt), max(round(0.01 / dt), 1))
    best = min(lates, key=lambda late: float((rms(late) ** 2).sum()))
    return Following(rms(0).round(3), round(best * dt, 3), rms(best).round(3))


def _slice(joints: np.ndarray) -> slice:
    """Slice of one arm's joints, which are adjacent."""
    return slice(int(joints[0]), int(joints[-1]) + 1)


def _columns(movement: Trajectory, which: MirrorMap) -> Trajectory:
    q, v, a = (table[:, which.lead] for table in (movement.q, movement.v, movement.a))
    return Trajectory(q, v, a, movement.dt)
