"""A node of ROS 2 without ROS 2: what a live run tells such a laboratory over Zenoh, and what it may ask for."""
