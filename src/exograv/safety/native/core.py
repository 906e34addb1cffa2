"""Guard's tick as scalar functions on one flat record: compiled in a real session, run as plain Python to check it.

All functions take the record `r` of a machine: 64-bit numbers, with the places that are named below. Functions that
need the person's torques also take `w`, the table of plausible torques (`plausible.py` writes it). A function reads and
writes places of `r`; it allocates nothing and raises nothing. Flags are 0.0 or 1.0. Each joint field has `JOINTS`
places; a machine uses the first `r[N]` of them.

The file imports nothing but `math` and a type. Its text is the whole guard, so that a person can read it to the end.
Sources of all figures: docs/explanation/safety.md.
"""

import math
from collections.abc import MutableSequence

Record = MutableSequence[float]
"""Record of a machine, or table of a person: anything that gives and takes 64-bit numbers by place."""

JOINTS = 16
"""Largest number of joints of a machine."""

SLOTS = 128
"""Largest number of ticks that a ring holds; 30 ms at a period of 0.25 ms."""

SPEED_SLOTS = 40
"""Largest number of ticks in the ring of positions from which the two speeds of a joint are computed."""

MISSES = 11
"""Number of missed ticks whose time is kept: the eleventh in a second ends every bridge."""

# Settings of the machine, of the person, and times as numbers of ticks.
(
    N, DT, RATE, V_DAMPING, V_TRIP, DESCENT_S, WORN, WALL, PAST_STOP, V_TRIP_PERSON, TANK_START, TANK_MAX, PATH_W,
    DRIVEN_W, DRIVEN_J, WAY, MOVING, USED_SLOTS, COMPARES, BY_GAIN, LATELY, SLOWEST, IN_A_ROW, SPEED, STILL_MOST,
    BIAS_SHARE, REFUSED_MOST, LEAST_OPPOSITE, WINDOW, IN_WINDOW, SECOND, FROZEN_MOST, FROZEN_JOINT, NOISE_STEP,
    POWER_MAX,
) = range(35)  # fmt: skip

# Input of a tick: from the machine, then from control.
CAME, SEQUENCE_IN, T_IN, NOW, IN_CURRENT, HAS_MOTOR, SPOKE, ANSWERS, VALID_UNTIL = range(35, 44)

# State of the guard.
(
    STOP, SINCE_STOP, WITHOUT_MODEL, CLIPPED, LEVEL, LEVEL_WANTED, LEVEL_STEP, LEVEL_MOVES, DRIVEN, ENERGY, IN_WALL,
    SEQUENCE, T_USED, DROPPED, USABLE, USED_AT, TOLD_AT, TOLD_COUNT, BEFORE_AT, BEFORE_COUNT, SPEED_T, HAS_SPEED,
    BRIDGES, CONSENT, FASTEST, SAFE_STATE,
) = range(44, 70)  # fmt: skip
MACHINE_MISSES, CONTROL_MISSES = 70, 70 + 2 + MISSES
"""Missed ticks: number of the tick, place of the newest miss, and the ticks of the last misses."""

_FIELDS = CONTROL_MISSES + 2 + MISSES
(
    TORQUE_MAX, DAMPING, ACTIVE, LEAST_ACTIVE, LOWER, UPPER, FREE_LOWER, FREE_UPPER, DRY, VISCOUS, ERROR, REACH, SLACK,
    LEAST_WAY, GAIN, Q_IN, CURRENT_IN, TAU_IN, Q_MOTOR_IN, FAULTY_IN, ANSWER_IN, DESIRED, Q_GIVEN, V_GIVEN,
    TAU, TAU_AT_STOP, PUSH, PUSH_AT_STOP, ISOLATED, POWERLESS, Q, V, KNOWN, SLOPE, AHEAD, CARRIED, FRICTION, LOW, HIGH,
    LAST_TAU, WANTED, OVER, IGNORED, JUMPS, JUMPED, DEAD, BROKEN, PARTED, WRONG, FIRST, PARTED_TICKS, LAST, STILL,
    MOTOR_THEN, OFF_TICKS, BIAS, REFUSED_TICKS, HELD, Q_SEEN, V_SEEN, V_FILTER, Q_FILTER, FAULTY,
    KEPT_TICKS, KEPT_SHARE, KEPT_CHANCE, KEPT_SEEN, TURNS, Q_KEPT, MOTOR_KEPT, TORQUE_KEPT, CHANGE_BEFORE,
) = range(_FIELDS, _FIELDS + 72 * JOINTS, JOINTS)  # fmt: skip
USED = _FIELDS + 72 * JOINTS
"""Ring of the last used positions [rad]."""
TOLD = USED + SLOTS * JOINTS
"""Ring of the last commanded torques [N·m]."""
BEFORE, MOTOR_BEFORE = TOLD + SLOTS * JOINTS, TOLD + (SLOTS + SPEED_SLOTS) * JOINTS
"""Rings of the last positions by both encoders [rad]."""
SIZE = MOTOR_BEFORE + SPEED_SLOTS * JOINTS
"""Number of places of a record."""

# Reasons of a stop, in the order of `stops.StopReason`; 0 is no stop.
(
    NOT_FINITE, TOO_FAST, NO_MEASUREMENT, MODEL_LOST, PAST_A_STOP, ASTRAY, NOT_THIS_ARM, CONTROL_SILENT, MACHINE_SILENT,
    ENCODER_JUMPED, ENCODER_DEAD, TORQUE_WRONG, ENCODERS_PART, DRIVE_FAULT, STOP_PRESSED,
) = range(1, 16)  # fmt: skip

