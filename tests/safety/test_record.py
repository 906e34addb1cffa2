"""A record holds one machine, and its tick runs on the memory that it states."""

import ctypes
from array import array
from collections.abc import Callable

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.safety.envelope import Envelope
from exograv.safety.limits import Limits
from exograv.safety.native import core
from exograv.safety.native.library import Library
from exograv.safety.person import GuardedPerson
from exograv.safety.record import GuardRecord

from .monitors_alone import Monitors
from .test_monitors import state
from .test_person import LIMITS

DT = 1e-3


class Compiled(Library):
    """Compiled guard that only notes its calls."""

    def __init__(self):
        self.calls: list[tuple[str, tuple[float, ...]]] = []
        for name in ("see", "decide", "limit", "reset", "carried"):
            setattr(self, f"guard_{name}", self._noting(name))

    def _noting(self, name: str) -> Callable[..., int]:
        def call(*arguments: float) -> int:
            self.calls.append((name, arguments))
            return 1

        return call


def number_at(address: int, place: int = 0) -> float:
    """Return a number in memory."""
    return ctypes.c_double.from_address(address + 8 * place).value


def test_a_machine_of_sixteen_joints_has_a_place_and_one_of_seventeen_is_refused():
    assert GuardRecord(16, DT).joints == 16
    with pytest.raises(ConfigError, match="17 joints; the guard has places for 16"):
        GuardRecord(17, DT)


def test_a_compiled_guard_gets_the_memory_of_the_record_and_of_the_table_in_force():
    library = Compiled()
    record, table = GuardRecord(2, DT, library), array("d", [0.0, 1.0])
    assert record.library is library
    for bound in (None, table):
        if bound is not None:
            record.bind(bound)
        library.calls.clear()
        numbers, of_table = record.memory()
        assert number_at(numbers, core.N) == 2.0
        assert (of_table == table.buffer_info()[0]) == (bound is table)
        record.tick.see()
        record.tick.decide()
        record.tick.limit()
        assert record.tick.reset()
        record.carried(table, 0.5)
        both = numbers, of_table
        assert library.calls == [
            ("see", (numbers,)),
            ("decide", both),
            ("limit", both),
            ("reset", (numbers,)),
            ("carried", (numbers, table.buffer_info()[0], 0.5)),
        ]


def test_without_a_compiled_guard_the_record_has_none():
    assert GuardRecord(2, DT, None).library is None


def test_the_memory_of_a_person_holds_the_person_s_level_and_limbs_in_and_outside_of_a_machine():
    person = GuardedPerson(LIMITS, 0.4)
    envelope = Envelope(Limits(np.full(2, 60.0), np.full(2, 4.0)), DT)
    for place in (None, envelope):
        if place is not None:
            place.person = person
            assert person.memory() == place.record.memory()
        numbers, table = person.memory()
        assert number_at(numbers, core.LEVEL) == 0.4
        assert number_at(table) == 1.0


def test_an_empty_table_carries_nothing():
    record = GuardRecord(2, DT)
    record.put(core.Q, 1.0)
    record.tick.limit()
    assert number_at(record.memory()[1]) == 0.0


def test_a_drive_whose_fault_has_ended_is_not_faulty_any_more():
    monitors, still = Monitors(2, DT), [0.0, 0.0]
    faults = [(), (1,), (0, 1), (0,), (), (1,), ()]
    for k, faulty in enumerate(faults):
        findings = monitors.look(state(k, still, None, still, faulty))
        assert {joint for _, joint in findings} == set(faulty)
