"""Who may say what: the only table of it, and nothing that decides the same elsewhere (F36)."""

from .keys import Role
from .messages import ActMessage, Message

ACTS = (
    "don", "make_ready", "take_arm", "identify", "give_back", "stop", "reset", "switch_off", "set_level", "note",
    "acknowledge",
)  # fmt: skip
"""Of the steered session."""

WORDS = (
    "ping", "beat", "steer", "seen", "invite", "touches", "trail", "calibrate", "latency", "run",
    *(f"do {act}" for act in ACTS),
)  # fmt: skip
"""Everything that can be said after hello."""

EVERYBODY = frozenset({"ping", "do stop"})
"""Stop is heard from whoever came in."""

MAY: dict[Role, frozenset[str]] = {
    Role.OPERATOR: EVERYBODY | {"beat", "steer", "seen", "invite", "run", *(f"do {act}" for act in ACTS)},
    Role.THERAPIST: EVERYBODY
    | {"beat", "steer"}
    | {f"do {act}" for act in ("don", "make_ready", "take_arm", "give_back", "reset", "switch_off", "set_level")},
    Role.PARTICIPANT: EVERYBODY | {"touches", "trail", "calibrate", "latency"},
    Role.VIEWER: EVERYBODY,
}

WITHOUT_LEASE = EVERYBODY | MAY[Role.PARTICIPANT] | {"steer", "beat", "invite"}
"""What needs nobody at the helm: everything else is taken from the one page that steers."""


def word(message: Message) -> str:
    """Under which name the table has it."""
    return f"do {message.act.get('kind')}" if isinstance(message, ActMessage) else message.kind


def may_say(role: Role, message: Message) -> bool:
    """Whether somebody in this role may."""
    return word(message) in MAY[role]
