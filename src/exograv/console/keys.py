"""Access keys of the console: single-use tokens, the cookies that replace them, and tickets that open one line.

A correct secret is always accepted: a wrong one from the same address locks nobody out. Secrets have 256 bits, so that
guesses need no lock. Wrong ones are counted for the alarm, and `gates` limits their rate.
"""

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
"""Wrong tokens of an address within `FAILURE_S` after which further ones raise no alarm."""

FAILURE_S = 60.0
"""Time in which failures are counted, and after which they expire [s]."""

KEPT_MAX = 64
"""Largest number of unused tokens, and of addresses with failures. A further one replaces the oldest."""

TICKETS_MAX = 8
"""Largest number of unused tickets of one login. A further one replaces the login's own oldest."""

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
    LOCKED = "Too many wrong links came from this address. A correct link still works."


class SecretStore(Generic[Held]):
    """Secrets by their hash: neither a memory dump nor the time of a comparison reveals a secret."""

    def __init__(self, clock: Clock, most: int):
        """Start empty.

        Args:
            clock: Function that returns the time [s].
            most: Largest number of secrets with the same content. A further one replaces the oldest of them.
        """
        self._clock, self._most, self._held = clock, most, dict[bytes, tuple[float, Held]]()

    def issue(self, held: Held, lasts_s: float) -> str:
        """Return a new secret for `held`, valid for `lasts_s` [s]."""
        secret = secrets.token_urlsafe(SECRET_BYTES)
        self.admit(secret, held, lasts_s)
        return secret

    def admit(self, secret: str, held: Held, lasts_s: float) -> None:
        """Accept a secret that was made elsewhere, for `held` and for `lasts_s` [s]."""
        now = self._clock()
        self._held = {place: each for place, each in self._held.items() if now <= each[0]}
        alike = [place for place, (_, each) in self._held.items() if each == held]
        for place in alike[: max(len(alike) - self._most + 1, 0)]:
            del self._held[place]
        self._held[_hashed(secret)] = now + lasts_s, held

    def has(self, secret: str) -> bool:
        """Return True if the secret is known and has not expired."""
        return self._place(secret) is not None

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


class CookieSigner:
    """Cookies that carry login and expiry under a signature (HMAC-SHA-256), in place of a table of logins.

    A server that replaces another one with the same key accepts its cookies, so that pages reconnect.
    """

    def __init__(self, clock: Clock, key: bytes):
        """Sign with `key` of 256 random bits; `clock` gives the time [s]."""
        self._clock, self._key = clock, key

    def issue(self, session: PageSession, lasts_s: float) -> str:
        """Return the cookie of a login, valid for `lasts_s` [s]."""
        said = f"{session.number}.{round(self._clock() + lasts_s)}"
        return f"{said}.{self._signature(session.role, said)}"

    def find(self, role: Role, cookie: str) -> PageSession | None:
        """Return the login of a cookie of this role; None if it is wrong or expired."""
        said, _, signature = cookie.rpartition(".")
        expected = self._signature(role, said)
        if not hmac.compare_digest(signature.encode("utf-8", "surrogatepass"), expected.encode("ascii")):
            return None
        number, until = said.split(".")
        return PageSession(role, int(number)) if self._clock() <= int(until) else None

    def _signature(self, role: Role, said: str) -> str:
        text = f"{role.value}.{said}".encode("utf-8", "surrogatepass")
        return hmac.new(self._key, text, hashlib.sha256).hexdigest()


class AccessKeys:
    """Tokens, cookies, tickets and failures of one server."""

    def __init__(self, clock: Clock, cookie_key: bytes | None = None, logins_before: int = 0):
        """Start without keys.

        Args:
            clock: Monotonic clock [s].
            cookie_key: Key of the cookies of an earlier server, which stay valid; None for a new key.
            logins_before: Number of logins of earlier servers with this key.
        """
        self._clock = clock
        self._tokens = SecretStore[Role](clock, KEPT_MAX)
        self._cookies = CookieSigner(clock, cookie_key or secrets.token_bytes(SECRET_BYTES))
        self._tickets = SecretStore[PageSession](clock, TICKETS_MAX)
        self._failures = dict[str, deque[float]]()
        self._sessions = logins_before

    def token(self, role: Role, lasts_s: float = LINK_S) -> str:
        """Return a token that lets one person log in once."""
        return self._tokens.issue(role, lasts_s)

    def admit(self, token: str, role: Role, lasts_s: float) -> None:
        """Accept a token that was made elsewhere; it lets one person log in once."""
        self._tokens.admit(token, role, lasts_s)

    def has_token(self, token: str) -> bool:
        """Return True if the token would let a person log in."""
        return self._tokens.has(token)

    def enter(self, token: str, address: str) -> tuple[Role, str] | TokenUse:
        """Exchange a token for a role and a cookie. A correct token is accepted after any number of wrong ones."""
        role = self._tokens.take(token)
        if role is None:
            return TokenUse.LOCKED if self._fails_often(address) else TokenUse.REFUSED
        self._sessions += 1
        return role, self._cookies.issue(PageSession(role, self._sessions), SESSION_S)

    def session(self, role: Role, cookie: str | None) -> PageSession | None:
        """Return the login of a cookie, if it has this role."""
        return None if cookie is None else self._cookies.find(role, cookie)

    def ticket(self, session: PageSession) -> str:
        """Return a ticket that opens one line within `TICKET_S`."""
        return self._tickets.issue(session, TICKET_S)

    def redeem(self, session: PageSession, ticket: str) -> bool:
        """Return True if the ticket opens a line of this session. The ticket is then used up."""
        return self._tickets.take(ticket) == session

    def _fails_often(self, address: str) -> bool:
        """Count a wrong token of an address; return True if too many came within `FAILURE_S`."""
        while len(self._failures) >= KEPT_MAX and address not in self._failures:
            del self._failures[next(iter(self._failures))]
        times, now = self._failures.setdefault(address, deque(maxlen=FAILURES_MAX)), self._clock()
        is_often = len(times) == FAILURES_MAX and now - times[0] < FAILURE_S
        times.append(now)
        return is_often
