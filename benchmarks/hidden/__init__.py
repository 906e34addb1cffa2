"""Machines in ordinary differential equations of their own, which no author of an estimator has seen."""
