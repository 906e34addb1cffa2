"""Dynamics: torque from model and state, by trees, closed loops, friction, actuators and passive joints."""
