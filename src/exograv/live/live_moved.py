"""Machine of a live run whose arm a procedure moves: orders to control, limits to the guard, and ticks back."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from exograv.dynamics.parameters import Parameters
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate
from exograv.loop.moved_machine import Heard
from exograv.loop.person_limits_manager import LimitsMaker
from exograv.loop.pilot import Progress
from exograv.model.arm import WeightPlace, summed_weights
from exograv.motion import Planned
from exograv.runtime.processes.shared_memory import MessageRing, Ring

from .live_procedure import LiveFloat
from .order_line import OrderLine, shown_as

Joints = np.ndarray


class LiveMoved:
    """`MovedMachine` of a live run. However the procedure ends, the guard lets the arm down."""

    def __init__(
        self,
        floating: LiveFloat,
        rings: tuple[MessageRing, Ring],
        limits: LimitsMaker,
        model: ArmModel,
        period_s: float,
        progress: Progress,
    ):
        """Take a machine in which the identified arm floats.

        Args:
            floating: Machine.
            rings: Orders to control, and ticks that control carries out.
            limits: Factory of the person's limits.
            model: Model of the arm in the machine as calibrated.
            period_s: Period of the machine [s].
            progress: Function that shows the progress.
        """
        self.floating, self._line = floating, OrderLine(*rings)
        self.model, self._limits, self._period_s, self.progress = model, limits, period_s, progress
        self._is_load_known = True
        self._weights: dict[WeightPlace, float] = {}

    @property
    def estimate(self) -> Estimate:
        """Identified arm that the machine carries."""
        return self.floating.learned.floated

    @property
    def q(self) -> Joints:
        """Joint position at the last tick [rad]."""
        return self.floating.q

    @property
    def period_s(self) -> float:
        """Period of the control loop [s]."""
        return self._period_s

    @property
    def weights(self) -> Mapping[WeightPlace, float]:
        """Weights that are carried in addition to the arm [kg]."""
        return dict(self._weights)

    def lead(self) -> None:
        """Hold the weightless arm where it is. The feedback comes by a ramp."""
        self.allow_motion()
        self.order(is_led=True)
        while self.floating.drive < 1.0:
            self.floating.wait()

    def allow_motion(self) -> None:
        """Have the guard allow a motion of the identified arm, before control begins it."""
        self._wear_known(self.estimate.x, is_driven=True)

    def let_float(self) -> None:
        """Let the arm float again. The feedback goes by a ramp."""
        self.order(is_led=False)
        while self.floating.drive > 0.0:
            self.floating.wait()
        self._wear_known(self.estimate.x, is_driven=False)

    def let_others_lead(self) -> None:
        """Let the arm float while another person moves it by hand. The drift monitor is silent from now on.

        The monitor cannot tell a therapist's hands from a fault of a drive.
        """
        self._is_load_known = False
        self.order(is_led=False)

    def hold(self, seconds: float, text: str) -> None:
        """Hold the arm for a time [s]."""
        self.progress(text, 0.0)
        self.floating.float_for(seconds, lambda _t, _q: False)

    def follow(self, path: Planned, text: str, heard: Heard | None = None) -> None:
        """Move the arm along a path, and give each tick to `heard`; few ticks without a sample are interpolated."""
        number = self.order(is_led=True, path=path)

        def take(_tick: int, q: Joints, tau: Joints) -> None:
            if heard is not None:
                heard(q, tau)

        self._line.watch(self.floating, number, path, take, shown_as(text, self.progress))

    def expect_weight(self, x: Parameters, place: WeightPlace, v_motion: float) -> None:
        """Prepare the guard for an unknown weight at `place`. The drift monitor is silent from now on."""
        self.floating.wear(self._limits.weighed(x, place, v_motion), is_driven=True)
        self._is_load_known = False
        self.order(is_led=True)

    def know(self, x: Parameters) -> None:
        """Give the guard the limits of an arm `x` with the weights that are carried."""
        self._wear_known(x, is_driven=True)
        self._is_load_known = True
        self.order(is_led=True)

    def carry(self, place: WeightPlace, mass: float) -> None:
        """Carry a weight [kg] at this place from now on; zero removes it."""
        weights: dict[WeightPlace, float] = {**self._weights, place: mass}
        self._weights = {where: kg for where, kg in weights.items() if kg}
        self.order(is_led=True, place=place, mass_kg=float(mass))

    def _wear_known(self, x: Parameters, *, is_driven: bool) -> None:
        self.floating.wear(self._limits.known(x, summed_weights(self.model.assembly.arm, self._weights)), is_driven)

    def order(self, *, is_led: bool, **more: Any) -> int:
        """Send an order to control, with the fields of `Order` in `more`, and return its number.

        Raises:
            RigError: Control takes no orders any more.
        """
        return self._line.send(self.floating, is_led=is_led, is_load_known=self._is_load_known, **more)

    def new_rows(self) -> np.ndarray:
        """Take the ticks that have arrived, and free their places."""
        return self._line.new_rows()
