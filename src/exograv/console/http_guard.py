"""HTTP guard in front of every handler: it passes only requests of our own pages, under our own host name."""

from collections.abc import Iterable

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .limits import Close
from .page_files import SAID_WITH_EVERYTHING
from .turnstile import Admission

CSRF_HEADER = "x-exograv"
"""Header of every POST. A form of another site cannot set it."""

TOO_MANY = "This role has too many open connections. Close other pages.\n"


class HttpGuard:
    """Check of Host and Origin by exact lists, of methods and headers. Refused requests reach no handler (F35)."""

    def __init__(self, app: ASGIApp, scheme: str, hosts: Iterable[str], admission: Admission):
        """Pass to `app` the requests for these hosts (with port) from their own origin, at the rate of `admission`."""
        self._app, self._hosts, self._admission = app, frozenset(hosts), admission
        self._origins = frozenset(f"{scheme}://{host}" for host in self._hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on a request of our own pages, and reject any other request."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            is_refused = not await self._admission.admit(scope)
            if is_refused or self._why_not(Headers(scope=scope), needs_origin=True):
                # Refused before it is accepted: the client gets 403 and no upgrade.
                await send({"type": "websocket.close", "code": int(Close.POLICY)})
            else:
                await self._app(scope, receive, send)
        else:
            await self._http(scope, receive, send)

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers, method = Headers(scope=scope), scope["method"]
        if not await self._admission.admit(scope):
            await PlainTextResponse(TOO_MANY, 503, {"connection": "close"})(scope, receive, send)
            return
        why = self._why_not(headers, needs_origin=method not in ("GET", "HEAD"))
        if why is None and method == "POST" and headers.get(CSRF_HEADER) != "1":
            why = "Only the pages of this server may use it."

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(SAID_WITH_EVERYTHING)
            await send(message)

        if method not in ("GET", "HEAD", "POST"):
            app: ASGIApp = PlainTextResponse("Not allowed.\n", 405)
        else:
            app = self._app if why is None else PlainTextResponse(why + "\n", 403)
        await app(scope, receive, send_with_headers)

    def _why_not(self, headers: Headers, needs_origin: bool) -> str | None:
        # A duplicate header is refused, because different readers may take different copies.
        hosts, origins = headers.getlist("host"), headers.getlist("origin")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return "This server has another host name."
        if (needs_origin or origins) and (len(origins) != 1 or origins[0] not in self._origins):
            return "Only the pages of this server may use it."
        return None
