"""Time that passes when a test says so."""


class SetClock:
    """Stands until it is moved."""

    def __init__(self, t: float = 1000.0):
        self.t = t

    def __call__(self) -> float:
        return self.t