V_CREDIBLE_RAD_S, SPEED_FILTER_S = 1e3, 0.008
"""Speed that no joint reaches, a velocity above it is a broken signal [rad/s]; time constant of the guard's own
velocity [s]."""
WITHOUT_MODEL_SHARE = 2.0
"""Damping without a model, as a multiple of the soft descent's: a falling hand stays below 0.74 m/s."""
GRAVITY_LEVEL_MAX, GRAVITY_LEVEL_S, PUSH_ENDS_S = 1.8, 5.0, 0.5
"""Gravity level in the pull-up of a parabolic flight [-], where the arm is pushed down with 0.8 of its weight; shortest
time from weightless to Earth gravity, and time in which the largest push ends in a stop [s]. With a heavy arm, 11 N·m,
the torque then changes by 2.2 and by 18 N·m/s."""
SHARE_MAX, MARGIN_NM = 1.3, 3.0
"""Largest torque as a multiple of the plausible one [-], and torque beyond that and friction [N·m]."""
WALL_AHEAD_S = 0.1
"""Time ahead for which a wall acts on the predicted joint position [s]. Torque needs this time to turn into braking."""
AGE_MAX_S, JUMPS_MAX = 0.003, 3.0
"""Largest age of a measurement that is used [s]; jumps in a row that are a fault, fewer are a spike."""
UNLIKELY = 1e-10
"""Chance below which signals that keep all bits are a frozen image of the machine, and not quiet sensors."""
LEAST_TURNS, LEAST_SEEN = 0.25, 50.0
"""Least share of the changes of a measured torque that turn back, by which it has noise: half and more of the changes
of noise turn back, and hardly any of a smooth signal. Least number of ticks before the present run of equal bits, from
which the noise of a joint is known."""
AGREE_RAD, STILL_WAY_RAD = 0.035, 0.003
"""Largest difference between the two encoders of a joint [rad]: 2°, far more than the compliance of a gear. Way of the
motor, while the encoder of its joint stands still, by which the encoder is dead [rad]."""
TORQUE_OFF_NM, TORQUE_BIAS_NM = 3.0, 2.0
"""Largest difference of a motor's torque from its recent commands, and largest average difference [N·m]."""
REFUSED_NM, SLOW_RAD_S, STANDING_RAD_S = 3.0, 0.1, 0.05
"""Refused torque [N·m] at a slow joint [rad/s], by which the arm in the machine is another one; speed below which a
joint counts as being at rest [rad/s]."""
IN_SECOND_MAX = 10
"""Number of missed ticks in a second that is bridged, whatever the period is."""
LONG_AGO, TICKS_MOST = -1e18, 1e9
"""Number of a tick before all ticks; largest number of ticks between two measurements that is told apart: two weeks at
1 kHz."""


# --- numbers ----------------------------------------------------------------------------------------------------------


def least(a: float, b: float) -> float:
    """Return the smaller of two numbers; the first if either is NaN."""
    return b if b < a else a


def most(a: float, b: float) -> float:
    """Return the larger of two numbers; the first if either is NaN."""
    return b if b > a else a


def within(value: float, low: float, high: float) -> float:
    """Return the value, clipped to its bounds; the upper bound for NaN."""
    if low <= value <= high:
        return value
    return low if value < low else high


def whole(value: float) -> float:
    """Return the nearest whole number from 1 to `TICKS_MOST`, the even one of two; 1 for NaN."""
    value = most(1.0, least(value, TICKS_MOST))
    below = float(math.floor(value))
    part = value - below
    is_up = part > 0.5 or (part == 0.5 and below != 2.0 * float(math.floor(0.5 * below)))
    return below + 1.0 if is_up else below


# --- table of plausible torques ---------------------------------------------------------------------------------------


def carried(r: Record, w: Record, level: float) -> None:
    """Write the torque that carries machine and arm at the positions `Q`, where the arm feels `level` of its weight.

    The torque of a joint is a sum over its row: numbers times products of sines and cosines. A limb of many joints also
    has a potential, a sum of products with more factors, whose derivative by the joint is added.

    `w` holds for each limb: number of joints, of products in a row (a multiple of 8), of values, of leaves, of runs
    that make values, and of all runs; the joints; the runs; three tables (machine, arm, their sum at the level in
    force); and the values. The first values are 1, then cosine and sine of each joint, then further products. A table
    holds a row per joint and, if there are leaves, the potential: its numbers for the values, places for `derive`, and
    its numbers for the leaves, which are products that are no values.
    """
    at = 2
    for _ in range(int(w[0])):
        joints, products, values = int(w[at]), int(w[at + 1]), int(w[at + 2])
        leaves, ahead, runs = int(w[at + 3]), int(w[at + 4]), int(w[at + 5])
        index = at + 6
        run = index + joints
        exo = run + 4 * runs
        size = joints * products
        if leaves > 0:
            size += 2 * values + leaves
        now = exo + 2 * size
        value = now + size
        pull = value - leaves - values
        if level != w[1]:
            arm = exo + size
            for k in range(0, size, 2):  # `size` is even
                one, two = w[exo + k] + (1.0 - level) * w[arm + k], w[exo + k + 1] + (1.0 - level) * w[arm + k + 1]
                w[now + k], w[now + k + 1] = one, two
        w[value] = 1.0
        for j in range(joints):
            q = r[Q + int(w[index + j])]
            w[value + 1 + 2 * j] = math.cos(q)
            w[value + 2 + 2 * j] = math.sin(q)
        multiply(w, value, run, ahead)
        if leaves > 0:
            for k in range(values):
                w[pull + k] = w[pull - values + k]
            derive(w, value, pull, run, runs)
        for j in range(joints):
            tau = row_sum(w, now + j * products, value, products)
            if leaves > 0:
                cosine, sine = 1 + 2 * j, 2 + 2 * j
                tau += w[pull + sine] * w[value + cosine] - w[pull + cosine] * w[value + sine]
            r[CARRIED + int(w[index + j])] = tau
        at = value + values
    w[1] = level


def row_sum(w: Record, row: int, value: int, products: int) -> float:
    """Return the sum of a joint's numbers times products."""
    # Eight sums, which a processor computes at the same time.
    a = b = c = d = e = f = g = h = 0.0
    for k in range(0, products, 8):
        a += w[row + k] * w[value + k]
        b += w[row + k + 1] * w[value + k + 1]
        c += w[row + k + 2] * w[value + k + 2]
        d += w[row + k + 3] * w[value + k + 3]
        e += w[row + k + 4] * w[value + k + 4]
        f += w[row + k + 5] * w[value + k + 5]
        g += w[row + k + 6] * w[value + k + 6]
        h += w[row + k + 7] * w[value + k + 7]
    return ((a + e) + (c + g)) + ((b + f) + (d + h))


