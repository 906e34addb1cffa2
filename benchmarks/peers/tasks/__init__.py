"""Computations that every implementation is given: machines, states, programs and what an implementation offers."""
