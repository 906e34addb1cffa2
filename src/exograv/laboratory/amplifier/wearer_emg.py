"""EMG envelopes of the twin's wearer during a session."""

from exograv.rig.twin import Twin

from .emg_envelopes import EmgEnvelopes, Envelopes


class WearerEmg:
    """Amplifier on the twin's wearer (a `MuscleSource`). Its gains and errors go on while nobody asks."""

    def __init__(self, twin: Twin, seed: int, error_factor: float = 1.0):
        """Begin at the present time of the twin; the arguments are those of `EmgEnvelopes`."""
        self._twin, self._t = twin, twin.t
        self._silent = 0.0 * twin.truth.tau_muscle
        self._envelopes = EmgEnvelopes(len(self._silent), twin.period_s, seed, error_factor)

    @property
    def channels(self) -> int:
        """Number of channels: two per freedom."""
        return self._envelopes.channels

    def now(self) -> Envelopes:
        """Return the envelopes of the present tick [-]."""
        missed = round((self._twin.t - self._t) / self._twin.period_s) - 1
        self._t = self._twin.t
        for _ in range(missed):
            self._envelopes.next(self._silent)
        return self._envelopes.next(self._twin.truth.tau_muscle)
