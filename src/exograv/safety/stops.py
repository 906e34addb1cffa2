"""Why a guard lets the arm down: one list, and what each entry tells the operator."""

import enum

from exograv.sentence import Sentence, member_sentence


class StopReason(enum.Enum):
    """Why the soft descent started; the value is a sentence for the operator."""

    NOT_FINITE = "Control asked for a torque that is not a number."
    TOO_FAST = "A joint moved faster than allowed."
    NO_MEASUREMENT = "A joint's position or velocity is not a number."
    MODEL_LOST = "The model of the arm in the machine no longer fits its posture."
    PAST_A_STOP = "A joint is where its stops do not let it be."
    ASTRAY = "A joint did not follow where it was led."
    NOT_THIS_ARM = "Control asked for more than this person's arm can need: another arm or a weight is in the machine."
    CONTROL_SILENT = "Control did not answer in time."
    MACHINE_SILENT = "The machine did not say in time where it is."
    ENCODER_JUMPED = "An encoder jumped farther than its joint can move."
    ENCODER_DEAD = "An encoder stood still while its joint was moving."
    TORQUE_WRONG = "The motors do not give the torque that they are told."
    ENCODERS_PART = "A joint's encoder and its motor's do not say the same."
    DRIVE_FAULT = "A drive reports a fault."
    STOP_PRESSED = "Stop was pressed."

    @property
    def sentence(self) -> Sentence:
        """Its value, with the code under which other languages have it."""
        return member_sentence("stop", self)


Finding = tuple[StopReason, int]
"""What is wrong, and with which joint."""
