"""From model and state to torque: the tree, the closed loops, friction, actuators and passive joints."""
