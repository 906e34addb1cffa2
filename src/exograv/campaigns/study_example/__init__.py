"""A whole study without people: end points by a model of adaptation, protocols and recordings as in a real one.

It shows what the study room makes of recordings. No machine is simulated, unlike in `experiment/train/`; it is no
evidence about people.
"""
