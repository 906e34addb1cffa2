"""Verification of the left over without a known truth: postures that are passed slowly in both directions."""
