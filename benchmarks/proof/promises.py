"""Promises of the guard, in the language of its source: `r` is the record after, `b` before, `j` any joint.

The prover reads these functions as it reads the guard, and a counterexample is run through them as Python.
"""
# ruff: noqa: F821 - the places of the record come from the guard's source (`source.py`)
# pyright: reportUndefinedVariable=false

import math

# --- settings, which Python checks before anything moves (`limits.py`, `guard.py`) ------------------------------------


def setting_of_machine(r: Record, j: int) -> bool:
    """Return True if `Limits` allows the settings: rate up to 10⁶ N·m/s, period 0.1–100 ms, descent up to 60 s."""
    return (
        0.0 < r[TORQUE_MAX + j] < math.inf
        and 0.0 < r[DAMPING + j] < math.inf
        and 0.0 < r[RATE] <= 1000000.0
        and 0.001 <= r[DESCENT_S] <= 60.0
        and 0.0001 <= r[DT] <= 0.1
        and 0.0 < r[V_TRIP] < math.inf
        and 0.0 < r[V_DAMPING] < math.inf
        and (r[WORN] == 0.0 or r[WALL] > 0.0)
    )


def setting_of_person(r: Record, j: int) -> bool:
    """Return True if `PersonLimits` allows the settings, and no torque or angle is above 1000 N·m or 1000 rad."""
    return (
        0.0 < r[ACTIVE + j] <= 1000.0
        and 0.0 < r[LEAST_ACTIVE + j] <= 3.0
        and 0.0 <= r[DRY + j] <= 1000.0
        and 0.0 <= r[VISCOUS + j] <= 1000.0
        and 0.0 <= r[ERROR + j] <= 1000.0
        and -1000.0 <= r[LOWER + j] <= r[FREE_LOWER + j] <= r[FREE_UPPER + j] <= r[UPPER + j] <= 1000.0
        and 0.0 < r[WALL] <= 1000.0
        and 0.0 <= r[PAST_STOP] <= 1000.0
        and r[V_TRIP_PERSON] > 0.0
    )


# --- claims that hold before and after every call ---------------------------------------------------------------------


def holds_torque(r: Record, j: int) -> bool:
    """Return True if the outgoing torque is finite and within the drive's limit."""
    return -r[TORQUE_MAX + j] <= r[TAU + j] <= r[TORQUE_MAX + j]


def holds_stop(r: Record, j: int) -> bool:
    """Return True if there is no stop, or the number of its reason is 1 to 15."""
    return r[STOP] == 0.0 or 1.0 <= r[STOP] <= 15.0


def holds_torque_at_stop(r: Record, j: int) -> bool:
    """Return True if the torque at the start of a descent is finite and within the drive's limit."""
    return r[STOP] == 0.0 or -r[TORQUE_MAX + j] <= r[TAU_AT_STOP + j] <= r[TORQUE_MAX + j]


def holds_push_at_stop(r: Record, j: int) -> bool:
    """Return True if the push at the start of a descent is finite and within the drive's limit."""
    return r[STOP] == 0.0 or -r[TORQUE_MAX + j] <= r[PUSH_AT_STOP + j] <= r[TORQUE_MAX + j]


def holds_time(r: Record, j: int) -> bool:
    """Return True if the time since the start of the descent is between 0 and 1e17 s."""
    return 0.0 <= r[SINCE_STOP] <= 1e17


def holds_flags(r: Record, j: int) -> bool:
    """Return True if each flag of the descent (joint isolated, joint without torque, no model) is 0 or 1."""
    return (
        (r[ISOLATED + j] == 0.0 or r[ISOLATED + j] == 1.0)
        and (r[POWERLESS + j] == 0.0 or r[POWERLESS + j] == 1.0)
        and (r[WITHOUT_MODEL] == 0.0 or r[WITHOUT_MODEL] == 1.0)
    )


def holds_belief(r: Record, j: int) -> bool:
    """Return True if the position and the speed that the guard uses are finite."""
    return math.isfinite(r[Q + j]) and math.isfinite(r[V + j])


