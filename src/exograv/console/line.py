"""Life of one line to a page, from the WebSocket upgrade to its close."""

import asyncio
import contextlib

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from .handlers import hear
from .hub import Hub, PageLine
from .keys import PageSession, Role
from .limits import HELLO_S, Close
from .messages import Hello, read_message

HEARD_AT_ONCE = 16
"""Largest number of messages that are handled at a time. Acts take a while, and pings must not wait for them."""


async def serve_line(hub: Hub, socket: WebSocket, role: Role, cookie: str | None) -> None:
    """Admit the page, then receive and send messages until one side closes the line."""
    session = hub.keys.session(role, cookie)
    if session is None or not hub.has_room(role):
        # Refused before any upgrade: the client gets 403.
        await socket.close(int(Close.POLICY))
        return
    hub.coming[role] += 1
    try:
        await asyncio.sleep(hub.openings.wait_s(session, hub.desk.now()))
        await socket.accept()
        hello = await _hello(hub, socket, session)
    finally:
        hub.coming[role] -= 1
    if hello is None:
        hub.count(Close.UNAUTHORISED)
        await _close(socket, Close.UNAUTHORISED)
        return
    line = hub.open(session, hello.page)
    line.say("welcome", role=role.value, line=line.number)
    try:
        await _until_it_ends(hub, socket, line)
    finally:
        hub.close(line)
        await _close(socket, line.end or Close.GOING_AWAY)


async def _hello(hub: Hub, socket: WebSocket, session: PageSession) -> Hello | None:
    """Return the first message, if it comes in time with a valid ticket."""
    try:
        message = read_message(await asyncio.wait_for(_receive(socket), HELLO_S))
    except (TimeoutError, WebSocketDisconnect):
        return None
    return message if isinstance(message, Hello) and hub.keys.redeem(session, message.ticket) else None


async def _receive(socket: WebSocket) -> str | bytes:
    event = await socket.receive()
    if event["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(event.get("code", 1005))
    text = event.get("text")
    return event["bytes"] if text is None else text


async def _until_it_ends(hub: Hub, socket: WebSocket, line: PageLine) -> None:
    tasks = {asyncio.create_task(_hear_all(hub, socket, line)), asyncio.create_task(_tell_all(socket, line))}
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)
    for task in done:
        task.result()


async def _hear_all(hub: Hub, socket: WebSocket, line: PageLine) -> None:
    answering = set[asyncio.Task[None]]()
    with contextlib.suppress(WebSocketDisconnect):
        while line.end is None and not line.outbox.is_full:
            text = await _receive(socket)
            task = asyncio.create_task(hear(hub, line, text))
            answering.add(task)
            # Handlers start in the order of arrival. A handler that does not wait for the machine is finished now.
            await asyncio.sleep(0)
            for each in [each for each in answering if each.done()]:
                answering.remove(each)
                each.result()
            if len(answering) >= HEARD_AT_ONCE:
                await asyncio.wait(answering, return_when=asyncio.FIRST_COMPLETED)
    # Requests that have begun are completed, even if the page has gone.
    if answering:
        await asyncio.wait(answering)


async def _tell_all(socket: WebSocket, line: PageLine) -> None:
    # A RuntimeError means that the server below has closed the line for a frame that was too long.
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        while line.end is None and not line.outbox.is_full:
            await socket.send_text(await line.outbox.next())
    line.end = line.end or (Close.POLICY if line.outbox.is_full else None)


async def _close(socket: WebSocket, why: Close) -> None:
    if socket.application_state is WebSocketState.CONNECTED and socket.client_state is WebSocketState.CONNECTED:
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await socket.close(int(why))
