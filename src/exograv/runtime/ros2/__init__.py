"""Node of ROS 2 without ROS 2: topics of a live run over Zenoh, and requests from such a laboratory."""
