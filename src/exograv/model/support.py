"""Can these cuffs carry this arm? The person is put into the machine, or refused, with the freedom nothing holds."""

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
    arm = build_arm(body, *description.arm_sides, kind=description.settings.wearer.arm)
    exo = adjusted(read_exoskeleton(description), description, arm.lengths)
    assembly = Assembly(description, exo, arm, tuple(description.settings.cuffs))
    refuse_unsupported(assembly)
    return assembly


def sample_postures(description: RigDescription, count: int) -> Float[np.ndarray, "posture joint"]:
    """The donning posture, then `count` postures spread over the task workspace [rad]."""
    from scipy.stats import qmc  # 0.3 s that no tick has to wait for

    lower, upper = description.workspace
    points = qmc.Sobol(len(lower), scramble=False).random(count)
    return np.vstack([description.donning_posture, lower + points * (upper - lower)])


def unsupported_freedoms(assembly: Assembly) -> dict[str, int]:
    """Freedoms of the arm that no cuff holds, with the number of sampled postures where that is so."""
    solver = LoopSolver(assembly)
    found: dict[str, int] = {}
    for y in sample_postures(assembly.description, POSTURES):
        z, _ = solver.solve(y)
        stiffness, directions = np.linalg.eigh(solver.gauss_newton_hessian(y, z))
        for value, direction in zip(stiffness, directions.T, strict=True):
            if value < STIFFNESS_RATIO_MIN * stiffness[-1]:
                name = assembly.arm.freedoms[int(np.argmax(np.abs(direction)))]
                found[name] = found.get(name, 0) + 1
    return found


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
