"""Random machines, persons and faults, and the responses of the guard in `exograv.safety` to them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from exograv.safety.envelope import Envelope
from exograv.safety.guard import ControlRequest, Guard, Guarded, SafeState
from exograv.safety.ingress import Ingress
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.native.library import LIBRARY, Library
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable
from exograv.safety.stops import StopReason
from exograv.signals import JointState, TorqueSource

from .second_envelope import RAN_WELL, Machines, SecondEnvelope, SecondGuard, Tick

EXTREMES = np.array([np.nan, np.inf, -np.inf, 1e308, -1e308, 1e4, 1100.0, 1e3, 5.0, -2.0, 0.0, -0.0])
"""Non-finite values, values out of range, and values at which a limit begins."""

TRIPS: dict[int, tuple[str, bool, tuple[int, ...]]] = {
    1: ("MODEL_LOST", False, ()),
    2: ("MODEL_LOST", True, ()),
    3: ("ASTRAY", False, ()),
    4: ("TORQUE_WRONG", True, (1,)),
}
"""Faults that other parts find: reason, whether the model is distrusted, and joints whose motor is distrusted."""

TOLERANCE = 1e-9
"""Tolerance in N·m or J, relative above 1: for torques up to 100 N·m whose sums are taken in another order."""


@dataclass
class History:
    """Course of all machines: each tick, and events between ticks."""

    ticks: list[Tick]
    reset: np.ndarray
    """Reset after the tick (tick, machine)."""
    trip: np.ndarray
    """Key of `TRIPS`, or 0 (tick, machine)."""
    v: np.ndarray
    """Velocities for an envelope without a guard (tick, machine, joint)."""


@dataclass
class Trace:
    """Outputs and states (tick, machine, …)."""

    tau: np.ndarray
    drive_damping: np.ndarray
    safe_state: np.ndarray
    reason: np.ndarray
    isolated: np.ndarray
    without_model: np.ndarray
    energy: np.ndarray
    clipped: np.ndarray
    dropped: np.ndarray
    left: np.ndarray
    """True where a reset left the latch."""

    @classmethod
    def empty(cls, ticks: int, machines: int, joints: int) -> "Trace":
        """Return a trace without events."""
        shape = (ticks, machines)
        return cls(
            tau=np.zeros((*shape, joints)),
            drive_damping=np.zeros((*shape, joints)),
            safe_state=np.zeros(shape, dtype=int),
            reason=np.full(shape, RAN_WELL, dtype="<U20"),
            isolated=np.zeros((*shape, joints), dtype=bool),
            without_model=np.zeros(shape, dtype=bool),
            energy=np.zeros(shape),
            clipped=np.zeros(shape, dtype=int),
            dropped=np.zeros(shape, dtype=int),
            left=np.zeros(shape, dtype=bool),
        )


def draw_machines(rng: np.random.Generator, machines: int, joints: int) -> Machines:
    """Draw machines, about half of them worn; some have limits, tables and encoders that no real machine has."""
    each, every = (machines,), (machines, joints)
    limbs = (([0, 2], [3, 1]), ([2, 0, 3, 1],))[int(rng.integers(2))] if joints == 4 else (list(range(joints)),)
    chains = []
    for part in limbs:
        most = int(rng.integers(1, len(part) + 1))
        potential_factors = int(rng.integers(most, len(part) + 1))  # without a potential if both are equal
        counts = [math.comb(len(part), k) * 2**k for k in range(len(part) + 1)]
        shape = (machines, len(part), sum(counts[: most + 1]))
        potential = rng.normal(0.0, 2.0, (machines, 2, sum(counts[most + 1 : potential_factors + 1])))
        rows = rng.normal(0.0, 3.0, shape), rng.normal(0.0, 4.0, shape)
        chains.append((part, most, *rows, potential_factors, potential))
    v_trip = rng.choice([5.0, 5.0, 2.0], each)
    lower = rng.uniform(-2.5, -0.5, every)
    tank_max = rng.uniform(0.1, 1.5, each)
    return Machines(
        period=rng.choice([1e-3, 5e-4, 2e-3], each),
        torque_max=rng.uniform(2.0, 60.0, every),
        damping=rng.uniform(1.0, 12.0, every),
        rate=rng.choice([150.0, 150.0, 30.0, 5000.0], each),
        v_damping=v_trip * rng.uniform(0.5, 1.1, each),
        v_trip=v_trip,
        descent=rng.choice([3.0, 0.3, 0.05, 0.01], each),
        count=10.0 ** rng.uniform(-9.0, -2.5, every),
        worn=rng.random(each) < 0.7,
        chains=chains,
        error=rng.uniform(0.0, 0.2, every),
        dry=rng.uniform(0.0, 3.0, every),
        viscous=rng.uniform(0.0, 1.0, every),
        active=rng.uniform(1.0, 8.0, every),
        lower=lower,
        upper=lower + rng.uniform(0.8, 4.0, every),
        wall=rng.uniform(0.05, 0.3, each),
        trip=rng.uniform(0.0, 0.1, each),
        own_trip=rng.choice([np.inf, 1.5, 6.0], each),
        path=rng.choice([0.0, 0.0, 2.0], each),
        tank_start=tank_max * rng.uniform(0.1, 1.0, each),
        tank_max=tank_max,
        power=rng.choice([np.inf, 10.0, 0.5], each),
    )


def draw_history(rng: np.random.Generator, m: Machines, ticks: int) -> History:
    """Draw motion that starts and stops, varied control, and faults: from one in 100 000 ticks to one in 30."""
    machines, joints = m.torque_max.shape
    shape, every = (ticks, machines), (ticks, machines, joints)
    rarity = 10.0 ** rng.uniform(-5.0, -1.5, machines)

    def happens(share: float = 1.0) -> np.ndarray:
        """Return bursts of one to six ticks."""
        starts = rng.random(shape) < share * rarity
        longest = rng.integers(1, 7, shape)
        return np.any([np.roll(starts & (longest > k), k, axis=0) for k in range(6)], axis=0)

    v = _motion(rng, m, ticks)
    start = m.lower + rng.uniform(0.0, 1.0, (machines, joints)) * (m.upper - m.lower)
    q_true = start + np.cumsum(v * m.period[:, None], axis=0)
    q = np.where(rng.random((machines, joints)) < 0.5, m.count * np.round(q_true / m.count), q_true)
    q = _frozen(rng, q, rarity)
    spikes = happens()[..., None] & (rng.random(every) < 0.5)
    q = np.where(spikes, q + rng.choice([0.4, -0.01, 1e3, 0.03], every), q)
    q = _extreme(rng, q, happens())
    measured = rng.normal(0.0, 1.0, every)
    coarse = rng.choice([0.0, 0.2, 2.0], (machines, joints))  # a coarse sensor often keeps its value
    measured = np.where(coarse > 0.0, np.round(measured / np.fmax(coarse, 1e-9)) * coarse, measured)
    q, measured = _frozen_images(rng, q, measured)
    measured = _extreme(rng, measured, happens(0.5))
    sequence = np.arange(ticks)[:, None] * np.ones(machines, dtype=int)
    now = sequence * m.period + rng.uniform(0.0, 1e-4, shape)
    t = now - rng.uniform(0.0, 3e-4, shape)
    t = np.where(happens(), now - rng.choice([0.00299, 0.00301, 1.0, -0.5, np.inf, -np.inf, np.nan, 0.001], shape), t)
    came = ~happens()
    earlier = np.maximum(sequence - rng.integers(0, 6, shape), 0)
    sequence = np.where(happens(0.5), earlier, sequence)
    tau = _extreme(rng, _temper(rng, m, v), happens(0.02))
    answers = np.where(happens(0.3), sequence - 1, sequence)
    valid = np.where(happens(0.3), now - rng.choice([0.0, 1e-6, np.nan], shape), now + 0.005)
    level = 0.9 + 1.5 * np.cumsum(rng.normal(0.0, 0.03, shape), axis=0)
    level = _extreme(rng, level[..., None], rng.random(shape) < 0.01)[..., 0]
    spoke = ~happens()
    consent = np.where(rng.random(shape) < 0.005, rng.choice([0.0, 0.01, 1.0, 120.0, -1.0, 121.0], shape), np.nan)
    rows = zip(now, came, sequence, t, q, measured, spoke, answers, valid, tau, level, consent, strict=True)
    trip = np.where(rng.random(shape) < 0.1 * rarity, rng.integers(1, 1 + len(TRIPS), shape), 0)
    bare = _extreme(rng, v, happens(0.3))
    return History([Tick(*row) for row in rows], rng.random(shape) < 0.02, trip, bare)


def _motion(rng: np.random.Generator, m: Machines, ticks: int) -> np.ndarray:
    """Draw velocities (tick, machine, joint) that wander, stop for a while, and are sometimes too fast."""
    machines, joints = m.torque_max.shape
    lively = 10.0 ** rng.uniform(-1.0, 0.8, (machines, joints))
    v, now, moves = np.zeros((ticks, machines, joints)), np.zeros((machines, joints)), np.ones(machines, dtype=bool)
    for k in range(ticks):
        moves ^= rng.random(machines) < 0.003
        towards = np.where(moves[:, None], lively * rng.normal(0.0, 6.0, now.shape), 0.0)
        now = now + 0.03 * (towards - now)
        v[k] = now
    return v


def _temper(rng: np.random.Generator, m: Machines, v: np.ndarray) -> np.ndarray:
    """Draw torques (tick, machine, joint): slow, pushing with each motion, or random."""
    slow = np.cumsum(rng.normal(0.0, 0.5, v.shape), axis=0)
    pushing = np.sign(v) * rng.uniform(0.0, 30.0, v.shape[1:])
    wild = rng.normal(0.0, 40.0, v.shape)
    temper = rng.integers(0, 3, (v.shape[1], 1))
    return np.select([temper == 0, temper == 1], [slow, pushing], wild)


def _frozen(rng: np.random.Generator, q: np.ndarray, rarity: np.ndarray) -> np.ndarray:
    """Freeze some encoders for about the time after which they are found dead."""
    q = q.copy()
    for k, machine in np.argwhere(rng.random(q.shape[:2]) < 0.3 * rarity):
        joint, length = rng.integers(q.shape[2]), rng.integers(15, 60)
        q[k : k + length, machine, joint] = q[k, machine, joint]
    return q


def _frozen_images(rng: np.random.Generator, q: np.ndarray, measured: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Freeze all signals of some machines, and of single joints, for about the time after which they are found."""
    q, measured = q.copy(), measured.copy()
    for k, machine in np.argwhere(rng.random(q.shape[:2]) < 0.001):
        joints, length = (slice(None), int(rng.integers(q.shape[2])))[int(rng.integers(2))], rng.integers(30, 120)
        for signal in (q, measured):
            signal[k : k + length, machine, joints] = signal[k, machine, joints]
    return q, measured


