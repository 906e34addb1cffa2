"""A person as scale, tape and form describe them."""

from exograv.model.anthropometry import Body as Person

__all__ = ["Person"]
