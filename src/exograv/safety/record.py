"""Record of a machine's guard: settings, inputs and state in one block of numbers, and the tick that runs on it."""

from array import array
from collections.abc import Callable, Iterable
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from exograv.errors import ConfigError

from .native import core
from .native.library import LIBRARY, Library

Numbers = Float[np.ndarray, " number"]
Places = Int[np.ndarray, " place"]

NO_TABLE = array("d", [0.0, 0.0])
"""Table of nobody."""


def places(starts: Iterable[int]) -> Places:
    """Places of whole joint fields in the record."""
    return (np.array(list(starts))[:, None] + np.arange(core.JOINTS)).ravel()


class Tick(NamedTuple):
    """Functions of `core`, bound to a record and a table."""

    see: Callable[[], None]
    decide: Callable[[], None]
    limit: Callable[[], None]
    reset: Callable[[], int | bool]


class GuardRecord:
    """Block of numbers with the names of `core`."""

    def __init__(self, joints: int, period_s: float, library: Library | None = LIBRARY):
        """Make an empty record.

        Args:
            joints: Number of joints.
            period_s: Time between two ticks [s].
            library: Compiled guard; None runs the Python source.

        Raises:
            ConfigError: The guard has no place for so many joints.
        """
        if joints > core.JOINTS:
            raise ConfigError(f"The machine has {joints} joints; the guard has places for {core.JOINTS}.")
        self.numbers = array("d", bytes(8 * core.SIZE))
        self.view: Numbers = np.frombuffer(self.numbers)
        """The same memory as an array."""
        self.joints, self._library, self._faulty = joints, library, tuple[int, ...]()
        self.numbers[core.N], self.numbers[core.DT] = joints, period_s
        fields = core.Q_IN, core.CURRENT_IN, core.TAU_IN, core.Q_MOTOR_IN, core.ANSWER_IN, core.TAU
        # A view that exists already takes a third of the time of a slice in each tick.
        self.q_in, self.current_in, self.tau_in, self.q_motor_in, self.answer_in, self.tau = map(self.of, fields)
        self.put(core.LAST, np.nan)
        self.put(core.FIRST, np.nan)
        self.numbers[core.SEQUENCE] = -1.0
        core.begin(self.numbers)
        self.bind(NO_TABLE)

    def put(self, start: int, values: Float[np.ndarray, " joint"] | float) -> None:
        """Write a joint field."""
        self.view[start : start + self.joints] = values

    def put_faulty(self, joints: tuple[int, ...]) -> None:
        """Write which joints report a fault of their drive."""
        if joints != self._faulty:
            self.put(core.FAULTY_IN, 0.0)
            for j in joints:
                self.numbers[core.FAULTY_IN + j] = 1.0
            self._faulty = joints

    def of(self, start: int) -> Float[np.ndarray, " joint"]:
        """View of a joint field; it changes with the record."""
        return self.view[start : start + self.joints]

    def joints_at(self, start: int) -> frozenset[int]:
        """Joints whose flag is set."""
        return frozenset(j for j in range(self.joints) if self.numbers[start + j] != 0.0)

    def take(self, other: "GuardRecord", chosen: Places) -> None:
        """Copy some places from another record."""
        self.view[chosen] = other.view[chosen]

    def carried(self, table: "array[float]", gravity_level: float) -> None:
        """Write the plausible torque at the positions `Q`, outside of a tick."""
        if self._library is None:
            core.carried(self.numbers, table, gravity_level)
        else:
            self._library.guard_carried(self.numbers.buffer_info()[0], table.buffer_info()[0], gravity_level)

    @property
    def library(self) -> Library | None:
        """Compiled guard that the tick uses; None if the Python source runs."""
        return self._library

    def memory(self) -> tuple[int, int]:
        """Addresses of the record and of its table, for a loop in C. They hold while both objects live."""
        return self.numbers.buffer_info()[0], self._table.buffer_info()[0]

    def bind(self, table: "array[float]") -> None:
        """Let the tick use another table of plausible torques."""
        self._table = table  # a compiled tick holds its address only
        if self._library is None:
            both = self.numbers, table
            self.tick = Tick(
                partial(core.see, self.numbers),
                partial(core.decide, *both),
                partial(core.limit, *both),
                partial(core.reset, self.numbers),
            )
            return
        record, of_table = self.numbers.buffer_info()[0], table.buffer_info()[0]
        native = self._library
        self.tick = Tick(
            partial(native.guard_see, record),
            partial(native.guard_decide, record, of_table),
            partial(native.guard_limit, record, of_table),
            partial(native.guard_reset, record),
        )
