"""Example of a whole study without people: end points from a model of adaptation, protocols and recordings as usual.

It shows what the study room makes of recordings. No machine is simulated, unlike in `experiment/train/`. The results
are no evidence about people.
"""
