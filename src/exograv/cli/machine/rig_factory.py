"""The choice between a real machine and the twin.

Only here is the twin loaded for a command that may also run on drives: a computer with a real machine needs no MuJoCo.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from exograv.live.simulated_wearer import SimulatedWearer
    from exograv.model.description import Side


def simulated_wearer(
    is_simulated: bool, rig: str, side: "Side | None", level: int, seed: int
) -> "SimulatedWearer | None":
    """The wearer of simulated drives, drawn as the process of the drives draws it; None for a real machine."""
    if not is_simulated:
        return None
    from exograv.laboratory.truth_score import ScoredWearer
    from exograv.laboratory.virtual_laboratory import draw_laboratory

    return ScoredWearer(draw_laboratory(rig, side, level, seed))
