"""Second implementation of guard and envelope, from docs/explanation/safety.md and without a look at the first one.

It imports no part of `exograv`, so that the two do not share errors. Machines are the first axis of each array; each of
them has its own guard.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

RAN_WELL = ""
"""Value in place of a stop reason if there was no stop."""


@dataclass
class Machines:
    """Properties of machines and of the persons in them: (machine,), (machine, joint), (machine, joint, product)."""

    period: np.ndarray
    torque_max: np.ndarray
    damping: np.ndarray
    rate: np.ndarray
    v_damping: np.ndarray
    v_trip: np.ndarray
    descent: np.ndarray
    count: np.ndarray
    """Resolution of the encoders [rad]."""

    worn: np.ndarray
    """True if a person is in the machine; the fields below belong to this person."""
    chains: Sequence[tuple[list[int], int, np.ndarray, np.ndarray, int, np.ndarray]]
    """Joints, largest number of factors in a product, table of the machine and of the arm, largest number of factors in
    a product of the potential, and potential of machine and arm (machine, part, product)."""
    error: np.ndarray
    dry: np.ndarray
    viscous: np.ndarray
    active: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    wall: np.ndarray
    trip: np.ndarray
    own_trip: np.ndarray
    """Person's own speed limit; infinite where the machine's own limit applies."""
    path: np.ndarray
    """Power on a path."""
    tank_start: np.ndarray
    tank_max: np.ndarray
    power: np.ndarray
    """Largest power into the person; infinite without a limit."""


@dataclass
class Tick:
    """Inputs of all machines in one tick; `came` and `spoke` are true where measurement and request arrived."""

    now: np.ndarray
    came: np.ndarray
    sequence: np.ndarray
    t: np.ndarray
    q: np.ndarray
    measured: np.ndarray
    spoke: np.ndarray
    answers: np.ndarray
    """Number of the measurement that control answers."""
    valid_until: np.ndarray
    tau: np.ndarray
    level: np.ndarray
    """Gravity level that a session sets."""
    consent: np.ndarray
    """Time for which the wearer agrees to a push from now on [s]; NaN without a word."""


def products(q: np.ndarray, least_factors: int, most_factors: int, of: int | None = None) -> np.ndarray:
    """Products of one factor per joint out of 1, cos and sin (machine, product), the first joint's changing fastest.

    With `of`, their derivatives by the angle of this joint.
    """
    found, factors = np.ones((len(q), 1)), np.zeros(1, dtype=int)
    for joint, angle in enumerate(q.T):
        three = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
        if joint == of:
            three = np.stack([np.zeros_like(angle), -np.sin(angle), np.cos(angle)], axis=1)
        found = (three[:, :, None] * found[:, None, :]).reshape(len(q), -1)
        factors = np.add.outer([0, 1, 1], factors).ravel()
    return found[:, (factors >= least_factors) & (factors <= most_factors)]


def any_joint(joints: np.ndarray) -> np.ndarray:
    """Machines for which any joint is true."""
    return np.logical_or.reduce(joints, axis=1)


class SecondEnvelope:
    """Limits of all machines: torque, rate, speed, stops, plausibility and tank."""

    def __init__(self, machines: Machines):
        self.m = machines
        shape = machines.torque_max.shape
        self.reason = np.full(shape[0], RAN_WELL, dtype="<U20")
        self.isolated, self.powerless = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
        self.without_model = np.zeros(shape[0], dtype=bool)
        self.stopped_for = np.zeros(shape[0])
        self.tau = np.zeros(shape)
        self.tau_at_stop, self.push_at_stop = np.zeros(shape), np.zeros(shape)
        self.carried, self.push = np.zeros(shape), np.zeros(shape)
        self.q = np.zeros(shape)
        self.energy = machines.tank_start.copy()
        self.v_before, self.slope = np.zeros(shape), np.zeros(shape)
        self.clipped = np.zeros(shape[0], dtype=int)

    @property
    def stopped(self) -> np.ndarray:
        """Machines that are latched."""
        return np.not_equal(self.reason, RAN_WELL)

    def trip(self, where: np.ndarray, reason: str) -> None:
        """Latch some machines; a machine that is latched keeps its first reason, and the torque of that time."""
        new = where & ~self.stopped
        # The part of the torque that goes beyond carrying the machine, in the direction of the push, is the push.
        beyond = self.tau - self.carried + self.push
        pushed = np.where(self.push > 0.0, np.clip(beyond, 0.0, self.push), np.clip(beyond, self.push, 0.0))
        pushed = np.where(self.m.worn[:, None], np.clip(pushed, -self.m.torque_max, self.m.torque_max), 0.0)
        self.push_at_stop[new] = pushed[new]
        self.tau_at_stop[new] = np.clip(self.tau - pushed, -self.m.torque_max, self.m.torque_max)[new]
        self.reason[new] = reason

    def distrust(self, joints: np.ndarray) -> None:
        """Distrust encoder and motor of some joints (machine, joint): only their drives brake them."""
        self.powerless |= joints
        self.isolated |= joints

    def reset(self, where: np.ndarray) -> None:
        """Leave the latch of some machines."""
        self.reason[where] = RAN_WELL
        self.isolated[where], self.powerless[where] = False, False
        self.without_model[where], self.stopped_for[where] = False, 0.0

    def limit(self, tau: np.ndarray, q: np.ndarray, v: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Torque (machine, joint) that may go out."""
        m, distrusted = self.m, self.isolated.copy()
        v, q = np.where(self.isolated, 0.0, v), np.where(self.isolated, self.q, q)
        knows_q, knows_v = ~any_joint(~np.isfinite(q)), ~any_joint(~np.isfinite(v))
        self.q = np.where(knows_q[:, None], q, self.q)
        v = np.where(knows_v[:, None], v, 0.0)
        self.trip(~knows_q | ~knows_v, "NO_MEASUREMENT")
        self._carry(level)
        self.trip(any_joint(~np.isfinite(tau)), "NOT_FINITE")
        fastest_allowed = np.where(m.worn & (m.own_trip < m.v_trip), m.own_trip, m.v_trip)
        past = (self.q > m.upper + m.trip[:, None]) | (self.q < m.lower - m.trip[:, None])
        self.trip(m.worn & any_joint(past), "PAST_A_STOP")
        too_fast = np.abs(v) > fastest_allowed[:, None]
        self.trip(any_joint(too_fast), "TOO_FAST")
        self.distrust(too_fast)
        # No joint is that fast, so the person's bounds and the tank are then those at rest.
        credible = np.where(any_joint(np.abs(v) > 1e3)[:, None], 0.0, v)
        self.soon = self.q + 0.1 * credible
        # Forward difference through a low-pass filter of 8 ms, without the joints that were distrusted before.
        change = credible - self.v_before - m.period[:, None] * self.slope
        self.slope = np.where(distrusted, 0.0, self.slope + change / (0.008 + m.period)[:, None])
        self.v_before = credible
        asked, brake = np.where(self.stopped[:, None], self._descent(), tau), self._brake(v)
        v, wanted = credible, asked + brake
        bounded = np.where(m.worn[:, None], self._for_the_person(asked, brake, v), wanted)
        out = np.clip(bounded, -m.torque_max, m.torque_max)
        step = (m.rate * m.period)[:, None]
        out = np.clip(out, self.tau - step, self.tau + step)
        self._pay(out, v)
        self.clipped += ~self.stopped & (out != wanted).any(axis=1)
        self.tau = out
        return out

    def _descent(self) -> np.ndarray:
        self.stopped_for = np.where(self.stopped, self.stopped_for + self.m.period, self.stopped_for)
        left = np.clip(1.0 - self.stopped_for / self.m.descent, 0.0, 1.0)
        push_left = np.clip(1.0 - self.stopped_for / np.minimum(self.m.descent, 0.5), 0.0, 1.0)
        held = self.tau_at_stop * left[:, None] + self.push_at_stop * push_left[:, None]
        return np.where(self.powerless | self.without_model[:, None], 0.0, held)

    def _carry(self, level: np.ndarray) -> None:
        """Compute the torque that carries at this level, and what of it pushes the arm down."""
        level = np.clip(np.nan_to_num(level, nan=0.0), 0.0, 1.8)
        self.carried = self._plausible(level)
        self.push = np.where((level > 1.0)[:, None], self.carried - self._plausible(np.minimum(level, 1.0)), 0.0)

    def _plausible(self, level: np.ndarray) -> np.ndarray:
        carried = np.empty_like(self.tau)
        for joints, most_factors, machine, arm, potential_factors, potential in self.m.chains:
            table, q = machine + (1.0 - level)[:, None, None] * arm, self.q[:, joints]
            carried[:, joints] = np.einsum("bjf,bf->bj", table, products(q, 0, most_factors))
            weight = potential[:, 0] + (1.0 - level)[:, None] * potential[:, 1]
            for number, joint in enumerate(joints):
                slopes = products(q, most_factors + 1, potential_factors, number)
                carried[:, joint] += (weight * slopes).sum(axis=1)
        return carried

    def _depth(self) -> tuple[np.ndarray, np.ndarray]:
        """Depth in the wall before the upper and the lower stop; 0 if nobody is in the machine."""
        wall, worn = self.m.wall[:, None], self.m.worn[:, None]
        upper = np.clip((np.maximum(self.q, self.soon) - (self.m.upper - wall)) / wall, 0.0, 1.0)
        lower = np.clip(((self.m.lower + wall) - np.minimum(self.q, self.soon)) / wall, 0.0, 1.0)
        return np.where(worn, upper, 0.0), np.where(worn, lower, 0.0)

    def _brake(self, v: np.ndarray) -> np.ndarray:
        v = np.clip(v, -1e3, 1e3)
        upper, lower = self._depth()
        braked = np.maximum(np.abs(v) - self.m.v_damping[:, None], np.where(v > 0.0, upper, lower) * np.abs(v))
        descending = np.where(self.without_model, 2.0, 1.0)[:, None] * np.abs(v)
        speed = np.where(self.stopped[:, None], descending, np.maximum(braked, 0.0))
        return -self.m.damping * speed * np.sign(v)

    def _for_the_person(self, tau: np.ndarray, brake: np.ndarray, v: np.ndarray) -> np.ndarray:
        m = self.m
        p, self.friction = self.carried, m.dry + m.viscous * np.abs(v)
        room = self.friction + m.error
        high = np.maximum(p, 0.0) + np.minimum(0.3 * np.maximum(p, 0.0) + 3.0, m.active) + room
        low = np.minimum(p, 0.0) - np.minimum(0.3 * np.maximum(-p, 0.0) + 3.0, m.active) - room
        upper, lower = self._depth()
        tau = np.clip(tau, (1.0 - lower) * low + lower * p, (1.0 - upper) * high + upper * p)
        tau = np.clip(tau + brake, low, high)
        tau = self._within_power(tau, v)
        # After the reaction of the filter and the fading of the excess, each joint has another speed.
        later = 0.008 + np.abs(tau - self.carried) / m.rate[:, None]
        tau = self._within_power(tau, v + self.slope * later)
        driving = np.maximum(self._over(tau, v), 0.0)
        needed = (driving**2 * np.abs(v)).sum(axis=1) / (2.0 * m.rate)
        has = np.maximum(self.energy, 0.0)
        kept = np.where(needed > self.energy, np.sqrt(has / np.where(needed > 0.0, needed, 1.0)), 1.0)
        return tau - np.sign(v) * (1.0 - kept)[:, None] * driving

    def _within_power(self, tau: np.ndarray, v: np.ndarray) -> np.ndarray:
        driving = np.maximum(self._over(tau, v), 0.0)
        power = (driving * np.abs(v)).sum(axis=1)
        share = np.minimum(1.0, self.m.power / np.where(power > 0.0, power, 1e-300))
        return tau - np.sign(v) * driving * (1.0 - share)[:, None]

    def _over(self, tau: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Torque in the direction of motion, beyond carrying and friction; negative when it brakes."""
        along = np.sign(v) * (tau - self.carried)
        return along - np.clip(along, 0.0, self.friction)

    def _pay(self, tau: np.ndarray, v: np.ndarray) -> None:
        power = (self._over(tau, v) * np.abs(v)).sum(axis=1)
        after = np.minimum(self.energy + (self.m.path - power) * self.m.period, self.m.tank_max)
        self.energy = np.where(self.m.worn, after, self.energy)


def ticks_in(ms: float, period: np.ndarray) -> np.ndarray:
    """Smallest number of ticks of each machine that lasts at least `ms` milliseconds."""
    whole = np.rint(1e-3 * ms / period)
    return np.where(whole * period * 1e3 > ms - 1e-6, whole, whole + 1).astype(int)


class Missed:
    """Missed ticks of the last second, in a ring that all machines share."""

    def __init__(self, period: np.ndarray):
        self.short, self.long, self.bridge = (ticks_in(ms, period) for ms in (20.0, 1000.0, 3.0))
        self.size = int(self.long.max())
        self.ring, self.at = np.zeros((self.size, len(period)), dtype=bool), 0
        self.row = np.zeros(len(period), dtype=int)

    def add(self, is_missed: np.ndarray) -> np.ndarray:
        """Add a tick; return the machines for which it is one too many."""
        self.at = (self.at + 1) % self.size
        self.ring[self.at] = is_missed
        self.row = np.where(is_missed, self.row + 1, 0)
        ago = ((self.at - np.arange(self.size)) % self.size)[:, None]
        in_short, in_long = ((self.ring & (ago < most)).sum(axis=0) for most in (self.short, self.long))
        return is_missed & ((self.row > self.bridge) | (in_short > self.bridge) | (in_long > 10))

    def forget(self, where: np.ndarray) -> None:
        """Forget all missed ticks of some machines."""
        self.ring[:, where], self.row[where] = False, 0


class SecondImage:
    """Joints whose signals keep all their bits, and whether sensors with noise would do so."""

    def __init__(self, machines: Machines):
        shape = machines.torque_max.shape
        self.step = (machines.period / (1.0 + machines.period))[:, None]
        self.most, self.most_alone = (ticks_in(ms, machines.period)[:, None] for ms in (40.0, 80.0))
        self.q, self.torque = np.full(shape, np.nan), np.full(shape, np.nan)
        self.ticks, self.log_chance = np.zeros(shape, dtype=int), np.zeros(shape)
        self.share, self.turns, self.slope = np.ones(shape), np.zeros(shape), np.zeros(shape)
        self.seen = np.zeros(shape, dtype=int)

    def see(self, tick: Tick, where: np.ndarray, believed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return machines whose whole image is frozen, and joints that are frozen alone."""
        here = where[:, None] & np.ones_like(believed)
        change = tick.measured - self.torque
        same = (change == 0.0) & (tick.q == self.q)
        self.q, self.torque = np.where(here, tick.q, self.q), np.where(here, tick.measured, self.torque)
        self.seen = self.seen + here
        step = np.maximum(self.step, 1.0 / (self.seen + 1))
        self.share = np.where(here, (1.0 - step) * self.share + step * same, self.share)
        self.ticks = np.where(here, np.where(same, self.ticks + 1, 0), self.ticks)
        noisy = (self.turns >= 0.25) & (self.seen - self.ticks >= 50)
        longer = np.maximum(self.log_chance + np.where(noisy, np.log(self.share), 0.0), 2.0 * np.log(1e-10))
        self.log_chance = np.where(here, np.where(same, longer, 0.0), self.log_chance)
        changed = here & (np.abs(change) > 0.0)
        back = np.sign(change) == -np.sign(self.slope)
        self.turns = np.where(changed, (1.0 - step) * self.turns + step * back, self.turns)
        self.slope = np.where(changed, change, self.slope)
        together = np.where(believed, self.log_chance, 0.0).sum(axis=1)
        long = (~believed | (self.ticks >= self.most)).all(axis=1)
        whole = where & believed.any(axis=1) & long & (together < np.log(1e-10))
        return whole, here & believed & (self.ticks >= self.most_alone) & (self.log_chance < np.log(1e-10))


class SecondIngress:
    """Choice of the measurements that are used, and of the joints that are distrusted."""

    def __init__(self, machines: Machines):
        self.m = machines
        shape = machines.torque_max.shape
        # The history holds five milliseconds of motion, and then twenty with the same position.
        self.moving, self.still = ticks_in(5.0, machines.period)[:, None], ticks_in(20.0, machines.period)[:, None]
        self.needed = self.moving + self.still + 1
        self.kept = int(self.needed.max())
        self.newest = np.full(shape[0], -1)
        self.dropped = np.zeros(shape[0], dtype=int)
        self.used_at = np.full(shape[0], np.nan)
        self.history = np.full((self.kept, *shape), np.nan)
        self.uses = np.zeros(shape, dtype=int)
        self.same = np.zeros(shape, dtype=int)
        self.far = np.zeros(shape, dtype=int)
        self.image = SecondImage(machines)

    def see(self, tick: Tick, isolated: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return machines whose measurement is used, and joints that jumped, are frozen, or gave non-finite values."""
        m, believed = self.m, ~isolated
        # A joint loses its history when it is distrusted.
        self.uses[isolated], self.far[isolated] = 0, 0
        new = tick.came & (tick.sequence > self.newest)
        self.dropped += tick.came & ~new
        self.newest = np.where(new, tick.sequence, self.newest)
        of_now = new & (np.abs(tick.now - tick.t) <= 0.003)
        no_number = of_now[:, None] & believed & ~(np.isfinite(tick.q) & np.isfinite(tick.measured))
        good = of_now & ~no_number.any(axis=1)
        ticks = np.fmax(np.rint((tick.t - self.used_at) / m.period), 1.0)
        last = self._used(1)
        at_first = ticks[:, None] * (1.5 * m.v_trip * m.period)[:, None] + ticks[:, None] * m.count
        then = ((ticks + 0.5) * m.v_trip * m.period)[:, None] + m.count
        reach = np.where(self.far > 0, then, at_first)
        off = good[:, None] & believed & (self.uses > 0) & (np.abs(tick.q - last) > reach)
        self.far = np.where(good[:, None] & believed, np.where(off, self.far + 1, 0), self.far)
        passed = good & ~off.any(axis=1)
        whole, alone = self.image.see(tick, passed, believed)
        used = passed & ~whole
        self.used_at = np.where(used, tick.t, self.used_at)
        dead = self._use(tick.q, used[:, None] & believed, last)
        return used, off & (self.far >= 3), dead | (alone & used[:, None]), no_number

    def _used(self, ago: int | np.ndarray) -> np.ndarray:
        """Position `ago` uses before, 1 for the last one."""
        return np.take_along_axis(self.history, ((self.uses - ago) % self.kept)[None], axis=0)[0]

    def _use(self, q: np.ndarray, where: np.ndarray, last: np.ndarray) -> np.ndarray:
        same = np.where((self.uses > 0) & (q == last), self.same + 1, 1)
        self.same = np.where(where, same, self.same)
        place = (self.uses % self.kept)[None]
        now_there = np.take_along_axis(self.history, place, axis=0)[0]
        np.put_along_axis(self.history, place, np.where(where, q, now_there)[None], axis=0)
        self.uses = self.uses + where
        way = np.maximum(0.2 * self.moving * self.m.period[:, None], 4.0 * self.m.count)
        moved = np.abs(q - self._used(self.needed)) >= way
        return where & (self.uses >= self.needed) & (self.same > self.still) & moved


class SecondGuard:
    """Ingress, bridge and envelope of all machines."""

    def __init__(self, machines: Machines):
        self.m = machines
        self.envelope, self.ingress = SecondEnvelope(machines), SecondIngress(machines)
        shape = machines.torque_max.shape
        self.silent, self.bridged = Missed(machines.period), Missed(machines.period)
        self.refused = np.zeros(shape, dtype=int)
        self.held, self.q, self.v = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        self.q_before, self.t_before = np.full(shape, np.nan), np.zeros(shape[0])
        self.has_before, self.used = np.zeros(shape[0], dtype=bool), np.zeros(shape[0], dtype=bool)
        self.consent, self.has_limited = np.zeros(shape[0]), np.zeros(shape[0], dtype=bool)

    def step(self, tick: Tick) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Run a tick; return torque, damping by the drives, and the number of the safe state."""
        envelope, everybody = self.envelope, np.ones_like(tick.came)
        level = self._felt(tick)
        used, jumped, dead, no_number = self.ingress.see(tick, envelope.isolated.copy())
        for joints, reason in ((jumped, "ENCODER_JUMPED"), (dead, "ENCODER_DEAD")):
            envelope.trip(any_joint(joints), reason)
            envelope.isolated |= joints
            self.silent.forget(any_joint(joints))
        self._move(tick, used)
        too_silent = self.silent.add(~used)
        known = any_joint(no_number)
        envelope.trip(too_silent & known, "NO_MEASUREMENT")
        envelope.trip(too_silent & ~known, "MACHINE_SILENT")
        envelope.isolated |= too_silent[:, None] & np.where(known[:, None], no_number, everybody[:, None])
        answered = used & tick.spoke & (tick.answers == tick.sequence) & (tick.valid_until >= tick.now)
        envelope.trip(self.bridged.add(~answered), "CONTROL_SILENT")
        self.held = np.where(answered[:, None], tick.tau, self.held)
        tau = envelope.limit(self.held, self.q, self.v, level)
        is_refused = (np.abs(self.held - tau) > 3.0) & (np.abs(self.v) < 0.1) & ~envelope.stopped[:, None]
        self.refused = np.where(is_refused, self.refused + 1, 0)
        envelope.trip(any_joint(self.refused > np.rint(0.3 / self.m.period)[:, None]), "NOT_THIS_ARM")
        ranks = ((answered, -1), (~answered, 0), (envelope.stopped, 1), (envelope.without_model, 2))
        state = np.max([np.where(where, rank, -1) for where, rank in ranks], axis=0)
        state = np.where(envelope.isolated.any(axis=1), 3, state)
        braked = envelope.isolated * 1.0 + envelope.powerless
        return tau, braked * self.m.damping, state

    def reset(self, where: np.ndarray) -> np.ndarray:
        """Reset some machines; return those whose latch was left."""
        envelope = self.envelope
        down = envelope.stopped & (envelope.stopped_for >= self.m.descent)
        # If no joint of a machine is trusted, all of them must stand still, by a measurement of this tick.
        asked = ~envelope.isolated | ~any_joint(~envelope.isolated)[:, None]
        with np.errstate(invalid="ignore"):
            standing = (~asked | (np.abs(self.v) < 0.05)).all(axis=1)
        left = where & down & standing & self.used
        envelope.reset(left)
        self.silent.forget(left)
        self.bridged.forget(left)
        self.held[left], self.has_before[left] = 0.0, False
        # Positions from before the reset are forgotten. The speed in force stays until the next measurement.
        return left

    def _felt(self, tick: Tick) -> np.ndarray:
        """Level in force: above 1 it falls, slowly without consent, fast in a stop, in a wall, and at a fast joint."""
        envelope, m = self.envelope, self.m
        is_said = m.worn & ~envelope.stopped & (tick.consent >= 0.0) & (tick.consent <= 120.0)
        self.consent = np.where(is_said, tick.consent, self.consent)
        self.consent = np.where(m.worn & ~envelope.stopped, np.maximum(self.consent - m.period, 0.0), 0.0)
        soon = envelope.q + 0.1 * envelope.v_before
        low, high = m.lower + m.wall[:, None], m.upper - m.wall[:, None]
        in_wall = any_joint(~((low <= envelope.q) & (envelope.q <= high) & (low <= soon) & (soon <= high)))
        is_fast = any_joint(np.abs(envelope.v_before) > m.v_damping[:, None])
        stops = ~m.worn | envelope.stopped | (self.has_limited & (in_wall | is_fast))
        down = np.where(stops, 1.6 * m.period, np.where(self.consent > 0.0, 0.0, 0.2 * m.period))
        self.has_limited |= True
        return np.where(tick.level > 1.0, np.maximum(tick.level - down, 1.0), tick.level)

    def _move(self, tick: Tick, used: np.ndarray) -> None:
        self.used = used
        passed = np.maximum(tick.t - self.t_before, 0.5 * self.m.period)[:, None]
        difference = (tick.q - self.q_before) / passed
        v = (0.008 * self.v + passed * difference) / (0.008 + passed)
        self.v = np.where(used[:, None], np.where(self.has_before[:, None], v, 0.0), self.v)
        self.q = np.where(used[:, None], tick.q, self.q)
        self.q_before = np.where(used[:, None], tick.q, self.q_before)
        self.t_before, self.has_before = np.where(used, tick.t, self.t_before), self.has_before | used