def state_of_person(r: Record, j: int) -> bool:
    """Return True for a credible speed, as `limit` writes it."""
    return abs(r[KNOWN + j]) <= 1000.0


def state_of_table(r: Record, j: int) -> bool:
    """Return True for a plausible torque that is finite; assumed of `carried`, and not proved."""
    return abs(r[CARRIED + j]) <= 1000000.0


def state_between_walls(r: Record, j: int) -> bool:
    """Return True if no joint is in a wall."""
    return r[IN_WALL] == 0.0


def state_of_last(r: Record, j: int) -> bool:
    """Return True if the last torque is within the drive's limit (`holds_torque` before the tick)."""
    return -r[TORQUE_MAX + j] <= r[LAST_TAU + j] <= r[TORQUE_MAX + j]


def state_of_stop(r: Record, j: int) -> bool:
    """Return True in a stop."""
    return r[STOP] != 0.0


def state_of_bounds(r: Record, j: int) -> bool:
    """Return True for bounds as `look` writes them (`promise_bounds`)."""
    return (
        r[WORN] != 0.0
        and -math.inf < r[LOW + j] <= 0.0 <= r[HIGH + j] < math.inf
        and r[LOW + j] <= r[CARRIED + j] <= r[HIGH + j]
    )


def same(a: float, b: float) -> bool:
    """Return True if the numbers are equal, or both are NaN."""
    return a == b or (math.isnan(a) and math.isnan(b))


def setting_of_level(r: Record, j: int) -> bool:
    """Return True for what `Guard` writes: levels from 0 to 1.8, a step above 0, and a consent of up to 120 s."""
    is_level = 0.0 <= r[LEVEL] <= 1.8 and 0.0 <= r[LEVEL_WANTED] <= 1.8 and 0.000000001 <= r[LEVEL_STEP] <= 0.1
    return is_level and 0.0 <= r[CONSENT] <= 120.0


# --- promises ---------------------------------------------------------------------------------------------------------


def promise_rate(b: Record, r: Record, j: int) -> bool:
    """Return True if the torque changed by at most rate · period, in the guard's own floating-point arithmetic."""
    step = r[RATE] * r[DT]
    return b[TAU + j] - step <= r[TAU + j] <= b[TAU + j] + step


def promise_limited(b: Record, r: Record, j: int) -> bool:
    """Return True if the new torque is within torque and rate limit, for any result of earlier limits or NaN."""
    last, step = b[LAST_TAU + j], r[RATE] * r[DT]
    return -r[TORQUE_MAX + j] <= r[TAU + j] <= r[TORQUE_MAX + j] and last - step <= r[TAU + j] <= last + step


def promise_first(b: Record, r: Record, j: int) -> bool:
    """Return True if the rate limit starts from the machine's present torque, or from 0 if this is not finite."""
    tau, bound = b[DESIRED + j], r[TORQUE_MAX + j]
    is_inside = -bound <= tau <= bound
    return (not is_inside or r[TAU + j] == tau) and (math.isfinite(tau) or r[TAU + j] == 0.0)


def promise_torque_kept(b: Record, r: Record, j: int) -> bool:
    """Return True if the call does not change the outgoing torque."""
    return r[TAU + j] == b[TAU + j]


def promise_latch(b: Record, r: Record, j: int) -> bool:
    """Return True if the call does not end a stop, and keeps its reason, its torque and its distrusted joints."""
    return b[STOP] == 0.0 or (
        r[STOP] == b[STOP]
        and r[TAU_AT_STOP + j] == b[TAU_AT_STOP + j]
        and r[PUSH_AT_STOP + j] == b[PUSH_AT_STOP + j]
        and (b[ISOLATED + j] == 0.0 or r[ISOLATED + j] != 0.0)
        and (b[POWERLESS + j] == 0.0 or r[POWERLESS + j] != 0.0)
        and (b[WITHOUT_MODEL] == 0.0 or r[WITHOUT_MODEL] != 0.0)
        and r[SINCE_STOP] >= b[SINCE_STOP]
    )


