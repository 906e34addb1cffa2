"""Messages and tokens have the keys of rmw_zenoh_cpp's design document."""

import struct

from exograv.runtime.ros2.keys import PUBLISHER, SUBSCRIPTION, NodeTokens, attachment, topic_key
from exograv.runtime.ros2.messages import FLOAT64, STRING

TOKENS = NodeTokens(2, "a91bc6aae6d38eb4", "exograv")
HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


def test_the_key_of_a_topic_is_that_of_the_document_s_examples():
    assert topic_key(0, "/chatter", STRING) == f"0/chatter/std_msgs::msg::dds_::String_/{HASH}"
    assert topic_key(2, "/robot1/chatter", STRING) == f"2/robot1/chatter/std_msgs::msg::dds_::String_/{HASH}"


def test_a_node_is_the_first_entity_of_its_session_in_the_root_namespace_without_an_enclave():
    assert TOKENS.node == "@ros2_lv/2/a91bc6aae6d38eb4/0/0/NN/%/%/exograv"


def test_the_token_of_an_endpoint_has_topic_type_hash_and_quality_with_slashes_only_between_parts():
    token = TOKENS.endpoint(7, PUBLISHER, "/exograv/remark", STRING)
    node, name, kind, hashed, quality = token.rsplit("/", 4)
    assert node == "@ros2_lv/2/a91bc6aae6d38eb4/0/7/MP/%/%/exograv"
    assert (name, kind, hashed) == ("%exograv%remark", "std_msgs::msg::dds_::String_", HASH)
    reliability, durability, history, deadline, lifespan, liveliness = quality.split(":")
    assert (reliability, durability) == ("", "")
    assert [len(part.split(",")) for part in (history, deadline, lifespan, liveliness)] == [2, 2, 2, 3]
    assert history == ",10"


def test_a_subscription_has_another_token_than_a_publisher():
    assert "/MS/" in TOKENS.endpoint(1, SUBSCRIPTION, "/a", FLOAT64)


def test_the_attachment_of_a_message_has_its_number_time_and_sender():
    gid = bytes(range(16))
    found = attachment(3, 1_700_000_000_000_000_001, gid)
    assert len(found) == 33
    assert struct.unpack("<qq", found[:16]) == (3, 1_700_000_000_000_000_001)
    assert found[16:] == b"\x10" + gid
