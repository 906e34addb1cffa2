"""Pilot of a machine that gives no torque: it records reasons for a stop, and the recording continues."""

from exograv.loop.output_feedback import Controller
from exograv.loop.pilot import Pilot
from exograv.signals import Reference


class RecordingPilot(Pilot):
    """Pilot that only records. A fast arm in flight must not cost a parabola, and without torque a stop has no use."""

    _is_noted = False

    def _come_down(self, controller: Controller, reference: Reference, is_interrupted: bool) -> None:
        reason = self.envelope.stop
        if is_interrupted or reason is None:
            super()._come_down(controller, reference, is_interrupted)
            return
        if not self._is_noted and self.recording is not None:
            text = f"{reason.value} No motor is active, so the recording continues."
            self.recording.write("/event", self.rig.t, {"kind": "warning", "text": text})
        # The guard can only be reset when the arm stands still. Until then every tick gets here.
        self._is_noted = not self.guard.reset()
