"""Smallest support of the arm's weight with which a person reaches a set of targets."""
