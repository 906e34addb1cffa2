"""Two pages never steer at once, for any history of requests, heartbeats, silences and closed lines (F31, F32)."""

import hypothesis.strategies as st
from hypothesis import given

from exograv.console.lease import LEASE_S, Lease

STEP = st.tuples(st.sampled_from(["ask", "beat", "give_up"]), st.integers(1, 3), st.floats(0.0, 2.0))


@given(steps=st.lists(STEP, max_size=60))
def test_in_no_history_do_two_write(steps: list[tuple[str, int, float]]):
    lease, t = Lease(), 0.0
    holder, heard = None, 0.0
    for what, line, passed_s in steps:
        t += passed_s
        if holder is not None and t - heard > LEASE_S:
            holder = None
        if what == "ask":
            taken = lease.ask(line, t)
            assert taken == (holder in (None, line))
            if taken:
                holder, heard = line, t
        elif what == "beat":
            taken = lease.beat(line, t)
            assert taken == (holder == line)
            if taken:
                heard = t
        else:
            lease.give_up(line)
            holder = None if holder == line else holder
        assert lease.held_by(t) == holder


def test_a_lease_that_ran_out_does_not_come_back_by_a_beat():
    lease = Lease()
    assert lease.ask(1, 0.0)
    assert lease.beat(1, LEASE_S - 0.01)
    assert not lease.beat(1, 2 * LEASE_S + 0.1)
    assert lease.held_by(2 * LEASE_S + 0.1) is None
    assert lease.ask(2, 2 * LEASE_S + 0.2)
    assert not lease.ask(1, 2 * LEASE_S + 0.3)


def test_the_second_who_asks_waits_until_the_first_is_gone():
    lease = Lease()
    assert lease.ask(1, 0.0)
    assert not lease.ask(2, 0.1)
    lease.give_up(2)
    assert lease.held_by(0.2) == 1
    lease.give_up(1)
    assert lease.ask(2, 0.3)
