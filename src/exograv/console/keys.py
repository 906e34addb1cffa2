"""Who may come in: tokens that are used once, cookies they are swapped for, tickets that open one line."""

import enum
import hashlib
import hmac
import secrets
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

SECRET_BYTES = 32
"""256 bits."""

LINK_S = 900.0
"""In which a link that the operator made has to be opened [s]."""

SESSION_S = 12 * 3600.0
"""A day in the laboratory; then everybody logs in anew [s]."""

TICKET_S = 10.0
"""From asking for one to the first message on the line [s]."""

FAILURES_MAX = 5
"""In a minute, from one address; then nothing is heard of it until a minute has passed."""

FAILURE_S = 60.0
KEPT_MAX = 64
"""Of each kind: who asks for more throws out the oldest."""

Clock = Callable[[], float]
Held = TypeVar("Held")


class Role(enum.Enum):
    """As whom somebody comes in; the value is the path of the page."""

    OPERATOR = "operator"
    THERAPIST = "therapist"
    PARTICIPANT = "participant"
    VIEWER = "viewer"


@dataclass(frozen=True)
class PageSession:
    """Somebody who came in."""

    role: Role
    number: int
    """Counted from 1: what is recorded of it, for the cookie is a secret."""


class TokenUse(enum.Enum):
    """What became of a token; the value is for whoever gave it."""

    REFUSED = "This link is wrong, too old, or was used already. Ask the operator for a new one."
    LOCKED = "Too many wrong links came from here. Wait a minute."


class SecretStore(Generic[Held]):
    """Secrets by their hash: neither memory dumps nor the time of a comparison tell one."""

    def __init__(self, clock: Clock):
        """Empty; times are by this clock [s]."""
        self._clock, self._held = clock, dict[bytes, tuple[float, Held]]()

    def issue(self, held: Held, lasts_s: float) -> str:
        """A new secret for this."""
        secret = secrets.token_urlsafe(SECRET_BYTES)
        while len(self._held) >= KEPT_MAX:
            del self._held[next(iter(self._held))]
        self._held[_hashed(secret)] = self._clock() + lasts_s, held
        return secret

    def find(self, secret: str) -> Held | None:
        """What it is for; None if there is no such secret, or not any more."""
        place = self._place(secret)
        return None if place is None else self._held[place][1]

    def take(self, secret: str) -> Held | None:
        """The same, and the secret is used up."""
        place = self._place(secret)
        return None if place is None else self._held.pop(place)[1]

    def _place(self, secret: str) -> bytes | None:
        hashed, found = _hashed(secret), None
        for each, (until, _) in self._held.items():
            if hmac.compare_digest(each, hashed) and self._clock() <= until:
                found = each
        return found


def _hashed(secret: str) -> bytes:
    return hashlib.sha256(secret.encode("utf-8", "surrogatepass")).digest()


class AccessKeys:
    """All of them, of one server."""

    def __init__(self, clock: Clock):
        """Times are by this clock, which never goes back [s]."""
        self._clock = clock
        self._tokens = SecretStore[Role](clock)
        self._cookies = SecretStore[PageSession](clock)
        self._tickets = SecretStore[PageSession](clock)
        self._failures = dict[str, deque[float]]()
        self._sessions = 0

    def token(self, role: Role, lasts_s: float = LINK_S) -> str:
        """For one person, to come in once."""
        return self._tokens.issue(role, lasts_s)

    def enter(self, token: str, address: str) -> tuple[Role, str] | TokenUse:
        """Swap a token for a role and a cookie."""
        if self.is_locked(address):
            return TokenUse.LOCKED
        role = self._tokens.take(token)
        if role is None:
            self.note_failure(address)
            return TokenUse.REFUSED
        self._sessions += 1
        return role, self._cookies.issue(PageSession(role, self._sessions), SESSION_S)

    def session(self, role: Role, cookie: str | None) -> PageSession | None:
        """Whose cookie it is, if it is one of this role."""
        session = None if cookie is None else self._cookies.find(cookie)
        return session if session is not None and session.role is role else None

    def ticket(self, session: PageSession) -> str:
        """Opens one line, soon."""
        return self._tickets.issue(session, TICKET_S)

    def redeem(self, session: PageSession, ticket: str) -> bool:
        """Whether it opens a line of this session; it never does again."""
        return self._tickets.take(ticket) == session

    def note_failure(self, address: str) -> None:
        """Somebody there knows no secret."""
        while len(self._failures) >= KEPT_MAX and address not in self._failures:
            del self._failures[next(iter(self._failures))]
        self._failures.setdefault(address, deque(maxlen=FAILURES_MAX)).append(self._clock())

    def is_locked(self, address: str) -> bool:
        """Whether too many failures came from there within a minute."""
        times = self._failures.get(address, ())
        return len(times) == FAILURES_MAX and self._clock() - times[0] < FAILURE_S