def multiply(w: Record, value: int, run: int, runs: int) -> None:
    """Make products of products.

    A run makes neighbours of neighbours: first parent, number of parents (even), cosine of the joint, and first child.
    Each parent times the cosine is a child, and after these each parent times the sine, which follows the cosine.
    """
    for i in range(runs):
        parent, count = value + int(w[run + 4 * i]), int(w[run + 4 * i + 1])
        cosine, child = value + int(w[run + 4 * i + 2]), value + int(w[run + 4 * i + 3])
        even, odd = w[cosine], w[cosine + 1]
        for k in range(0, count, 2):
            one, two = w[parent + k], w[parent + k + 1]
            w[child + k], w[child + k + 1] = one * even, two * even
            w[child + count + k], w[child + count + k + 1] = one * odd, two * odd


def derive(w: Record, value: int, pull: int, run: int, runs: int) -> None:
    """Add to the numbers of a potential what its products depend on each cosine and sine (reverse differentiation).

    The last run comes first: a number is complete when the run that made its product is reached.
    """
    for back in range(runs):
        i = runs - 1 - back
        parent, count = int(w[run + 4 * i]), int(w[run + 4 * i + 1])
        cosine, child = int(w[run + 4 * i + 2]), pull + int(w[run + 4 * i + 3])
        even, odd = w[value + cosine], w[value + cosine + 1]
        a = b = c = d = 0.0
        for k in range(0, count, 2):
            one, two = w[child + k], w[child + k + 1]
            three, four = w[child + count + k], w[child + count + k + 1]
            a += one * w[value + parent + k]
            b += two * w[value + parent + k + 1]
            c += three * w[value + parent + k]
            d += four * w[value + parent + k + 1]
            first = w[pull + parent + k] + (one * even + three * odd)
            second = w[pull + parent + k + 1] + (two * even + four * odd)
            w[pull + parent + k], w[pull + parent + k + 1] = first, second
        w[pull + cosine] += a + b
        w[pull + cosine + 1] += c + d


# --- person -----------------------------------------------------------------------------------------------------------


def look(r: Record, w: Record) -> None:
    """Set the bounds of each joint for this person at the positions `Q` and the speeds `KNOWN`.

    Two rows bound a joint. The first is 1.3 times the plausible torque and 3 N·m. The second is the plausible torque
    and the torque that a weak adult can resist.
    """
    # In this order a NaN level counts as 0. In the other order it would lift every bound.
    level = least(most(0.0, r[LEVEL]), GRAVITY_LEVEL_MAX)
    carried(r, w, least(level, 1.0))
    for j in range(int(r[N])):
        r[PUSH + j] = r[CARRIED + j]
    if level > 1.0:
        carried(r, w, level)
    r[IN_WALL] = 0.0
    for j in range(int(r[N])):
        at, speed, p = r[Q + j], r[KNOWN + j], r[CARRIED + j]
        r[PUSH + j] = p - r[PUSH + j]
        low, high = r[FREE_LOWER + j], r[FREE_UPPER + j]
        if not (low <= at <= high and low <= at + WALL_AHEAD_S * speed <= high):
            r[IN_WALL] = 1.0
        friction = r[DRY + j] + r[VISCOUS + j] * abs(speed)
        size, beyond = abs(p), friction + r[ERROR + j]
        along = least(SHARE_MAX * size + MARGIN_NM, size + r[ACTIVE + j]) + beyond
        against = r[LEAST_ACTIVE + j] + beyond
        r[FRICTION + j] = friction
        r[LOW + j] = -against if p > 0.0 else -along
        r[HIGH + j] = along if p > 0.0 else against


def drive(r: Record, is_driven: bool) -> None:
    """Begin or end a motion in which control moves the arm along a path, against the person's own motion."""
    if is_driven and r[DRIVEN] == 0.0:
        r[ENERGY] = most(r[ENERGY], r[DRIVEN_J])
    elif not is_driven:
        r[ENERGY] = least(r[ENERGY], r[TANK_START])
    r[DRIVEN] = 1.0 if is_driven else 0.0


def is_past_a_stop(r: Record) -> bool:
    """Return True if a joint is past its stop by more than the person's limit."""
    for j in range(int(r[N])):  # noqa: SIM110 - a generator has no translation to C
        if not (r[LOWER + j] - r[PAST_STOP] <= r[Q + j] <= r[UPPER + j] + r[PAST_STOP]):
            return True
    return False


def into_upper(r: Record, j: int) -> float:
    """Depth in the wall before the upper stop, from 0 at the edge to 1 at the stop [-]."""
    ahead = most(r[Q + j], r[Q + j] + WALL_AHEAD_S * r[KNOWN + j])
    return within((ahead - r[UPPER + j]) / r[WALL] + 1.0, 0.0, 1.0)


def into_lower(r: Record, j: int) -> float:
    """Depth in the wall before the lower stop, from 0 at the edge to 1 at the stop [-]."""
    ahead = least(r[Q + j], r[Q + j] + WALL_AHEAD_S * r[KNOWN + j])
    return within((r[LOWER + j] - ahead) / r[WALL] + 1.0, 0.0, 1.0)


def bounded(r: Record, j: int, tau: float) -> float:
    """Torque [N·m] within the bounds of a joint; in a wall, torque towards the stop fades to carrying."""
    low, high = r[LOW + j], r[HIGH + j]
    if r[IN_WALL] != 0.0:
        p = r[CARRIED + j]
        high -= into_upper(r, j) * (high - most(p, low))
        low += into_lower(r, j) * (least(p, high) - low)
    return within(tau, low, high)


def price(r: Record, speed: int) -> None:
    """Write the torque of `TAU` beyond the plausible weight, and beyond friction in the direction of motion [N·m].

    `speed` is the place of the joints' speeds: `KNOWN`, or `AHEAD`.
    """
    for j in range(int(r[N])):
        over = r[TAU + j] - r[CARRIED + j]
        if over * r[speed + j] > 0.0:
            over = most(0.0, over - r[FRICTION + j]) if over > 0.0 else least(0.0, over + r[FRICTION + j])
        r[OVER + j] = over


