"""Weight that an operator puts on the arm and takes off again, while the machine holds the arm."""

from exograv.loop.moved_machine import MovedMachine
from exograv.model.arm import WeightPlace
from exograv.procedures.calibration.operator import Operator

WAIT_S, LOWER_S, STEPS = 0.5, 2.0, 20
"""Wait between two looks for the operator, shortest time for a weight to be lowered [s], and its number of steps."""


class PlacedWeight:
    """Weight at one place of the arm. It is not there at first."""

    def __init__(self, machine: MovedMachine, operator: Operator, place: WeightPlace, mass_kg: float):
        """Take no weight yet; `mass_kg` is only for the operator."""
        self._machine, self._operator = machine, operator
        self._place: WeightPlace = place
        self._mass_kg, self._on_kg = mass_kg, 0.0

    def put(self, is_there: bool) -> None:
        """Have the operator put the weight on the arm, or take it off.

        Raises:
            RigError: The machine was stopped.
        """
        goal, before = self._mass_kg if is_there else 0.0, self._on_kg
        if goal == before:
            return
        text = f"Waiting for the weight at the {self._place}"
        while not self._operator.is_ready(self._place, goal):
            self._machine.hold(WAIT_S, text)
        for step in range(1, STEPS + 1):
            self._operator.lower(self._place, before + (goal - before) * step / STEPS)
            self._machine.hold(max(self._operator.lowers_s, LOWER_S) / STEPS, text)
        self._on_kg = goal
