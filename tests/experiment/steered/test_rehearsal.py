"""A rehearsal behaves as a machine does: what is off stands still."""

from exograv.experiment.steered.rehearsal import RehearsedFlight
from exograv.safety.modes import Event, Mode


class Clock:
    """Clock that a test sets."""

    t = 100.0

    def __call__(self) -> float:
        return self.t


def test_the_arm_stands_still_until_the_machine_carries_it():
    clock = Clock()
    flight = RehearsedFlight(clock)
    still = flight.moment().q_rad
    clock.t += 5.0
    off = flight.moment()
    assert off.mode is Mode.OFF
    assert (off.q_rad, set(off.v_rad_s), flight.skeleton().q_rad) == (still, {0.0}, still)
    assert set(flight.trace(0).q_rad) == {still}
    for event in (Event.TEST, Event.TAKE_ARM):
        flight.lease(clock.t + 1.0, None)
        assert flight.ask(event) == ""
        for _ in range(10):
            clock.t += 0.5
            flight.lease(clock.t + 1.0, None)
    floats = flight.moment()
    assert floats.arm_share == 1.0
    assert all(abs(now - before) > 1e-3 for now, before in zip(floats.q_rad, still, strict=True))
    assert flight.trace(0).q_rad[-1] != still
