"""Six-axis force/torque sensors between the machine and its cuffs. Few machines have them, and two methods need them.

Their dead time is not modelled, because their users average over seconds. The weight of the cuffs' shells is not
modelled either, because it is tared.
"""

from collections.abc import Mapping
from types import MappingProxyType

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.rig.twin.disturbances.streams import stream
from exograv.rig.twin.machine.machine import TrueCuffSensors
from exograv.rig.twin.wearer.wearer import Wearer

from .cuffs import CuffStates, Kinematics, wrenches_at_cuffs
from .forces import LAGGED, SLIPPED
from .scene import Scene

Wrenches = Float[np.ndarray, "cuff 6"]


class CuffSensors:
    """Sensors of all cuffs of one scene. They read MuJoCo's own memory and never write it."""

    def __init__(
        self,
        truth: TrueCuffSensors,
        seed: int,
        scene: Scene,
        wearer: Wearer | None,
        states: Mapping[str, np.ndarray] = MappingProxyType({}),
    ) -> None:
        """Compile the true wrenches. `seed` draws the noise; without a wearer all true wrenches are zero.

        `states` is the memory of the twin by name; `SLIPPED` and `LAGGED` belong to the cuffs of foreign worlds.
        """
        self._truth = truth
        self._stream = stream(seed, "run", "cuff_noise")
        self._kernel = None if wearer is None else kernel.compile(*_true_wrenches(scene, wearer, states))

    def measure(self) -> Wrenches:
        """Measure force and moment of each cuff on the arm [N, N·m].

        The moment is about the origin of the machine's cuff frame, and both are in its axes.
        """
        truth = self._truth
        noise = truth.noise * self._stream.standard_normal(truth.bias.shape)
        true = np.zeros_like(truth.bias) if self._kernel is None else self._kernel()["wrenches"].T
        return truth.gain * true + truth.bias + noise


def _true_wrenches(
    scene: Scene, wearer: Wearer, states: Mapping[str, np.ndarray]
) -> tuple[ca.Function, dict[str, np.ndarray]]:
    """Return the function that computes the true wrenches, and the memory that it reads."""
    kinematics = Kinematics.of(scene.model.nbody)
    symbols = dict(vars(kinematics))
    memory = {name: getattr(scene.data, name) for name in symbols}
    for name, size in ((SLIPPED, (len(scene.cuffs),)), (LAGGED, (3, len(scene.cuffs)))):
        if name in states:
            symbols[name] = ca.SX.sym(name, *size)
            memory[name] = states[name]
    carried = CuffStates(symbols.get(SLIPPED), symbols.get(LAGGED))
    wrenches = wrenches_at_cuffs(scene, wearer.cuffs, kinematics, carried)
    return ca.Function("twin_cuff_sensors", list(symbols.values()), [wrenches], list(symbols), ["wrenches"]), memory
