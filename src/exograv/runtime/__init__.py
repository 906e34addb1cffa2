"""Time, processes and their messages: clock, control loop, recorder, streams of other devices, ROS 2."""
