"""Rate limit of requests before any handler: by address before a login, by login after it."""

import asyncio
import re
from collections.abc import Hashable

from starlette.requests import cookie_parser
from starlette.types import Scope

from .door import VISIT, Visit
from .keys import AccessKeys, PageSession, Role

BEFORE_LOGIN_PER_S, BEFORE_LOGIN_AT_ONCE = 200.0, 60
"""Rate and burst of requests from one address without a login. The page of the login loads four files."""

AFTER_LOGIN_PER_S, AFTER_LOGIN_AT_ONCE = 50.0, 150
"""Rate and burst of requests of one login: four pages at once."""

LINES_PER_S, LINES_AT_ONCE = 2.0, 10
"""Rate and burst of the lines that one login opens. A page opens one, and another one after a broken connection."""

SOURCES_MAX = 1024
"""Largest number of remembered sources. Sources that may send at once are forgotten first."""

TOKEN = re.compile(rb'"token" *: *"([\w-]{43})"', re.ASCII)
"""Token in the body of a login."""

FILES = "files"
"""Folder of the pages' files. Its cookie only says that the browser has logged in."""


class Turnstile:
    """Rate limit by source that delays, and does not refuse: a source waits only for itself, in order of arrival."""

    def __init__(self, per_s: float, at_once: int):
        """Let pass `at_once` requests of a source, then `per_s` in a second."""
        self._every_s, self._early_s = 1.0 / per_s, at_once / per_s
        self._due = dict[Hashable, float]()

    def wait_s(self, source: Hashable, t: float) -> float:
        """Count a request at `t` [s]; return the time that it has to wait [s]."""
        if len(self._due) >= SOURCES_MAX:
            self._due = {each: due for each, due in self._due.items() if due > t}
        due = max(self._due.get(source, t), t)
        self._due[source] = due + self._every_s
        return max(due - t - self._early_s, 0.0)


def cookie_name(role: Role | str, port: str) -> str:
    """Return the name of a role's cookie. It has the port, because consoles on other ports share all cookies."""
    return f"exograv-{role.value if isinstance(role, Role) else role}-{port}"


class Admission:
    """First station of each request: it finds the login of the connection, and delays what comes too fast."""

    def __init__(self, keys: AccessKeys, port: str):
        """Accept the cookies of `keys` for this port."""
        self._keys, self._port = keys, port
        self._newcomers = Turnstile(BEFORE_LOGIN_PER_S, BEFORE_LOGIN_AT_ONCE)
        self._known = Turnstile(AFTER_LOGIN_PER_S, AFTER_LOGIN_AT_ONCE)

    async def admit(self, scope: Scope) -> bool:
        """Wait for the turn of a request; return False if the role of its login has too many connections."""
        visit: Visit | None = scope.get("state", {}).get(VISIT)
        if visit is None:
            return True  # a request of a test, without a connection
        visit.has_asked = True
        session, t = self.login(scope), asyncio.get_running_loop().time()
        if session is not None and not visit.know(session):
            return False
        wait_s = self._newcomers.wait_s(visit.address, t) if session is None else self._known.wait_s(session, t)
        if wait_s > 0.0:
            await asyncio.sleep(wait_s)
        return True

    def login_of_head(self, head: bytes) -> PageSession | None:
        """Return the login of a request's head as it came from the network; None without one."""
        first, *lines = head.split(b"\r\n")
        named = (line.partition(b":") for line in lines)
        cookies = [value for name, _, value in named if name.lower() == b"cookie"]
        return self._login(first.split(b" ")[1].decode("latin-1"), cookies)

    def has_token(self, body: bytes) -> bool:
        """Return True if the body of a request holds the token of a valid link."""
        found = TOKEN.search(body)
        return found is not None and self._keys.has_token(found[1].decode("ascii"))

    def login(self, scope: Scope) -> PageSession | None:
        """Return the login of a request by the cookie of its folder; None without one."""
        return self._login(scope["path"], [value for name, value in scope["headers"] if name == b"cookie"])

    def _login(self, path: str, cookies: list[bytes]) -> PageSession | None:
        folder, said = path.split("/")[1], b"; ".join(cookies)
        cookie = cookie_parser(said.decode("latin-1")).get(cookie_name(folder, self._port))
        if cookie is None:
            return None
        if folder == FILES:
            folder, _, cookie = cookie.partition(":")
        return self._keys.session(Role(folder), cookie) if folder in {role.value for role in Role} else None