def spare(r: Record, ahead: float) -> None:
    """Reduce the power into the person beyond carrying and friction to its limit.

    With `ahead` 0, power counts at the present speeds. With 1 it counts at the speeds that the joints will have when
    their excess can be gone: braking would drive a joint that bounces off, and torque may change only at its rate.
    """
    for j in range(int(r[N])):
        ahead_s = ahead * (SPEED_FILTER_S + abs(r[TAU + j] - r[CARRIED + j]) / r[RATE])
        r[AHEAD + j] = r[KNOWN + j] + ahead_s * r[SLOPE + j]
    price(r, AHEAD)
    power, allowed = 0.0, most(0.0, r[POWER_MAX])
    for j in range(int(r[N])):
        power += most(0.0, r[OVER + j] * r[AHEAD + j])
    if power > allowed:
        give_back(r, AHEAD, 1.0 - allowed / power)


def give_back(r: Record, speed: int, share: float) -> None:
    """Take a share of the excess from the torque of each joint that its excess drives."""
    for j in range(int(r[N])):
        if r[OVER + j] * r[speed + j] > 0.0:
            r[TAU + j] = r[TAU + j] - share * r[OVER + j]


def afford(r: Record) -> None:
    """Reduce the power into the person to what the energy tank can pay for.

    The excess a_j over carrying, at the speed v_j, can be taken back no faster than torque may change. Until it is gone
    it spends a_j² |v_j| / (2 rate). That much energy must be in the tank, so that the tank is empty only when no excess
    is left.
    """
    price(r, KNOWN)
    needed = 0.0
    for j in range(int(r[N])):
        if r[OVER + j] * r[KNOWN + j] > 0.0:
            needed += r[OVER + j] * r[OVER + j] * abs(r[KNOWN + j])
    needed /= 2.0 * r[RATE]
    # In this order an energy that is not a number counts as an empty tank.
    has = most(0.0, r[ENERGY])
    if needed > has:
        give_back(r, KNOWN, 1.0 - math.sqrt(has / needed))


def pay(r: Record) -> None:
    """Take the energy of the outgoing torque from the tank, or add the energy of braking."""
    refill, fullest = r[PATH_W], r[TANK_MAX]
    if r[DRIVEN] != 0.0:
        refill, fullest = most(refill, r[DRIVEN_W]), most(fullest, r[DRIVEN_J])
    price(r, KNOWN)
    power = -refill
    for j in range(int(r[N])):
        power += r[OVER + j] * r[KNOWN + j]
    r[ENERGY] = least(r[ENERGY] - r[DT] * power, fullest)


# --- envelope ---------------------------------------------------------------------------------------------------------


def trip(r: Record, reason: int, without_model: bool) -> None:
    """Start the soft descent. The first reason stays; a later call can only remove the model."""
    if r[STOP] == 0.0:
        r[STOP] = reason
        for j in range(int(r[N])):
            top, push = r[TORQUE_MAX + j], r[PUSH + j] if r[WORN] != 0.0 else 0.0
            low, high = most(-top, least(0.0, push)), least(top, most(0.0, push))
            pushed = within(r[TAU + j] - r[CARRIED + j] + push, low, high)
            r[PUSH_AT_STOP + j], r[TAU_AT_STOP + j] = pushed, within(r[TAU + j] - pushed, -top, top)
    r[WITHOUT_MODEL] = 1.0 if without_model else r[WITHOUT_MODEL]


def isolate(r: Record, j: int, is_powerless: bool) -> None:
    """Trust the encoder of a joint no more: its drive brakes it. A powerless joint gets no torque either."""
    r[ISOLATED + j], r[POWERLESS + j] = 1.0, 1.0 if is_powerless else r[POWERLESS + j]


def leave_stop(r: Record) -> None:
    """Leave the latched stop. Torque goes on from the value that the descent has reached."""
    r[STOP] = r[SINCE_STOP] = r[WITHOUT_MODEL] = 0.0
    for j in range(int(r[N])):
        r[ISOLATED + j] = r[POWERLESS + j] = 0.0


def begin_torque(r: Record) -> None:
    """Start the rate limit from the torque `DESIRED` that the machine already gives."""
    # A machine that does not report its torque gives NaN. Every limit and the descent would let NaN through.
    for j in range(int(r[N])):
        tau = r[DESIRED + j]
        r[TAU + j] = within(tau, -r[TORQUE_MAX + j], r[TORQUE_MAX + j]) if math.isfinite(tau) else 0.0


def believe(r: Record) -> None:
    """Take the given positions and velocities if they are finite; an isolated joint stands still."""
    n = int(r[N])
    is_q, is_v = True, True
    for j in range(n):
        if r[ISOLATED + j] != 0.0:
            r[Q_GIVEN + j], r[V_GIVEN + j] = r[Q + j], 0.0
        # Minimum and maximum would hide a NaN, so every value is tested.
        is_q = is_q and math.isfinite(r[Q_GIVEN + j])
        is_v = is_v and math.isfinite(r[V_GIVEN + j])
    if not (is_q and is_v):
        trip(r, NO_MEASUREMENT, False)
    for j in range(n):
        if is_q:  # non-finite positions leave the last ones in force
            r[Q + j] = r[Q_GIVEN + j]
        r[V + j] = r[V_GIVEN + j] if is_v else 0.0


def watch(r: Record, fastest: float) -> None:
    """Stop on a non-finite request, beyond a stop, and at too high a speed."""
    worn, is_finite = r[WORN] != 0.0, True
    for j in range(int(r[N])):
        is_finite = is_finite and math.isfinite(r[DESIRED + j])
    if not is_finite:
        trip(r, NOT_FINITE, False)
    elif worn and r[IN_WALL] != 0.0 and is_past_a_stop(r):
        trip(r, PAST_A_STOP, False)
    v_trip = least(r[V_TRIP], r[V_TRIP_PERSON]) if worn else r[V_TRIP]
    if fastest > v_trip:
        trip(r, TOO_FAST, False)
        # Such a joint is left to its drive: no command has held it, and its motor or its encoder may be wrong.
        for j in range(int(r[N])):
            if abs(r[V + j]) > v_trip:
                isolate(r, j, True)


