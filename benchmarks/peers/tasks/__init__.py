"""Computations that every implementation gets: machines, states, programs, and the interface of an implementation."""
