"""Assembly of a person and a machine, and the check that the cuffs hold all freedoms of the arm."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.errors import ModelError
from exograv.sobol import sobol_points

from .anthropometry import Body
from .arm import build_arm
from .assembly import Assembly, adjusted, read_exoskeleton
from .description import RigDescription
from .loops import LoopSolver

STIFFNESS_RATIO_MIN = (
    1e-6  # weakest over strongest freedom: a smaller stiffness is a rounding error and does not hold the arm
)
POSTURES = 16  # of the task workspace, in addition to the donning posture


def assemble(description: RigDescription, body: Body) -> Assembly:
    """Assemble the machine with a person of these body measures, and check the support of the arm.

    Raises:
        ModelError: The machine's files disagree, it does not fit the person, or its cuffs leave a freedom of the arm
            unsupported.
    """
    assembly = put_together(description, body)
    refuse_unsupported(assembly)
    return assembly


def put_together(description: RigDescription, body: Body) -> Assembly:
    """Assemble machine and person without the check of the cuffs; use it only to examine the cuffs.

    Raises:
        ModelError: The machine's files disagree, or it does not fit the person.
    """
    arm = build_arm(body, *description.arm_sides, kind=description.settings.wearer.arm)
    exo = adjusted(read_exoskeleton(description), description, arm.lengths)
    return Assembly(description, exo, arm, tuple(description.settings.cuffs))


def sample_postures(description: RigDescription, count: int) -> Float[np.ndarray, "posture joint"]:
    """Return the donning posture, then `count` postures spread over the task workspace [rad]."""
    lower, upper = description.workspace
    return np.vstack([description.donning_posture, lower + sobol_points(len(lower), count) * (upper - lower)])


@dataclass(frozen=True)
class Support:
    """Support of the arm by the cuffs, in the postures of `sample_postures`."""

    rank: int
    """Smallest number of arm freedoms that the cuffs hold in any posture.

    If the arm has more freedoms, its weight is only partly carried.
    """

    unsupported: dict[str, int]
    """Freedoms that no cuff holds, with the number of such postures."""

    softest: str
    """Freedom with the smallest stiffness."""

    softest_Nm_per_rad: float
    """Smallest stiffness, in the worst posture [N·m/rad]."""


def support(assembly: Assembly, solver: LoopSolver | None = None) -> Support:
    """Compute the support of the arm by the cuffs; an existing `solver` of these loops is reused."""
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
    """Freedoms of the arm that no cuff holds, with the number of such postures in the sample."""
    return support(assembly).unsupported


def refuse_unsupported(assembly: Assembly) -> None:
    """Refuse cuffs that leave a freedom unsupported: the motors cannot make this freedom weightless.

    Raises:
        ModelError: A freedom is unsupported; the message names it.
    """
    found = unsupported_freedoms(assembly)
    if found:
        names = ", ".join(f"{name} (in {count} of {POSTURES + 1} postures)" for name, count in found.items())
        cuffs = ", ".join(cuff.name for cuff in assembly.cuffs)
        raise ModelError(
            f"The cuffs of {assembly.description.name} ({cuffs}) leave the arm free in: {names}. "
            "Its weight there cannot be carried. Add a cuff or give one stiffness in that direction in rig.toml."
        )
