"""Six-axis force/torque sensors between the machine and its cuffs: what few machines have, and two methods need.

Their delay is left out: who reads them averages over seconds. So is the weight of the cuffs' shells, which is tared.
"""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.rig.twin.disturbances.streams import stream
from exograv.rig.twin.machine.machine import TrueCuffSensors
from exograv.rig.twin.wearer.wearer import Wearer

from .cuffs import Kinematics, wrenches_at_cuffs
from .scene import Scene

Wrenches = Float[np.ndarray, "cuff 6"]


class CuffSensors:
    """Of all cuffs of one scene, on MuJoCo's own memory; it only reads there."""

    def __init__(self, truth: TrueCuffSensors, seed: int, scene: Scene, wearer: Wearer | None) -> None:
        """`seed` draws the noise; without a wearer nothing pulls at the cuffs."""
        self._truth = truth
        self._stream = stream(seed, "run", "cuff_noise")
        self._kernel = None if wearer is None else kernel.compile(*_true_wrenches(scene, wearer))

    def measure(self) -> Wrenches:
        """Force and moment that each cuff exerts on the arm, as measured [N, N·m].

        About the origin of the machine's cuff frame, in its axes.
        """
        truth = self._truth
        noise = truth.noise * self._stream.standard_normal(truth.bias.shape)
        true = np.zeros_like(truth.bias) if self._kernel is None else self._kernel()["wrenches"].T
        return truth.gain * true + truth.bias + noise


def _true_wrenches(scene: Scene, wearer: Wearer) -> tuple[ca.Function, dict[str, np.ndarray]]:
    """The function, and the memory that it works on."""
    kinematics = Kinematics.of(scene.model.nbody)
    symbols = vars(kinematics)
    wrenches = wrenches_at_cuffs(scene, wearer.cuffs, kinematics)
    function = ca.Function("twin_cuff_sensors", list(symbols.values()), [wrenches], list(symbols), ["wrenches"])
    return function, {name: getattr(scene.data, name) for name in symbols}
