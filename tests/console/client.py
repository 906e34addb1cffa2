"""Starlette's test client, and a login with it."""

import json
import warnings

from starlette.websockets import WebSocketDisconnect

from exograv.console.hub import Hub
from exograv.console.keys import Role

with warnings.catch_warnings():
    # Starlette warns that it prefers httpx2, the successor of the httpx that our lock pins.
    warnings.simplefilter("ignore")
    from starlette.testclient import TestClient as TestClient

HOST = "127.0.0.1:8088"
ORIGIN = f"http://{HOST}"
OURS = {"origin": ORIGIN, "x-exograv": "1"}
PAGE = "page-of-a-test"


def enter(client: TestClient, hub: Hub, role: Role) -> None:
    """Log in; the client keeps the cookie."""
    response = client.post("/enter", json={"token": hub.keys.token(role)}, headers=OURS)
    assert response.json() == {"role": role.value}


def ticket(client: TestClient, role: Role) -> str:
    return client.post(f"/{role.value}/ticket", headers=OURS).json()["ticket"]


def hello(client: TestClient, role: Role) -> str:
    return json.dumps({"kind": "hello", "ticket": ticket(client, role), "page": PAGE})


def closed_with(socket) -> int:
    """Read until the server closes the line; return the close code."""
    while True:
        try:
            socket.receive_json()
        except WebSocketDisconnect as end:
            return end.code
