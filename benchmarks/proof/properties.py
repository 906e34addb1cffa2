"""Properties that are proved: which calls of the guard, from which states, and which promises hold after them."""

from dataclasses import dataclass

MACHINE, PERSON = "setting_of_machine", "setting_of_person"
HOLDS = (
    *("holds_torque", "holds_stop", "holds_torque_at_stop", "holds_push_at_stop", "holds_time", "holds_flags"),
    "holds_belief",
)
"""Claims that are assumed before a call and proved after it, so that they hold always."""

FIRST_HALF = (
    "holds_stop",
    "holds_torque_at_stop",
    "holds_push_at_stop",
    "promise_latch",
    "(r[Q_IN + j] - before) / passed",
)
SECOND_HALF = (
    *("holds_stop", "holds_torque_at_stop", "holds_push_at_stop", "holds_time", "holds_flags", "holds_belief"),
    "setting_of_machine",
    *("promise_rate", "promise_latch", "promise_void", "missed ticks stop", "promise_level_kept"),
)
"""Claims of a whole half of a tick: z3 has not decided them yet, because places make them mixed with integers."""


@dataclass(frozen=True)
class Property:
    """Calls of the guard with what is assumed before and promised after."""

    name: str
    calls: tuple[str, ...]
    promises: tuple[str, ...]
    holds: tuple[str, ...] = HOLDS
    settings: tuple[str, ...] = (MACHINE,)
    extra: tuple[str, ...] = ()
    """Further claims that are assumed before the calls."""
    always: tuple[str, ...] = ()
    """Arguments that are True; others are any."""
    joints: int | None = None
    """Number of joints; None for any number, of which any one is followed."""
    undecided: tuple[str, ...] = ()
    """Claims that z3 does not decide in time: listed in the report, tried with `--undecided` only, and no failure."""
    numbers: str = "ieee"
    """Arithmetic: "ieee" or "rounded"."""
    before_last: bool = False
    """True if the promises compare with the record before the last call, not before the first."""


def _kept(name: str, *calls: str, holds: tuple[str, ...] = HOLDS) -> Property:
    return Property(name, calls, (*holds, "promise_torque_kept", "promise_latch", "promise_level_kept"), holds)


PROPERTIES = (
    Property(
        "envelope",
        ("limit",),
        (*HOLDS, "promise_rate", "promise_latch", "promise_speed", "promise_finite_demand",
         "promise_level_kept"),
    ),
    Property(
        "second half of a tick",
        ("decide",),
        (*HOLDS, "promise_rate", "promise_latch", "promise_void", "missed ticks stop", "promise_level_kept"),
        undecided=SECOND_HALF,
    ),
    Property(
        "first half of a tick",
        ("see",),
        (*HOLDS, "promise_torque_kept", "promise_latch", "promise_level"),
        extra=("setting_of_level",), undecided=FIRST_HALF,
    ),
    Property("torque limits", ("limit_rate",), ("promise_limited",), holds=(), extra=("state_of_last",)),
    Property(
        "level",
        ("approach_level",),
        ("promise_level", "promise_level_between", "promise_consent", "promise_release", "promise_torque_kept"),
        extra=("setting_of_level",),
    ),
    Property("reset", ("reset",), (*HOLDS, "promise_torque_kept", "promise_reset", "promise_level_kept")),
    Property("descent", ("descend",), ("promise_descent",), extra=("state_of_stop",)),
    Property("duration of the descent", ("descend",), ("promise_progress",), joints=1, numbers="rounded"),
    Property(
        "descent goes on", ("descend", "descend"), ("promise_fading",), extra=("state_of_stop",), before_last=True,
    ),
    _kept("stop", "trip"),
    _kept("distrust of a joint", "isolate"),
    _kept("begin", "begin"),
    _kept("motion on a path", "drive"),
    _kept("measurement alone", "take_in"),
    Property("first torque", ("begin_torque",), (*HOLDS, "promise_first", "promise_latch")),
    Property("end of a stop", ("leave_stop",), (*HOLDS, "promise_torque_kept")),
    Property("stops of the joints", ("limit",), ("promise_stops",), settings=(MACHINE, PERSON)),
    Property("person's bounds", ("look",), ("promise_bounds",), settings=(MACHINE, PERSON), extra=("state_of_person",)),
    # `limit` asks for braking whenever a joint is in a wall.
    Property(
        "person's bounds between the walls", ("bound_and_brake",), ("promise_within",), settings=(MACHINE, PERSON),
        extra=("state_of_bounds", "state_between_walls"),
    ),
    Property(
        "person's bounds in a wall", ("bound_and_brake",), ("promise_within",), settings=(MACHINE, PERSON),
        extra=("state_of_bounds",), always=("brakes",),
    ),
)  # fmt: skip