def descend(r: Record) -> None:
    """Write the torque of the soft descent to `WANTED`: the torque at the stop fades to zero, a push earlier."""
    r[SINCE_STOP] += r[DT]
    share = most(0.0, 1.0 - r[SINCE_STOP] / r[DESCENT_S])
    push_share = most(0.0, 1.0 - r[SINCE_STOP] / least(PUSH_ENDS_S, r[DESCENT_S]))
    for j in range(int(r[N])):
        is_dropped = r[WITHOUT_MODEL] != 0.0 or r[POWERLESS + j] != 0.0
        r[WANTED + j] = 0.0 if is_dropped else r[TAU_AT_STOP + j] * share + r[PUSH_AT_STOP + j] * push_share


def brake(r: Record, j: int) -> float:
    """Damping torque of one joint [N·m].

    In a descent it damps all motion. Otherwise it damps speed beyond the limit, and motion into the wall before a stop.
    """
    v = r[V + j]
    if r[STOP] != 0.0:
        return (WITHOUT_MODEL_SHARE if r[WITHOUT_MODEL] != 0.0 else 1.0) * r[DAMPING + j] * v
    speed = most(abs(v) - r[V_DAMPING], 0.0)
    if r[WORN] != 0.0:
        speed = most(speed, (into_upper(r, j) if v > 0.0 else into_lower(r, j)) * abs(v))
    return math.copysign(r[DAMPING + j] * speed, v)


def bound_and_brake(r: Record, brakes: bool) -> None:
    """Write to `TAU` the wanted torque within the person's bounds, minus braking; `LAST_TAU` keeps the last one."""
    worn = r[WORN] != 0.0
    for j in range(int(r[N])):
        r[LAST_TAU + j] = r[TAU + j]
        tau = bounded(r, j, r[WANTED + j]) if worn else r[WANTED + j]
        if brakes:
            # Braking follows the bounds. Before them, a demand of control beyond the bounds would cancel the brake.
            braking = brake(r, j)
            r[WANTED + j] -= braking
            tau = within(tau - braking, r[LOW + j], r[HIGH + j]) if worn else r[WANTED + j]
        r[TAU + j] = tau


def limit_rate(r: Record) -> bool:
    """Limit `TAU` to the drives' torque and to the torque rate; return True if it is not the wanted torque."""
    is_clipped, step = False, r[RATE] * r[DT]
    for j in range(int(r[N])):
        last, bound = r[LAST_TAU + j], r[TORQUE_MAX + j]
        r[TAU + j] = within(within(r[TAU + j], -bound, bound), last - step, last + step)
        is_clipped = is_clipped or r[TAU + j] != r[WANTED + j]
    return is_clipped


def follow(r: Record, fastest: float) -> None:
    """Update the speeds in use and their slope."""
    r[FASTEST] = fastest
    for j in range(int(r[N])):
        # Friction at an incredible speed would lift every bound, and its power would empty the tank for good.
        speed = r[V + j] if fastest <= V_CREDIBLE_RAD_S else 0.0
        slope = r[SLOPE + j] + ((speed - r[KNOWN + j]) - r[DT] * r[SLOPE + j]) / (SPEED_FILTER_S + r[DT])
        # An isolated joint counts as standing still from one tick to the next; that is no deceleration.
        r[SLOPE + j], r[KNOWN + j] = slope if r[ISOLATED + j] == 0.0 else 0.0, speed


def limit(r: Record, w: Record) -> None:
    """Write to `TAU` the torque that may go out [N·m], for `DESIRED`, `Q_GIVEN` and `V_GIVEN`."""
    believe(r)
    n, worn, fastest = int(r[N]), r[WORN] != 0.0, 0.0
    for j in range(n):
        fastest = most(fastest, abs(r[V + j]))
    follow(r, fastest)
    if worn:
        look(r, w)
    watch(r, fastest)
    if r[STOP] != 0.0:
        descend(r)
    else:
        for j in range(n):
            r[WANTED + j] = r[DESIRED + j]
    bound_and_brake(r, r[STOP] != 0.0 or fastest > r[V_DAMPING] or (worn and r[IN_WALL] != 0.0))
    if worn:
        spare(r, 0.0)
        spare(r, 1.0)
        afford(r)
    is_clipped = limit_rate(r)
    if worn:
        pay(r)
    if r[STOP] == 0.0 and is_clipped:
        r[CLIPPED] += 1.0


# --- ingress ----------------------------------------------------------------------------------------------------------


def take_in(r: Record) -> None:
    """Check the measurement of one tick, and set `USABLE`, `JUMPED`, `DEAD` and `BROKEN`."""
    slots = int(r[USED_SLOTS])
    ignore_isolated(r, slots)
    r[USABLE] = 0.0
    if r[CAME] == 0.0:
        return
    if r[SEQUENCE_IN] <= r[SEQUENCE]:
        r[DROPPED] += 1.0
        return
    r[SEQUENCE] = r[SEQUENCE_IN]
    # A time in the future is not of this clock, and would excuse any jump.
    if not abs(r[NOW] - r[T_IN]) <= AGE_MAX_S:
        return
    if is_broken(r) or has_jumped(r) or is_frozen(r):
        return
    at = (int(r[USED_AT]) + 1) % slots
    r[USED_AT], r[T_USED], r[USABLE] = at, r[T_IN], 1.0
    for j in range(int(r[N])):
        r[USED + at * JOINTS + j] = math.nan if r[IGNORED + j] != 0.0 else r[Q_IN + j]
        r[DEAD + j] = 1.0 if is_dead(r, j, at, slots) or is_stuck(r, j) else 0.0


def ignore_isolated(r: Record, slots: int) -> None:
    """Forget the positions of newly isolated joints: their motion is unknown when their values are trusted again."""
    for j in range(int(r[N])):
        r[JUMPED + j] = r[DEAD + j] = r[BROKEN + j] = 0.0
        if r[ISOLATED + j] != 0.0 and r[IGNORED + j] == 0.0:
            for k in range(slots):
                r[USED + k * JOINTS + j] = math.nan
        r[IGNORED + j] = r[ISOLATED + j]


def is_broken(r: Record) -> bool:
    """Return True if a trusted joint has a non-finite position or torque; `BROKEN` names the joints."""
    is_any = False
    for j in range(int(r[N])):
        torque = r[CURRENT_IN + j] if r[IN_CURRENT] != 0.0 else r[TAU_IN + j]
        if r[IGNORED + j] == 0.0 and not (math.isfinite(r[Q_IN + j]) and math.isfinite(torque)):
            r[BROKEN + j] = 1.0
            is_any = True
    return is_any


