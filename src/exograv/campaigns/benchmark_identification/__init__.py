"""Comparison of identification methods on the same streams: error, time to target, and honesty of the intervals."""
