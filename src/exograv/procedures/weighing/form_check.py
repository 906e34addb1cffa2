"""Check of the form during a live identification, from its motion: after 20 s, and again at its end if in doubt."""

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample

from .arm_check import ArmCheck, ArmJudge, in_doubt_not_refused
from .first_motion import SECONDS
from .motion_samples import SampleCollector


class FormCheck:
    """Observer of an identification of an unknown arm. It takes every sample of the motion."""

    def __init__(self, model: ArmModel, body_mass_kg: float):
        """Compare with a form of this body mass [kg]."""
        self._judge, self._kept, self._mass_kg = ArmJudge(model), SampleCollector(), body_mass_kg
        self.verdict: ArmCheck | None = None
        """Last verdict; None before the first 20 s of motion."""

    @property
    def refusal(self) -> str:
        """Verdict if it surely refuses the form; otherwise an empty text."""
        verdict = self.verdict
        return verdict.why if verdict is not None and verdict.refused and verdict.is_sure else ""

    def __call__(self, sample: Sample) -> None:
        """Take one sample; judge after 20 s of motion."""
        self._kept(sample)
        if self.verdict is None and sample.t >= SECONDS:
            self.verdict = self._judged()

    def finish(self, is_restless: bool) -> None:
        """Judge the whole motion if the first verdict is in doubt. A motion below 20 s gives no verdict."""
        if self.verdict is not None and not self.verdict.is_sure:
            self.verdict = in_doubt_not_refused(self._judged(), is_restless)

    def _judged(self) -> ArmCheck:
        return self._judge.judge([self._kept.samples], self._mass_kg)