def has_jumped(r: Record) -> bool:
    """Return True if a joint moved farther since the last use than it can; the third time in a row is a fault."""
    last, is_far = USED + int(r[USED_AT]) * JOINTS, False
    ticks = whole((r[T_IN] - r[T_USED]) / r[DT])
    for j in range(int(r[N])):
        # After a first jump only the speed extends the reach, without the encoder count. Otherwise a small jump would
        # come within reach before the third tick.
        reach = ticks * r[WAY] + r[SLACK + j] if r[JUMPS + j] != 0.0 else ticks * r[REACH + j]
        # A comparison with NaN is false: a joint that is ignored, or was not seen yet, has not jumped.
        if r[IGNORED + j] == 0.0 and abs(r[Q_IN + j] - r[last + j]) > reach:
            r[JUMPS + j] += 1.0
            is_far = True
        else:
            r[JUMPS + j] = 0.0
    if is_far:
        for j in range(int(r[N])):
            r[JUMPED + j] = 1.0 if r[JUMPS + j] >= JUMPS_MAX else 0.0
    return is_far


def is_frozen(r: Record) -> bool:
    """Return True if the signals of all trusted joints have kept all bits for so long that their image is frozen.

    A machine whose signals have no noise is not judged: it may stand still to the last bit.
    """
    is_any, is_long, chance = False, True, 1.0
    for j in range(int(r[N])):
        keep(r, j)
        if r[IGNORED + j] == 0.0:
            is_any, chance = True, chance * r[KEPT_CHANCE + j]
            is_long = is_long and r[KEPT_TICKS + j] >= r[FROZEN_MOST]
    return is_any and is_long and chance < UNLIKELY


def keep(r: Record, j: int) -> None:
    """Update how long the signals of a joint have kept all bits, and the chance of that with intact sensors."""
    q, motor = r[Q_IN + j], r[Q_MOTOR_IN + j] if r[HAS_MOTOR] != 0.0 else 0.0
    torque = r[CURRENT_IN + j] if r[IN_CURRENT] != 0.0 else r[TAU_IN + j]
    change = torque - r[TORQUE_KEPT + j]
    # Comparisons with NaN are false: a joint that was not seen yet has not kept its bits.
    is_kept = change == 0.0 and q == r[Q_KEPT + j] and (motor == r[MOTOR_KEPT + j] or math.isnan(motor))
    r[Q_KEPT + j], r[MOTOR_KEPT + j], r[TORQUE_KEPT + j] = q, motor, torque
    r[KEPT_SEEN + j] = least(r[KEPT_SEEN + j] + 1.0, TICKS_MOST)
    step = most(r[NOISE_STEP], 1.0 / most(1.0 + r[KEPT_SEEN + j], 1.0))  # at first all ticks have the same weight
    r[KEPT_SHARE + j] += step * ((1.0 if is_kept else 0.0) - r[KEPT_SHARE + j])
    if is_kept:
        r[KEPT_TICKS + j] += 1.0
        if r[TURNS + j] >= LEAST_TURNS and r[KEPT_SEEN + j] - r[KEPT_TICKS + j] >= LEAST_SEEN:
            r[KEPT_CHANCE + j] = most(r[KEPT_CHANCE + j] * r[KEPT_SHARE + j], UNLIKELY * UNLIKELY)
    else:
        r[KEPT_TICKS + j], r[KEPT_CHANCE + j] = 0.0, 1.0
    if change > 0.0 or change < 0.0:
        turned = 1.0 if change * r[CHANGE_BEFORE + j] < 0.0 else 0.0
        r[TURNS + j] += step * (turned - r[TURNS + j])
        r[CHANGE_BEFORE + j] = change


def is_stuck(r: Record, j: int) -> bool:
    """Return True if the image of one trusted joint is frozen."""
    return r[IGNORED + j] == 0.0 and r[KEPT_TICKS + j] >= r[FROZEN_JOINT] and r[KEPT_CHANCE + j] < UNLIKELY


def is_dead(r: Record, j: int, at: int, slots: int) -> bool:
    """Return True if the encoder of a joint has frozen after a clear motion."""
    q, oldest = r[USED + at * JOINTS + j], at + 1
    still = r[USED + (oldest + int(r[MOVING])) % slots * JOINTS + j]
    if not (q == still and abs(q - r[USED + oldest % slots * JOINTS + j]) >= r[LEAST_WAY + j]):
        return False
    for k in range(int(r[MOVING]), slots):  # noqa: SIM110 - a generator has no translation to C
        if r[USED + (oldest + k) % slots * JOINTS + j] != q:
            return False
    return True


# --- monitors ---------------------------------------------------------------------------------------------------------


def compare(r: Record) -> None:
    """Compare redundant signals of a used measurement, and set `FAULTY`, `PARTED` and `WRONG`."""
    for j in range(int(r[N])):
        r[FAULTY + j], r[PARTED + j], r[WRONG + j] = r[FAULTY_IN + j], 0.0, 0.0
    if r[HAS_MOTOR] != 0.0:
        compare_encoders(r)
    if r[TOLD_COUNT] >= r[LATELY]:
        compare_torques(r)
    for j in range(int(r[N])):
        if r[ISOLATED + j] != 0.0:
            r[FAULTY + j] = r[PARTED + j] = r[WRONG + j] = 0.0