def promise_reset(b: Record, r: Record, j: int) -> bool:
    """Return True if a stop ends only after the descent, with a usable measurement and every trusted joint at rest."""
    return (
        b[STOP] == 0.0
        or r[STOP] == b[STOP]
        or (
            b[USABLE] != 0.0
            and b[SINCE_STOP] >= b[DESCENT_S]
            and (b[ISOLATED + j] != 0.0 or abs(b[V_SEEN + j]) < STANDING_RAD_S)
        )
    )


def promise_progress(b: Record, r: Record, j: int) -> bool:
    """Return True if a tick advances the time of a descent by at least the period minus 1e-12 s, until its end."""
    return r[STOP] == 0.0 or b[SINCE_STOP] >= r[DESCENT_S] or r[SINCE_STOP] >= b[SINCE_STOP] + r[DT] - 1e-12


def promise_descent(b: Record, r: Record, j: int) -> bool:
    """Return True if a descent requests at most the torque at the stop, with the same sign, and zero at its end.

    A push that was part of that torque ends earlier.
    """
    has_push = r[PUSH_AT_STOP + j] != 0.0 and r[SINCE_STOP] < PUSH_ENDS_S
    is_part = has_push or abs(r[WANTED + j]) <= abs(r[TAU_AT_STOP + j])
    is_along = has_push or r[WANTED + j] == 0.0 or (r[WANTED + j] > 0.0) == (r[TAU_AT_STOP + j] > 0.0)
    is_nothing = r[SINCE_STOP] >= r[DESCENT_S] or r[WITHOUT_MODEL] != 0.0 or r[POWERLESS + j] != 0.0
    return is_part and is_along and (r[WANTED + j] == 0.0 or not is_nothing)


def promise_fading(b: Record, r: Record, j: int) -> bool:
    """Return True if a descent requests no larger torque than in the previous tick, unless a push ends."""
    has_push = r[PUSH_AT_STOP + j] != 0.0 and b[SINCE_STOP] < PUSH_ENDS_S
    return has_push or abs(r[WANTED + j]) <= abs(b[WANTED + j])


def promise_speed(b: Record, r: Record, j: int) -> bool:
    """Return True if a joint above the largest speed starts the descent. The guard gives this joint no torque."""
    is_fast = abs(r[V + j]) > r[V_TRIP] or (r[WORN] != 0.0 and abs(r[V + j]) > r[V_TRIP_PERSON])
    return not is_fast or (r[STOP] != 0.0 and r[ISOLATED + j] != 0.0 and r[POWERLESS + j] != 0.0)


def promise_finite_demand(b: Record, r: Record, j: int) -> bool:
    """Return True if a request, position or speed that is not finite starts the descent."""
    is_finite = math.isfinite(b[DESIRED + j]) and (
        b[ISOLATED + j] != 0.0 or (math.isfinite(b[Q_GIVEN + j]) and math.isfinite(b[V_GIVEN + j]))
    )
    return is_finite or r[STOP] != 0.0


def promise_stops(b: Record, r: Record, j: int) -> bool:
    """Return True if a joint of a worn machine that is too far beyond its mechanical stop starts the descent."""
    is_past = r[Q + j] > r[UPPER + j] + r[PAST_STOP] or r[Q + j] < r[LOWER + j] - r[PAST_STOP]
    return r[WORN] == 0.0 or not is_past or r[STOP] != 0.0


def promise_void(b: Record, r: Record, j: int) -> bool:
    """Return True if the requested torque changes only by a valid, timely request that answers this measurement."""
    is_valid = b[SPOKE] != 0.0 and b[ANSWERS] == b[SEQUENCE_IN] and b[NOW] <= b[VALID_UNTIL] and b[USABLE] != 0.0
    is_as_promised = same(r[HELD + j], b[ANSWER_IN + j] if is_valid else b[HELD + j])
    return is_as_promised and same(r[DESIRED + j], r[HELD + j])


