"""Body data of a person, as measured with scale and tape and stated in a form."""

from exograv.model.anthropometry import Body as Person

__all__ = ["Person"]