def compare_encoders(r: Record) -> None:
    """Find joints whose two encoders have disagreed for some time: in distance or direction, or one stands still."""
    slots, at = int(r[SPEED]) + 1, (int(r[BEFORE_AT]) + 1) % (int(r[SPEED]) + 1)
    r[BEFORE_AT], r[BEFORE_COUNT] = at, least(r[BEFORE_COUNT] + 1.0, float(slots))
    oldest = (at + 1) % slots if r[BEFORE_COUNT] == slots else 0
    for j in range(int(r[N])):
        q, motor = r[Q_IN + j], r[Q_MOTOR_IN + j]
        r[BEFORE + at * JOINTS + j], r[MOTOR_BEFORE + at * JOINTS + j] = q, motor
        if math.isnan(r[FIRST + j]):
            r[FIRST + j] = q - motor
        way, motor_way = q - r[BEFORE + oldest * JOINTS + j], motor - r[MOTOR_BEFORE + oldest * JOINTS + j]
        is_opposite = way * motor_way < 0.0 and least(abs(way), abs(motor_way)) > r[LEAST_OPPOSITE]
        is_apart = is_opposite or abs(q - motor - r[FIRST + j]) > AGREE_RAD
        r[PARTED_TICKS + j] = r[PARTED_TICKS + j] + 1.0 if is_apart else 0.0
        r[STILL + j] = r[STILL + j] + 1.0 if q == r[LAST + j] else 0.0
        if r[STILL + j] == 0.0:
            r[MOTOR_THEN + j] = motor
        stands = r[STILL + j] >= r[STILL_MOST] and abs(motor - r[MOTOR_THEN + j]) > STILL_WAY_RAD
        r[PARTED + j] = 1.0 if stands or r[PARTED_TICKS + j] >= r[IN_A_ROW] else 0.0
        r[LAST + j] = q


def compare_torques(r: Record) -> None:
    """Find joints whose measured torque differs from the commanded one, for some ticks or on average."""
    newest = TOLD + int(r[TOLD_AT]) * JOINTS
    for j in range(int(r[N])):
        tau = r[GAIN + j] * (r[CURRENT_IN + j] if r[BY_GAIN] != 0.0 else r[TAU_IN + j])
        off = tau - r[newest + j]
        size = abs(off)  # this test is quicker than the one over all recent commands
        is_off = size > TORQUE_OFF_NM and abs(off_lately(r, j, tau, int(r[LATELY]))) > TORQUE_OFF_NM
        r[OFF_TICKS + j] = r[OFF_TICKS + j] + 1.0 if is_off else 0.0
        if size > 0.5 * TORQUE_BIAS_NM:
            off = off_lately(r, j, tau, int(r[SLOWEST]))
        # A non-finite torque is a matter of the ingress. An ignored joint must be watched again later, so its average
        # must stay finite.
        if size < math.inf:
            r[BIAS + j] += r[BIAS_SHARE] * (off - r[BIAS + j])
        is_wrong = r[OFF_TICKS + j] >= r[IN_A_ROW] or abs(r[BIAS + j]) > TORQUE_BIAS_NM
        r[WRONG + j] = 1.0 if is_wrong else 0.0


def off_lately(r: Record, j: int, tau: float, ticks: int) -> float:
    """Distance of a torque from the range of the last commands to the joint, not only from the newest [N·m]."""
    slots, at = int(r[SLOWEST]), int(r[TOLD_AT])
    low = high = r[TOLD + at * JOINTS + j]
    for k in range(1, min(ticks, int(r[TOLD_COUNT]))):
        told = r[TOLD + (at - k) % slots * JOINTS + j]
        low, high = least(low, told), most(high, told)
    return most(tau - high, 0.0) + least(tau - low, 0.0)


def tell(r: Record) -> None:
    """Record the torque that goes out."""
    slots = int(r[SLOWEST])
    at = (int(r[TOLD_AT]) + 1) % slots
    r[TOLD_AT], r[TOLD_COUNT] = at, least(r[TOLD_COUNT] + 1.0, float(slots))
    for j in range(int(r[N])):
        r[TOLD + at * JOINTS + j] = r[TAU + j]


def is_refused(r: Record) -> bool:
    """Return True if a slow joint was asked for much more torque than went out, for long."""
    is_long = False
    for j in range(int(r[N])):
        # Control's request does not count in a descent.
        refused = abs(r[HELD + j] - r[TAU + j]) if r[STOP] == 0.0 else 0.0
        is_much = refused > REFUSED_NM and abs(r[V_SEEN + j]) < SLOW_RAD_S
        r[REFUSED_TICKS + j] = r[REFUSED_TICKS + j] + 1.0 if is_much else 0.0
        is_long = is_long or r[REFUSED_TICKS + j] > r[REFUSED_MOST]
    return is_long


# --- guard ------------------------------------------------------------------------------------------------------------


def forget_misses(r: Record, at: int) -> None:
    """Forget all missed ticks."""
    r[at] = r[at + 1] = 0.0
    for k in range(MISSES):
        r[at + 2 + k] = LONG_AGO


def misses_too_many(r: Record, at: int, is_missed: bool) -> bool:
    """Add one tick; return True if it is missed and the bridge ends with it."""
    r[at] += 1.0
    if not is_missed:
        return False
    newest = (int(r[at + 1]) + 1) % MISSES
    r[at + 1] = newest
    r[at + 2 + newest] = r[at]
    in_window = in_second = 0
    for k in range(MISSES):
        ago = r[at] - r[at + 2 + k]
        in_window += 1 if ago < r[WINDOW] else 0
        in_second += 1 if ago < r[SECOND] else 0
    return in_window > r[IN_WINDOW] or in_second > IN_SECOND_MAX


def begin(r: Record) -> None:
    """Forget the ticks before. The speed in force stays until the next measurement."""
    r[HAS_SPEED] = r[SPEED_T] = 0.0
    forget_misses(r, MACHINE_MISSES)
    forget_misses(r, CONTROL_MISSES)
    for j in range(int(r[N])):
        r[HELD + j] = r[V_FILTER + j] = 0.0


