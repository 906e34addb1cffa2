"""Where `rmw_zenoh_cpp` looks for messages, nodes and topics in Zenoh, and what it wants beside each message.

Source: https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md; details (what is left out, what an empty name
becomes) from `liveliness_utils.cpp` and `attachment_helpers.cpp` there.
"""

import struct
from dataclasses import dataclass

from .messages import MessageType

QUALITY = "::,10:,:,:,,"
"""Of service, as a token says it: what differs from rmw_zenoh's default, which is reliable, volatile, the last 42."""

PUBLISHER, SUBSCRIPTION = "MP", "MS"

GID_BYTES = 16


def topic_key(domain: int, topic: str, kind: MessageType) -> str:
    """On which the messages of a topic (from `/` on) are sent."""
    return f"{domain}/{topic.strip('/')}/{kind.dds_name}/{kind.hash}"


@dataclass(frozen=True)
class NodeTokens:
    """Keys of the tokens by which the graph of ROS 2 knows a node: of the root namespace, without an enclave."""

    domain: int
    session: str
    """Zenoh's own id of the session."""

    name: str

    @property
    def node(self) -> str:
        """Of the node itself, which is the first entity of the session."""
        return self._token(0, "NN")

    def endpoint(self, number: int, what: str, topic: str, kind: MessageType) -> str:
        """Of a publisher or a subscription, whose `number` no other entity of the session has."""
        name = topic.replace("/", "%")
        return f"{self._token(number, what)}/{name}/{kind.dds_name}/{kind.hash}/{QUALITY}"

    def _token(self, number: int, what: str) -> str:
        return f"@ros2_lv/{self.domain}/{self.session}/0/{number}/{what}/%/%/{self.name}"


def attachment(number: int, sent_ns: int, gid: bytes) -> bytes:
    """What goes with a message; a subscription of rmw_zenoh drops one that has none.

    Args:
        number: Of the message, from 1.
        sent_ns: Since 1970 [ns].
        gid: Of the publisher, `GID_BYTES`.
    """
    return struct.pack("<qqB", number, sent_ns, len(gid)) + gid
