"""Estimation of the arm's parameters and their uncertainty from motion and torque; one file per method."""
