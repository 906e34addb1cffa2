"""Scores the controller on the twin's truth, beside the run and never into it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.control.tick import Mode, Tick
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import FIT_OF_ARM, Parameters
from exograv.model.assembly import Assembly
from exograv.model.loops import LoopSolver
from exograv.rig.twin import Examiner
from exograv.rig.twin.examiner import rms

from .virtual import VirtualLaboratory

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class Score:
    """RMS over the held-out postures, per joint [N·m]."""

    total: Joints
    arm: Joints


class Examination:
    """The controller's side of every held-out posture, and the twin's."""

    def __init__(self, laboratory: VirtualLaboratory, assembly: Assembly, machine: CalibratedMachine):
        self._examiner = Examiner(laboratory.description, laboratory.machine, laboratory.wearer)
        self._tick = Tick(assembly, machine)
        self._current = machine.actuators.current
        self._solver = LoopSolver(assembly)
        self._z: dict[bytes, np.ndarray] = {}

    def score(self, x: Parameters, payload_kg: float = 0.0) -> Score:
        """What is left over with these parameters in the level-0 controller, a hidden weight in the hand."""
        self._tick.mode = Mode()
        asked: dict[bytes, tuple[Joints, Joints]] = {}
        total = self._examiner.left_over(self._currents(x, 0, asked), payload_kg)
        arm = self._examiner.arm_left_over(self._currents(x, 1, asked), payload_kg)
        return Score(rms(total), rms(arm))

    def exo_only(self, x: Parameters) -> Joints:
        """What is left over when only the exoskeleton is carried, RMS per joint [N·m]."""
        self._tick.mode = Mode(arm_share=0.0)
        return rms(self._examiner.left_over(self._currents(x, 0, {})))

    def _currents(
        self, x: Parameters, part: int, asked: dict[bytes, tuple[Joints, Joints]]
    ) -> Callable[[Joints], Joints]:
        """What the controller commands for all (part 0) or for the arm (part 1); `asked` is filled and reused."""

        def current(q: Joints) -> Joints:
            key = q.tobytes()
            if key not in self._z:
                self._z[key] = self._solver.solve(q, q, x[FIT_OF_ARM])[0]
            if key not in asked:
                *torques, self._z[key] = self._tick.at_rest(q, x, self._z[key])
                asked[key] = (torques[0], torques[1])
            return self._current(asked[key][part])

        return current