def approach_level(r: Record) -> None:
    """Move the gravity level one tick towards the requested one; a stop ends the ramp where it is.

    A level above 1 pushes the arm down. When the wearer's consent runs out, the level goes back to 1 as a ramp. In a
    wall, at a speed that needs damping, and in a stop the push ends within `PUSH_ENDS_S`; while the consent lasts, the
    ramp begins again afterwards.
    """
    is_free = r[STOP] == 0.0 and r[WORN] != 0.0
    r[CONSENT] = most(0.0, r[CONSENT] - r[DT]) if is_free else 0.0
    if r[CONSENT] == 0.0 and most(r[LEVEL], r[LEVEL_WANTED]) > 1.0:
        r[LEVEL_WANTED] = least(1.0, r[LEVEL_WANTED]) if r[LEVEL_MOVES] != 0.0 else 1.0
        r[LEVEL_STEP], r[LEVEL_MOVES] = r[DT] / GRAVITY_LEVEL_S, 1.0 if r[LEVEL] > 1.0 else r[LEVEL_MOVES]
    r[LEVEL_MOVES] = r[LEVEL_MOVES] if is_free else 0.0
    if r[LEVEL] > 1.0 and not (is_free and r[IN_WALL] == 0.0 and r[FASTEST] <= r[V_DAMPING]):
        fall = (GRAVITY_LEVEL_MAX - 1.0) / PUSH_ENDS_S * r[DT]
        r[LEVEL], r[LEVEL_MOVES] = most(1.0, r[LEVEL] - fall), 1.0 if is_free else 0.0
    elif r[LEVEL_MOVES] != 0.0 and abs(r[LEVEL_WANTED] - r[LEVEL]) <= r[LEVEL_STEP]:
        r[LEVEL], r[LEVEL_MOVES] = r[LEVEL_WANTED], 0.0
    elif r[LEVEL_MOVES] != 0.0:
        r[LEVEL] += math.copysign(r[LEVEL_STEP], r[LEVEL_WANTED] - r[LEVEL])


def filter_speeds(r: Record) -> None:
    """Update the guard's velocities: filtered differences of positions, independent of control's observer."""
    passed = most(r[T_IN] - r[SPEED_T], 0.5 * r[DT])
    share = passed / (SPEED_FILTER_S + passed)
    for j in range(int(r[N])):
        before = r[Q_FILTER + j] if r[HAS_SPEED] != 0.0 else r[Q_IN + j]  # the first tick has no speed
        r[V_FILTER + j] += share * ((r[Q_IN + j] - before) / passed - r[V_FILTER + j])
        r[Q_FILTER + j] = r[Q_SEEN + j] = r[Q_IN + j]
        r[V_SEEN + j] = r[V_FILTER + j]
    r[SPEED_T], r[HAS_SPEED] = r[T_IN], 1.0


def see(r: Record) -> None:
    """Run the first half of a tick: check the measurement; `USABLE` says if control may use it."""
    approach_level(r)
    take_in(r)
    for j in range(int(r[N])):
        if r[JUMPED + j] != 0.0 or r[DEAD + j] != 0.0:
            trip(r, ENCODER_JUMPED if r[JUMPED + j] != 0.0 else ENCODER_DEAD, False)
            isolate(r, j, False)
            forget_misses(r, MACHINE_MISSES)  # the next measurement is good again without this joint
    if r[USABLE] != 0.0:
        filter_speeds(r)
        if r[COMPARES] != 0.0:
            compare(r)
            act_on_comparison(r)


def act_on_comparison(r: Record) -> None:
    """Start the descent for what the comparison found, and isolate the joints."""
    n = int(r[N])
    for j in range(n):
        if r[FAULTY + j] != 0.0:
            trip(r, DRIVE_FAULT, False)
            isolate(r, j, False)
    for j in range(n):
        if r[PARTED + j] != 0.0:
            trip(r, ENCODERS_PART, False)
            isolate(r, j, False)
    for j in range(n):
        if r[WRONG + j] != 0.0:
            # A torque that differs from the command may have any cause, so torques of the model are not used then. The
            # motor of that joint gets no torque: it might turn the other way, and drive where damping is commanded.
            trip(r, TORQUE_WRONG, True)
            isolate(r, j, True)


def decide(r: Record, w: Record) -> None:
    """Run the second half of a tick: decide what goes out, with or without an answer of control."""
    n, is_any_broken = int(r[N]), False
    for j in range(n):
        is_any_broken = is_any_broken or r[BROKEN + j] != 0.0
    if misses_too_many(r, MACHINE_MISSES, r[USABLE] == 0.0):
        trip(r, NO_MEASUREMENT if is_any_broken else MACHINE_SILENT, False)
        for j in range(n):
            if r[BROKEN + j] != 0.0 or not is_any_broken:
                isolate(r, j, False)
    is_new = r[SPOKE] != 0.0 and r[ANSWERS] == r[SEQUENCE_IN] and r[NOW] <= r[VALID_UNTIL]
    r[BRIDGES] = 0.0 if r[USABLE] != 0.0 and is_new else 1.0
    # A missing measurement counts too. Otherwise control and machine could fail in turns, each within its bounds, and a
    # torque would be held on.
    if misses_too_many(r, CONTROL_MISSES, r[BRIDGES] != 0.0):
        trip(r, CONTROL_SILENT, False)
    for j in range(n):
        if r[BRIDGES] == 0.0:
            r[HELD + j] = r[ANSWER_IN + j]
        r[DESIRED + j], r[Q_GIVEN + j], r[V_GIVEN + j] = r[HELD + j], r[Q_SEEN + j], r[V_SEEN + j]
    limit(r, w)
    tell(r)
    if r[COMPARES] != 0.0 and is_refused(r):
        trip(r, NOT_THIS_ARM, False)
    r[SAFE_STATE] = safe_state(r)


def safe_state(r: Record) -> float:
    """Return the number of the safe state in force, as in `guard.SafeState`."""
    for j in range(int(r[N])):
        if r[ISOLATED + j] != 0.0:
            return 3.0
    if r[WITHOUT_MODEL] != 0.0:
        return 2.0
    if r[STOP] != 0.0:
        return 1.0
    return -1.0 if r[BRIDGES] == 0.0 else 0.0


def reset(r: Record) -> bool:
    """Leave the latched stop, and return True if that was possible.

    It is not possible while the arm comes down, while a joint moves, or while the machine sends no measurement.
    """
    n, is_some, stands, all_stand = int(r[N]), False, True, True
    for j in range(n):
        is_slow = abs(r[V_SEEN + j]) < STANDING_RAD_S
        all_stand = all_stand and is_slow
        if r[ISOLATED + j] == 0.0:
            is_some, stands = True, stands and is_slow
    # After a silence all joints are isolated. Then all must stand still by the measurements that arrive again.
    if r[USABLE] == 0.0 or r[SINCE_STOP] < r[DESCENT_S] or not (stands if is_some else all_stand):
        return False
    leave_stop(r)
    begin(r)
    return True
