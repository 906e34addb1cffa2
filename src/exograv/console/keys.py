"""Access keys of the console: single-use tokens, the cookies that replace them, and tickets that open one line."""

import enum
import hashlib
import hmac
import secrets
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

SECRET_BYTES = 32
"""Length of a secret: 256 bits."""

LINK_S = 900.0
"""Life of a link that the operator made [s]."""

SESSION_S = 12 * 3600.0
"""Life of a login [s]: a day in the laboratory."""

TICKET_S = 10.0
"""Life of a ticket, from its request to the first message on the line [s]."""

FAILURES_MAX = 5
"""Failures within `FAILURE_S` after which an address is locked."""

FAILURE_S = 60.0
"""Time in which failures are counted, and after which they expire [s]."""

KEPT_MAX = 64
"""Largest number of secrets of each kind. A further secret replaces the oldest."""

Clock = Callable[[], float]
Held = TypeVar("Held")


class Role(enum.Enum):
    """Role of a page; the value is the path of the page."""

    OPERATOR = "operator"
    THERAPIST = "therapist"
    PARTICIPANT = "participant"
    VIEWER = "viewer"


@dataclass(frozen=True)
class PageSession:
    """Login of one browser."""

    role: Role
    number: int
    """Number of the login from 1. It is recorded in place of the cookie, which is a secret."""


class TokenUse(enum.Enum):
    """Refusal of a token; the value is the text for the browser."""

    REFUSED = (
        "This link is wrong, too old, or was used already. Ask the operator for a new link; an operator starts the "
        "console again."
    )
    LOCKED = "Too many wrong links came from this address. Wait a minute."


class SecretStore(Generic[Held]):
    """Secrets by their hash: neither a memory dump nor the time of a comparison reveals a secret."""

    def __init__(self, clock: Clock):
        """Start empty; `clock` gives the time [s]."""
        self._clock, self._held = clock, dict[bytes, tuple[float, Held]]()

    def issue(self, held: Held, lasts_s: float) -> str:
        """Return a new secret for `held`, valid for `lasts_s` [s]."""
        secret = secrets.token_urlsafe(SECRET_BYTES)
        while len(self._held) >= KEPT_MAX:
            del self._held[next(iter(self._held))]
        self._held[_hashed(secret)] = self._clock() + lasts_s, held
        return secret

    def find(self, secret: str) -> Held | None:
        """Return the content of a secret; None if it is unknown or expired."""
        place = self._place(secret)
        return None if place is None else self._held[place][1]

    def take(self, secret: str) -> Held | None:
        """Return the content of a secret and delete the secret; None if it is unknown or expired."""
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
    """Tokens, cookies, tickets and failures of one server."""

    def __init__(self, clock: Clock):
        """Start without keys; `clock` is monotonic [s]."""
        self._clock = clock
        self._tokens = SecretStore[Role](clock)
        self._cookies = SecretStore[PageSession](clock)
        self._tickets = SecretStore[PageSession](clock)
        self._failures = dict[str, deque[float]]()
        self._sessions = 0

    def token(self, role: Role, lasts_s: float = LINK_S) -> str:
        """Return a token that lets one person log in once."""
        return self._tokens.issue(role, lasts_s)

    def enter(self, token: str, address: str) -> tuple[Role, str] | TokenUse:
        """Exchange a token for a role and a cookie."""
        if self.is_locked(address):
            return TokenUse.LOCKED
        role = self._tokens.take(token)
        if role is None:
            self.note_failure(address)
            return TokenUse.REFUSED
        self._sessions += 1
        return role, self._cookies.issue(PageSession(role, self._sessions), SESSION_S)

    def session(self, role: Role, cookie: str | None) -> PageSession | None:
        """Return the login of a cookie, if it has this role."""
        session = None if cookie is None else self._cookies.find(cookie)
        return session if session is not None and session.role is role else None

    def ticket(self, session: PageSession) -> str:
        """Return a ticket that opens one line within `TICKET_S`."""
        return self._tickets.issue(session, TICKET_S)

    def redeem(self, session: PageSession, ticket: str) -> bool:
        """Return True if the ticket opens a line of this session. The ticket is then used up."""
        return self._tickets.take(ticket) == session

    def note_failure(self, address: str) -> None:
        """Count a wrong secret from an address."""
        while len(self._failures) >= KEPT_MAX and address not in self._failures:
            del self._failures[next(iter(self._failures))]
        self._failures.setdefault(address, deque(maxlen=FAILURES_MAX)).append(self._clock())

    def is_locked(self, address: str) -> bool:
        """Return True if too many failures came from the address within `FAILURE_S`."""
        times = self._failures.get(address, ())
        return len(times) == FAILURES_MAX and self._clock() - times[0] < FAILURE_S
