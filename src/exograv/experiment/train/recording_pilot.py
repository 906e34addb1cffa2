"""Who flies a machine that gives no torque: what would stop a driven one is written down, and the recording goes on."""

from exograv.loop.output_feedback import Controller
from exograv.loop.pilot import Pilot
from exograv.signals import Reference


class RecordingPilot(Pilot):
    """A fast arm in flight must not cost a laboratory its parabolas: nothing acts that could be stopped."""

    _is_noted = False

    def _come_down(self, controller: Controller, reference: Reference, is_interrupted: bool) -> None:
        reason = self.envelope.stop
        if is_interrupted or reason is None:
            super()._come_down(controller, reference, is_interrupted)
            return
        if not self._is_noted and self.recording is not None:
            text = f"{reason.value} No motor acts, so nothing was stopped."
            self.recording.write("/event", self.rig.read().t, {"kind": "warning", "text": text})
        # As soon as it stands; until then every tick comes here.
        self._is_noted = not self.guard.reset()
