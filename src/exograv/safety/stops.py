"""Reasons for which a guard lets the arm down, each with its text for the operator."""

import enum

from exograv.sentence import Sentence, member_sentence


class StopReason(enum.Enum):
    """Reason for the soft descent; the value is a sentence for the operator."""

    NOT_FINITE = "Control asked for a torque that is not a number."
    TOO_FAST = "A joint moved faster than allowed."
    NO_MEASUREMENT = "A joint's position or velocity is not a number."
    MODEL_LOST = "The model of the arm in the machine no longer fits its posture."
    PAST_A_STOP = "A joint is past its stop."
    ASTRAY = "A joint did not follow its path."
    NOT_THIS_ARM = "Control asked for more than this person's arm can need: another arm or a weight is in the machine."
    CONTROL_SILENT = "Control did not answer in time."
    MACHINE_SILENT = "The machine did not report its position in time."
    ENCODER_JUMPED = "An encoder jumped farther than its joint can move."
    ENCODER_DEAD = "An encoder stood still while its joint was moving."
    TORQUE_WRONG = "The motors do not give the commanded torque."
    ENCODERS_PART = "The encoders of a joint and of its motor disagree."
    DRIVE_FAULT = "A drive reports a fault."
    STOP_PRESSED = "Stop was pressed."
    DRIFTED = "The torque at a joint has differed from the model for too long."

    @property
    def sentence(self) -> Sentence:
        """Value of the reason, with the code of its translations."""
        return member_sentence("stop", self)


Finding = tuple[StopReason, int]
"""Reason and joint of a finding."""
