"""Mock of ROS 2 in its own process: a router of Zenoh, and a client that listens and publishes by Zenoh alone.

Each message that arrives is printed as a line of JSON. A line `KEY HEX` on standard input is published.
"""

import json
import sys
import threading

import zenoh  # pyright: ignore[reportMissingImports] - the extra `ros2`

SAYING = threading.Lock()


def say(**what: object) -> None:
    with SAYING:
        print(json.dumps(what), flush=True)


def hear(sample: zenoh.Sample) -> None:
    beside = sample.attachment
    say(
        key=str(sample.key_expr),
        message=sample.payload.to_bytes().hex(),
        attachment=None if beside is None else beside.to_bytes().hex(),
    )


def meet(sample: zenoh.Sample) -> None:
    say(token=str(sample.key_expr), is_there=sample.kind == zenoh.SampleKind.PUT)


def main(port: str) -> None:
    config = {
        "mode": "router",
        "listen": {"endpoints": [f"tcp/localhost:{port}"]},
        "scouting": {"multicast": {"enabled": False}},
    }
    with zenoh.open(zenoh.Config.from_json5(json.dumps(config))) as session:
        kept = [
            session.declare_subscriber("0/**", hear),
            session.liveliness().declare_subscriber("@ros2_lv/**", meet, history=True),
        ]
        say(ready=len(kept))
        for line in sys.stdin:
            key, message = line.split()
            session.put(key, bytes.fromhex(message))


if __name__ == "__main__":
    main(sys.argv[1])