def _extreme(rng: np.random.Generator, values: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Set one of the values at `where` to an extreme."""
    chosen = where[..., None] & (rng.random(values.shape) < 0.6)
    return np.where(chosen, rng.choice(EXTREMES, values.shape), values)


def first_envelope(m: Machines, k: int, library: Library | None = LIBRARY) -> Envelope:
    """Return the envelope of `exograv.safety` for machine k."""
    limits = Limits(
        torque_max_Nm=m.torque_max[k],
        damping_Nms_per_rad=m.damping[k],
        torque_rate_max_Nm_per_s=float(m.rate[k]),
        v_damping_rad_s=float(m.v_damping[k]),
        v_trip_rad_s=float(m.v_trip[k]),
        descent_s=float(m.descent[k]),
    )
    envelope = Envelope(limits, float(m.period[k]), library)
    if m.worn[k]:
        chains = tuple(
            LimbTable(tuple(joints), most, exo[k], arm[k], further, potential[k])
            for joints, most, exo, arm, further, potential in m.chains
        )
        table = PlausibleTable(chains, m.error[k], m.dry[k], m.viscous[k])
        angles = {"wall_rad": float(m.wall[k]), "trip_rad": float(m.trip[k])}
        angles |= {"v_trip_rad_s": float(m.own_trip[k]), "path_W": float(m.path[k])}
        tank = {"tank_start_J": float(m.tank_start[k]), "tank_max_J": float(m.tank_max[k])}
        tank |= {"power_max_W": float(m.power[k])}
        envelope.person = GuardedPerson(PersonLimits(table, m.active[k], m.lower[k], m.upper[k], **angles, **tank))
    return envelope


def first_guards(
    m: Machines, history: History, library: Library | None = LIBRARY, hashes: np.ndarray | None = None
) -> Trace:
    """Run the guards of `exograv.safety`, one machine after the other.

    `hashes` (machine, place) takes a hash of the bits of each place of the guard's record over all ticks. Every NaN
    counts alike.
    """
    machines, joints = m.torque_max.shape
    trace = Trace.empty(len(history.ticks), machines, joints)
    for b in range(machines):
        guard, ingress = first_guard(m, b, library)
        envelope, record = guard.envelope, guard.envelope.record.view
        for k in range(len(history.ticks)):
            out, trace.left[k, b] = first_step(guard, history, k, b)
            trace.tau[k, b], trace.drive_damping[k, b] = out.tau, out.drive_damping
            trace.safe_state[k, b], trace.dropped[k, b] = out.safe_state, ingress.dropped
            _note(trace, envelope, k, b)
            if hashes is not None:
                hashes[b] = 3 * hashes[b] + np.where(np.isnan(record), -1, record.view(np.int64))
    return trace


def first_guard(m: Machines, b: int, library: Library | None = LIBRARY) -> tuple[Guard, Ingress]:
    """Return the guard of `exograv.safety` for machine b, and its ingress."""
    ingress = Ingress(m.count[b].tolist(), float(m.period[b]), float(m.v_trip[b]))
    return Guard(first_envelope(m, b, library), ingress, float(m.period[b])), ingress


def first_step(guard: Guard, history: History, k: int, b: int) -> tuple[Guarded, bool]:
    """Run tick k of machine b, after the events before it; return its output, and whether a reset left the latch."""
    tick, left = history.ticks[k], False
    if history.reset[k, b]:
        left = guard.reset()
    _between(guard.envelope, history.trip[k, b], tick.level[b])
    if np.isfinite(tick.consent[b]):
        guard.consent(float(tick.consent[b]))
    state = submitted = None
    if tick.came[b]:
        sensors = (tick.measured[b], np.full(len(tick.q[b]), np.nan), TorqueSource.CURRENT)
        state = JointState(float(tick.t[b]), int(tick.sequence[b]), tick.q[b], *sensors)
    if tick.spoke[b]:
        submitted = ControlRequest(int(tick.answers[b]), float(tick.valid_until[b]), tick.tau[b])
    return guard.step(state, submitted, float(tick.now[b])), left


def first_envelopes(m: Machines, history: History) -> Trace:
    """Run the envelopes of `exograv.safety` alone, with inputs that no ingress has checked."""
    machines, joints = m.torque_max.shape
    trace = Trace.empty(len(history.ticks), machines, joints)
    for b in range(machines):
        envelope = first_envelope(m, b)
        for k, tick in enumerate(history.ticks):
            if history.reset[k, b]:
                envelope.reset()
            _between(envelope, history.trip[k, b], tick.level[b])
            trace.tau[k, b] = envelope.limit(tick.tau[b], tick.q[b], history.v[k, b])
            _note(trace, envelope, k, b)
    return trace


def _between(envelope: Envelope, trip: int, level: float) -> None:
    """Apply the events between two ticks."""
    if trip:
        reason, without_model, powerless = TRIPS[trip]
        envelope.trip(StopReason[reason], without_model=without_model, powerless=powerless)
    if envelope.person is not None:
        envelope.person.gravity_level = float(level)


def _note(trace: Trace, envelope: Envelope, k: int, b: int) -> None:
    trace.reason[k, b] = RAN_WELL if envelope.stop is None else envelope.stop.name
    trace.isolated[k, b, list(envelope.isolated)] = True
    trace.without_model[k, b], trace.clipped[k, b] = envelope.without_model, envelope.clipped_ticks
    trace.energy[k, b] = 0.0 if envelope.person is None else envelope.person.energy_J


def second(m: Machines, history: History, has_guard: bool, first: Trace) -> Trace:
    """Run `second_envelope.py` for all machines at once, and compare with the first ones.

    The tank's energy is taken over from the first ones where the two agree. In an almost empty tank the law takes a
    root, over a speed that may be almost zero, so rounding errors of seconds would grow to a newton metre.
    """
    trace = Trace.empty(len(history.ticks), len(m.period), m.torque_max.shape[1])
    guard = SecondGuard(m)
    envelope = guard.envelope if has_guard else SecondEnvelope(m)
    with np.errstate(all="ignore"):
        for k, tick in enumerate(history.ticks):
            if has_guard:
                trace.left[k] = guard.reset(history.reset[k])
            else:
                envelope.reset(history.reset[k])
            for number, (reason, without_model, powerless) in TRIPS.items():
                here = history.trip[k] == number
                envelope.trip(here, reason)
                envelope.without_model |= here & without_model
                for joint in powerless:
                    envelope.isolated[here, joint] = envelope.powerless[here, joint] = True
            if has_guard:
                trace.tau[k], trace.drive_damping[k], trace.safe_state[k] = guard.step(tick)
                trace.dropped[k] = guard.ingress.dropped
            else:
                trace.tau[k] = envelope.limit(tick.tau, tick.q, history.v[k], tick.level)
            trace.reason[k], trace.isolated[k] = envelope.reason, envelope.isolated
            trace.without_model[k], trace.clipped[k] = envelope.without_model, envelope.clipped
            trace.energy[k] = np.where(m.worn, envelope.energy, 0.0)
            agreed = m.worn & _same(first.energy[k], trace.energy[k])
            envelope.energy = np.where(agreed, first.energy[k], envelope.energy)
    return trace


@dataclass
class Comparison:
    """Comparison of two traces over a batch of machines."""

    ticks: int
    disagreements: int
    """Number of ticks in which the traces of a machine differ; after the first one all later ticks may differ."""
    largest_Nm: float
    """Largest difference of torques."""
    first: list[str]
    """First difference of each machine that differs."""
    covered: dict[str, int]
    """Numbers of ticks in each safe state and with each reason, and of resets that left the latch."""


def compare(one: Trace, other: Trace) -> Comparison:
    """Compare floats within `TOLERANCE` and all else exactly; a NaN is a disagreement."""
    bad, found = np.zeros(one.reason.shape, dtype=bool), []
    for field in fields(Trace):
        a, b = getattr(one, field.name), getattr(other, field.name)
        same = _same(a, b) if a.dtype.kind == "f" else a == b
        same = same.all(axis=2) if same.ndim == 3 else same
        differs = np.logical_not(same)
        found += [(k, b, field.name) for k, b in _first_of_each(differs)]
        bad |= differs
    states = [(f"state {state.name}", one.safe_state == state) for state in SafeState]
    reasons = [(f"stop {reason}", one.reason == reason) for reason in np.unique(one.reason)]
    counted = {name: int(np.count_nonzero(where)) for name, where in [*states, *reasons, ("resets", one.left)]}
    lines = [f"tick {k}, machine {b}: {name}" for k, b, name in sorted(found)]
    return Comparison(bad.size, int(bad.sum()), float(np.abs(one.tau - other.tau).max()), lines, counted)


def _same(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs(a - b) <= TOLERANCE * np.maximum(np.abs(a), 1.0)


def _first_of_each(bad: np.ndarray) -> Iterator[tuple[int, int]]:
    for b in np.flatnonzero(bad.any(axis=0)):
        yield int(bad[:, b].argmax()), int(b)
