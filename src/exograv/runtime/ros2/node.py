"""Node of ROS 2, made of a session of Zenoh."""

import json
import secrets
import time
from collections.abc import Callable
from typing import Any

from exograv.errors import ConfigError

from .keys import GID_BYTES, PUBLISHER, SUBSCRIPTION, NodeTokens, attachment, topic_key
from .library import zenoh
from .messages import MessageType


def configuration(router: str) -> dict[str, Any]:
    """Return the relevant part of `rmw_zenoh_cpp`'s own configuration of a session.

    The session is a peer that other programs of this computer find by the router. There is no multicast, and nothing
    listens to the network outside. The connection to a missing router is retried for ever.

    Source: DEFAULT_RMW_ZENOH_SESSION_CONFIG.json5 of rmw_zenoh_cpp.
    """
    retry = {"period_init_ms": 1000, "period_max_ms": 4000, "period_increase_factor": 2}
    return {
        "mode": "peer",
        "connect": {"endpoints": [router], "timeout_ms": -1, "exit_on_failure": False, "retry": retry},
        "listen": {"endpoints": ["tcp/localhost:0"]},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": True}},
        "timestamping": {"enabled": True},
        # Zenoh's own shared memory would outlive a bridge that is killed. The messages here are small.
        "transport": {"shared_memory": {"enabled": False}},
    }


class Publisher:
    """Publisher of one topic."""

    def __init__(self, publisher: Any):
        self._publisher, self._gid, self.sent = publisher, secrets.token_bytes(GID_BYTES), 0

    def send(self, message: bytes) -> None:
        """Send a message to all subscribers; a slow subscriber misses it."""
        self.sent += 1
        self._publisher.put(message, attachment=attachment(self.sent, time.time_ns(), self._gid))


class Ros2Node:
    """Publishers and subscriptions under one name."""

    def __init__(self, name: str, router: str, domain: int):
        """Open the session.

        Args:
            name: Name of the node.
            router: Locator of Zenoh, such as `tcp/localhost:7447`; the router may start later.
            domain: Domain as in ROS_DOMAIN_ID.

        Raises:
            ConfigError: Zenoh is not installed, or does not accept the locator.
        """
        library = zenoh()
        try:
            self._session = library.open(library.Config.from_json5(json.dumps(configuration(router))))
        except library.ZError as error:
            raise ConfigError(
                f"--ros2-router is '{router}', with which Zenoh does not start: {error}. Give a locator such as "
                "tcp/localhost:7447."
            ) from error
        self._domain = domain
        self._tokens = NodeTokens(domain, str(self._session.info.zid()), name)
        self._kept: list[Any] = [self._session.liveliness().declare_token(self._tokens.node)]
        self._entities = 0

    def publisher(self, topic: str, kind: MessageType) -> Publisher:
        """Return a publisher of this topic."""
        drop = zenoh().CongestionControl.DROP
        found = self._session.declare_publisher(topic_key(self._domain, topic, kind), congestion_control=drop)
        self._declare(PUBLISHER, topic, kind)
        return Publisher(found)

    def subscribe(self, topic: str, kind: MessageType, take: Callable[[bytes], object]) -> None:
        """Subscribe to a topic; `take` gets each message, in a thread of Zenoh."""
        key = topic_key(self._domain, topic, kind)
        self._kept.append(self._session.declare_subscriber(key, lambda sample: take(sample.payload.to_bytes())))
        self._declare(SUBSCRIPTION, topic, kind)

    def close(self) -> None:
        """Remove the node from the ROS 2 graph."""
        self._session.close()

    def _declare(self, what: str, topic: str, kind: MessageType) -> None:
        self._entities += 1
        token = self._tokens.endpoint(self._entities, what, topic, kind)
        self._kept.append(self._session.liveliness().declare_token(token))