def promise_level(b: Record, r: Record, j: int) -> bool:
    """Return True if the gravity level changes by at most one step, and not at all in a stop or without a wearer.

    From above 1 it may also fall to 1, by at most what ends the largest push in `PUSH_ENDS_S`.
    """
    step, now, before, wanted = abs(r[LEVEL_STEP]), r[LEVEL], b[LEVEL], r[LEVEL_WANTED]
    is_step = now == before + step or now == before - step or (now == wanted and abs(wanted - before) <= step)
    is_moving = (b[LEVEL_MOVES] != 0.0 or before > 1.0) and b[STOP] == 0.0 and b[WORN] != 0.0
    fall = before - (GRAVITY_LEVEL_MAX - 1.0) / PUSH_ENDS_S * r[DT]
    is_fall = before > 1.0 and (now == fall or (now == 1.0 and fall <= 1.0))
    return (is_moving and is_step) or is_fall or same(now, before)


def promise_level_between(b: Record, r: Record, j: int) -> bool:
    """Return True if the gravity level does not pass the requested one, except from above 1 down to 1."""
    now, before, wanted = r[LEVEL], b[LEVEL], r[LEVEL_WANTED]
    is_between = before <= now <= wanted or wanted <= now <= before
    return is_between or 1.0 <= now < before or same(now, before)


def promise_consent(b: Record, r: Record, j: int) -> bool:
    """Return True if a level above 1 rises only with consent, without a stop, between the walls, and at slow joints."""
    may = b[CONSENT] > 0.0 and b[STOP] == 0.0 and b[WORN] != 0.0
    is_raised = b[LEVEL] > 1.0 and r[LEVEL] > b[LEVEL]
    is_free = b[IN_WALL] == 0.0 and b[FASTEST] <= b[V_DAMPING]
    return not is_raised or (may and is_free)


def promise_release(b: Record, r: Record, j: int) -> bool:
    """Return True if a level above 1 falls fast in a stop, without a wearer, in a wall, and at a fast joint."""
    is_free = b[STOP] == 0.0 and b[WORN] != 0.0 and b[IN_WALL] == 0.0 and b[FASTEST] <= b[V_DAMPING]
    fallen = b[LEVEL] - (GRAVITY_LEVEL_MAX - 1.0) / PUSH_ENDS_S * b[DT]
    return b[LEVEL] <= 1.0 or is_free or r[LEVEL] == (fallen if fallen > 1.0 else 1.0)


def promise_level_kept(b: Record, r: Record, j: int) -> bool:
    """Return True if the call does not change the gravity level."""
    return same(r[LEVEL], b[LEVEL])


def promise_bounds(b: Record, r: Record, j: int) -> bool:
    """Return True if the person's bounds of a joint enclose zero and the torque that carries machine and arm."""
    return -math.inf < r[LOW + j] <= 0.0 <= r[HIGH + j] < math.inf and r[LOW + j] <= r[CARRIED + j] <= r[HIGH + j]


def promise_within(b: Record, r: Record, j: int) -> bool:
    """Return True if the outgoing torque is within the person's bounds."""
    return r[WORN] == 0.0 or r[LOW + j] <= r[TAU + j] <= r[HIGH + j]


def promise_back(b: Record, r: Record, j: int) -> bool:
    """Return True if the torque is within the person's bounds, or comes back to them as fast as it may."""
    step = r[RATE] * r[DT]
    return (
        r[WORN] == 0.0
        or r[LOW + j] <= r[TAU + j] <= r[HIGH + j]
        or (r[TAU + j] > r[HIGH + j] and r[TAU + j] == b[TAU + j] - step)
        or (r[TAU + j] < r[LOW + j] and r[TAU + j] == b[TAU + j] + step)
    )


def promise_stopped(b: Record, r: Record, j: int) -> bool:
    """Return True in a stop."""
    return r[STOP] != 0.0
