"""Page of your own that steers a session of `exograv run console`: log in, take the lease, make the machine ready.

python examples/console_page/page.py LINK
"""

import json
import sys
import time
from http.client import HTTPResponse
from typing import Any
from urllib.request import Request, urlopen

from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin


def post(address: str, body: Any, cookie: str = "") -> HTTPResponse:
    """Send a request as the console's own pages do; the server checks the header Origin."""
    origin = "/".join(address.split("/")[:3])
    headers = {"Origin": origin, "X-Exograv": "1", "Content-Type": "application/json", "Cookie": cookie}
    return urlopen(Request(address, json.dumps(body).encode(), headers))


def ask(line: ClientConnection, kind: str, answer: str, **fields: Any) -> Any:
    """Send a message and return the next message of the kind `answer`."""
    line.send(json.dumps({"kind": kind, **fields}))
    while True:
        message = json.loads(line.recv())
        if message["kind"] == answer:
            return message


def clock() -> float:
    """Time on this page's clock [s]."""
    return time.perf_counter() % 1e6


def measure_clock(line: ClientConnection) -> None:
    """Measure the delay of the line. The server needs it to know the age of each act."""
    asked = clock()
    ask(line, "ping", "pong", asked=asked)
    ask(line, "ping", "pong", asked=clock(), previous={"asked": asked, "back": clock()})


def main(link: str) -> None:
    """Log in, steer, make the machine ready, and send heartbeats for ten seconds."""
    origin, token = link.split("/#")
    cookie = post(f"{origin}/enter", {"token": token}).headers["Set-Cookie"].split(";")[0]
    ticket = json.load(post(f"{origin}/operator/ticket", None, cookie))["ticket"]
    address = f"{origin.replace('http', 'ws', 1)}/operator/line"
    with connect(address, origin=Origin(origin), additional_headers={"Cookie": cookie}) as line:
        ask(line, "hello", "welcome", ticket=ticket, page="my-page-1")
        measure_clock(line)
        print(ask(line, "steer", "answer", id="steer-0001"))
        seen = ask(line, "beat", "state")["shown"]["version"]
        act = {"kind": "make_ready"}
        print(ask(line, "do", "answer", id="ready-0001", made=clock(), seen_version=seen, act=act))
        for _ in range(50):
            line.send(json.dumps({"kind": "beat"}))
            time.sleep(0.2)


if __name__ == "__main__":
    main(sys.argv[1])
