"""Bring-up of a new machine on the bench: steps in the order of danger, none of which can be skipped."""
