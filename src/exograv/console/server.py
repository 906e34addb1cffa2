"""Web application: a few pages, one login, one line per page. Every route is listed here."""

import asyncio
import contextlib
import re
from collections.abc import AsyncIterator
from pathlib import Path

from pydantic import ValidationError
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from exograv.model.rig_settings import Settings

from .broadcaster import Broadcaster
from .http_guard import HttpGuard
from .hub import Hub
from .keys import SESSION_S, PageSession, Role, TokenUse
from .limits import BODY_MAX_BYTES
from .line import serve_line
from .page_files import TYPES, page_files
from .sentences import say
from .turnstile import FILES, Admission, cookie_name

PAGE_OF = {
    Role.OPERATOR: "console.html",
    Role.VIEWER: "console.html",
    Role.THERAPIST: "therapist.html",
    Role.PARTICIPANT: "participant.html",
}
BANNER = "simulated.html"
"""Banner of every page of a simulated machine."""

BODY = re.compile(rb"<body[^>]*>\s*")
"""Begin of a page's content."""

MORE_OF_PARTICIPANT = ("screen", "latency")
"""Further pages for the participant's screen."""


class _Token(Settings):
    token: str


def application(hub: Hub, scheme: str, hosts: list[str]) -> ASGIApp:
    """Build the application behind its HTTP guard.

    Args:
        hub: State of the console.
        scheme: http on this computer, https in a network.
        hosts: Host names (with port) that requests may use.
    """
    port = hosts[0].rpartition(":")[2]
    house = _House(hub, scheme == "https", port)
    routes = [
        Route("/", house.front, methods=["GET"]),
        Route("/enter", house.enter, methods=["POST"]),
        *(Route(f"/files/{name}", house.file, methods=["GET"]) for name in house.files),
    ]
    for role in Role:
        routes += [
            Route(f"/{role.value}/", house.page, methods=["GET"], name=role.value),
            Route(f"/{role.value}/ticket", house.ticket, methods=["POST"], name=role.value),
        ]
    scenes = [Route(f"/{role.value}/scene", house.scene, methods=["GET"]) for role in (Role.OPERATOR, Role.VIEWER)]
    more = [Route(f"/participant/{name}", house.page, methods=["GET"]) for name in MORE_OF_PARTICIPANT]
    lines = [WebSocketRoute(f"/{role.value}/line", house.line) for role in Role]
    app = Starlette(routes=[*routes, *scenes, *more, *lines], lifespan=house.lifespan)
    app.router.redirect_slashes = False
    return HttpGuard(app, scheme, hosts, Admission(hub.keys, port))


class _House:
    """Handlers of all routes, behind the HTTP guard."""

    def __init__(self, hub: Hub, is_tls: bool, port: str):
        self._hub, self._is_tls, self._port = hub, is_tls, port
        self.files = page_files()

    @contextlib.asynccontextmanager
    async def lifespan(self, _: Starlette) -> AsyncIterator[None]:
        round_trip = asyncio.create_task(Broadcaster(self._hub).go_round())
        round_trip.add_done_callback(self._ended)
        try:
            yield
        finally:
            round_trip.cancel()
            await asyncio.gather(round_trip, return_exceptions=True)
            self._hub.close_down()

    def _ended(self, task: asyncio.Task[None]) -> None:
        error = None if task.cancelled() else task.exception()
        if isinstance(error, Exception):
            self._hub.fail(error)

    def _send(self, name: str) -> Response:
        body = self.files[name]
        if name.endswith(".html") and self._hub.shown.is_twin:
            # The server adds the banner, so that no page can lack it, also before a login.
            body = BODY.sub(lambda begin: begin[0] + self.files[BANNER], body, count=1)
        return Response(body, media_type=TYPES[Path(name).suffix])

    async def front(self, _: Request) -> Response:
        return self._send("enter.html")

    async def file(self, request: Request) -> Response:
        return self._send(request.url.path.removeprefix("/files/"))

    async def page(self, request: Request) -> Response:
        name, _, rest = request.url.path.strip("/").partition("/")
        role = Role(name)
        if self._session(request, role) is None:
            return PlainTextResponse("Log in with the link that the operator gives you.\n", 403)
        return self._send(f"{rest}.html" if rest else PAGE_OF[role])

    async def enter(self, request: Request) -> Response:
        address = request.client.host if request.client else ""
        body = await _body(request)
        try:
            token = "" if body is None else _Token.model_validate_json(body, strict=True).token
        except ValidationError:
            token = ""
        entered = self._hub.keys.enter(token, address)
        if isinstance(entered, TokenUse):
            if entered is TokenUse.REFUSED:
                self._hub.alarms.sound(say("alarm.wrong_link"), self._hub.desk.now(), "low")
            return JSONResponse({"why": entered.value}, 429 if entered is TokenUse.LOCKED else 403)
        role, cookie = entered
        response = JSONResponse({"role": role.value})
        # The second cookie shows the login when the pages' files are loaded, for the rate limit only.
        for folder, value in ((role.value, cookie), (FILES, f"{role.value}:{cookie}")):
            response.set_cookie(
                cookie_name(folder, self._port),
                value,
                max_age=int(SESSION_S),
                path=f"/{folder}/",
                secure=self._is_tls,
                httponly=True,
                samesite="strict",
            )
        return response

    async def ticket(self, request: Request) -> Response:
        session = self._session(request, Role(request.url.path.split("/")[1]))
        if session is None:
            return JSONResponse({"why": TokenUse.REFUSED.value}, 403)
        return JSONResponse({"ticket": self._hub.keys.ticket(session)})

    async def scene(self, request: Request) -> Response:
        """Send the picture of machine and person to pages that show the machine."""
        if self._session(request, Role(request.url.path.split("/")[1])) is None:
            return JSONResponse({"why": TokenUse.REFUSED.value}, 403)
        scene = await self._hub.ask_desk(self._hub.desk.scene)
        return Response("null" if scene is None else scene.text, media_type=TYPES[".json"])

    async def line(self, socket: WebSocket) -> None:
        role = Role(socket.url.path.split("/")[1])
        await serve_line(self._hub, socket, role, socket.cookies.get(cookie_name(role, self._port)))

    def _session(self, request: Request, role: Role) -> PageSession | None:
        return self._hub.keys.session(role, request.cookies.get(cookie_name(role, self._port)))


async def _body(request: Request) -> bytes | None:
    """Return the body of a POST; None if it is too long."""
    body = b""
    with contextlib.suppress(ClientDisconnect):
        async for part in request.stream():
            body += part
            if len(body) > BODY_MAX_BYTES:
                return None
    return body
