"""Can these cuffs carry this arm? The person is put into the machine, or refused, with the freedom nothing holds."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.errors import ModelError

from .anthropometry import Body
from .arm import build_arm
from .assembly import Assembly, adjusted, read_exoskeleton
from .description import RigDescription
from .loops import LoopSolver

STIFFNESS_RATIO_MIN = 1e-6  # weakest over strongest freedom: below it rounding, not a cuff, holds the arm
POSTURES = 16  # of the task workspace, beside the donning posture


def assemble(description: RigDescription, body: Body) -> Assembly:
    """Put the person of these measures into the machine.

    Raises:
        ModelError: The machine's files disagree, it does not fit the person, or its cuffs leave a freedom of the arm
            unsupported.
    """
    assembly = put_together(description, body)
    refuse_unsupported(assembly)
    return assembly


def put_together(description: RigDescription, body: Body) -> Assembly:
    """The same, whatever the cuffs hold: only to find out what they do.

    Raises:
        ModelError: The machine's files disagree, or it does not fit the person.
    """
    arm = build_arm(body, *description.arm_sides, kind=description.settings.wearer.arm)
    exo = adjusted(read_exoskeleton(description), description, arm.lengths)
    return Assembly(description, exo, arm, tuple(description.settings.cuffs))


def sample_postures(description: RigDescription, count: int) -> Float[np.ndarray, "posture joint"]:
    """The donning posture, then `count` postures spread over the task workspace [rad]."""
    from scipy.stats import qmc  # 0.3 s that no tick has to wait for

    lower, upper = description.workspace
    points = qmc.Sobol(len(lower), scramble=False).random(count)
    return np.vstack([description.donning_posture, lower + points * (upper - lower)])


@dataclass(frozen=True)
class Support:
    """What the cuffs hold of the arm, in the postures of `sample_postures`."""

    rank: int
    """Freedoms that they hold in every posture; where it is less than the arm has, some weight cannot be carried."""

    unsupported: dict[str, int]
    """Freedoms that no cuff holds, with the number of postures where that is so."""

    softest: str
    """The freedom that is held most softly."""

    softest_Nm_per_rad: float
    """With which stiffness, in the worst posture [N·m/rad]."""


def support(assembly: Assembly, solver: LoopSolver | None = None) -> Support:
    """How the cuffs hold the arm; with the solver of these loops, if there is one already."""
    solver, freedoms = solver or LoopSolver(assembly), assembly.arm.freedoms
    unsupported: dict[str, int] = {}
    rank, softest = len(freedoms), (np.inf, "")
    for y in sample_postures(assembly.description, POSTURES):
        z, _ = solver.solve(y)
        stiffness, directions = np.linalg.eigh(solver.gauss_newton_hessian(y, z))
        names = [freedoms[i] for i in np.argmax(np.abs(directions), axis=0)]
        free = stiffness <= STIFFNESS_RATIO_MIN * stiffness[-1]
        for name in (name for name, is_free in zip(names, free, strict=True) if is_free):
            unsupported[name] = unsupported.get(name, 0) + 1
        rank = min(rank, int(np.count_nonzero(~free)))
        softest = min(softest, (float(stiffness[0]), names[0]))
    return Support(rank, unsupported, softest[1], softest[0])


def unsupported_freedoms(assembly: Assembly) -> dict[str, int]:
    """Freedoms of the arm that no cuff holds, with the number of sampled postures where that is so."""
    return support(assembly).unsupported


def refuse_unsupported(assembly: Assembly) -> None:
    """Refuse cuffs of too low a rank: the motors could not make that freedom weightless, whatever they do.

    Raises:
        ModelError: Names the freedoms.
    """
    found = unsupported_freedoms(assembly)
    if found:
        names = ", ".join(f"{name} (in {count} of {POSTURES + 1} postures)" for name, count in found.items())
        cuffs = ", ".join(cuff.name for cuff in assembly.cuffs)
        raise ModelError(
            f"The cuffs of {assembly.description.name} ({cuffs}) leave the arm free in: {names}. "
            "Its weight there cannot be carried. Add a cuff or give one stiffness in that direction in rig.toml."
        )
