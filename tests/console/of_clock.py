"""Clock that a test sets."""


class SetClock:
    """Clock that stands still until a test moves it."""

    def __init__(self, t: float = 1000.0):
        self.t = t

    def __call__(self) -> float:
        return self.t
