"""Identification of the arm in the machine: motions, estimator session, warm start, checks of the person."""
