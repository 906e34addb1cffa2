"""Keys of messages, nodes and topics in Zenoh as `rmw_zenoh_cpp` expects them, and the attachment of a message.

Source: https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md; details (omitted parts, form of an empty name)
from `liveliness_utils.cpp` and `attachment_helpers.cpp` there.
"""

import struct
from dataclasses import dataclass

from .messages import MessageType

QUALITY = "::,10:,:,:,,"
"""Quality of service in a token: the differences from rmw_zenoh's default, which is reliable, volatile, the last 42."""

PUBLISHER, SUBSCRIPTION = "MP", "MS"

GID_BYTES = 16
"""Length of a publisher's identifier [bytes]."""


def topic_key(domain: int, topic: str, kind: MessageType) -> str:
    """Key on which the messages of a topic (from `/` on) are sent."""
    return f"{domain}/{topic.strip('/')}/{kind.dds_name}/{kind.hash}"


@dataclass(frozen=True)
class NodeTokens:
    """Keys of the tokens by which the graph of ROS 2 knows a node in the root namespace, without an enclave."""

    domain: int
    session: str
    """Zenoh's own id of the session."""

    name: str

    @property
    def node(self) -> str:
        """Token of the node itself, which is the first entity of the session."""
        return self._token(0, "NN")

    def endpoint(self, number: int, what: str, topic: str, kind: MessageType) -> str:
        """Token of a publisher or subscription, with a `number` that is unique in the session."""
        name = topic.replace("/", "%")
        return f"{self._token(number, what)}/{name}/{kind.dds_name}/{kind.hash}/{QUALITY}"

    def _token(self, number: int, what: str) -> str:
        return f"@ros2_lv/{self.domain}/{self.session}/0/{number}/{what}/%/%/{self.name}"


def attachment(number: int, sent_ns: int, gid: bytes) -> bytes:
    """Return the attachment of a message; a subscription of rmw_zenoh drops a message without one.

    Args:
        number: Number of the message, from 1.
        sent_ns: Time since 1970 [ns].
        gid: Identifier of the publisher, `GID_BYTES` long.
    """
    return struct.pack("<qqB", number, sent_ns, len(gid)) + gid
