"""Permissions of the roles: the only place that decides which role may send which message (hazard F36)."""

from .keys import Role
from .messages import ActMessage, Message

ACTS = (
    "don", "make_ready", "take_arm", "identify", "give_back", "stop", "reset", "switch_off", "set_level",
    "learn_rest", "agree", "note", "acknowledge",
)  # fmt: skip
"""Acts of the steered session."""

WORDS = (
    "ping", "beat", "steer", "seen", "invite", "touches", "trail", "calibrate", "latency", "run",
    *(f"do {act}" for act in ACTS),
)  # fmt: skip
"""Words of all messages after hello."""

EVERYBODY = frozenset({"ping", "do stop"})
"""Words of every role. Stop is accepted from every page."""

MAY: dict[Role, frozenset[str]] = {
    Role.OPERATOR: EVERYBODY
    | {"beat", "steer", "seen", "invite", "run", *(f"do {act}" for act in ACTS if act != "agree")},
    Role.THERAPIST: EVERYBODY
    | {"beat", "steer"}
    | {f"do {act}" for act in ("don", "make_ready", "take_arm", "give_back", "reset", "switch_off", "set_level")},
    Role.PARTICIPANT: EVERYBODY | {"touches", "trail", "calibrate", "latency", "do agree"},
    Role.VIEWER: EVERYBODY,
}

WITHOUT_LEASE = EVERYBODY | MAY[Role.PARTICIPANT] | {"steer", "beat", "invite"}
"""Words that need no lease. All other words are accepted from the steering page only."""


def word(message: Message) -> str:
    """Return the name of a message in the table."""
    return f"do {message.act.get('kind')}" if isinstance(message, ActMessage) else message.kind


def may_say(role: Role, message: Message) -> bool:
    """Return True if the role may send the message."""
    return word(message) in MAY[role]
