"""Acceptance of a machine before its first person: a dummy arm of known masses, and stops on purpose."""
