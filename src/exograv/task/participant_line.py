"""Messages between a session and a participant who is simulated in another process, as lines of JSON.

The session tells what the participant's page shows. The participant tells where the finger has met the panel. No
message carries a parameter of the arm or the machine.
"""

from typing import Annotated, Literal

from pydantic import Field, TypeAdapter

from exograv.model.rig_settings import Settings
from exograv.results import JsonObject

from .events import Touch
from .picture import ParticipantPicture
from .screen import ScreenCalibration


class Introduced(Settings):
    """First message of the participant: the form, and the screen as an operator measures it."""

    kind: Literal["introduced"] = "introduced"
    height_m: float
    mass_kg: float
    sex: Literal["female", "male"]
    lengths_m: dict[str, float]
    """Lengths to which the machine is set, by segment [m]."""

    screen: ScreenCalibration
    recorded: JsonObject
    """Settings of room and participant for the recording, by name."""


class Touched(Settings):
    """Touch as the panel reports it."""

    kind: Literal["touched"] = "touched"
    now: float
    """Time of this message on the participant's clock [s]."""

    touch: Touch
    """Touch, with times on the participant's clock."""


class Learned(Settings):
    """State that the participant keeps for the next session. The session stores it in its checkpoint."""

    kind: Literal["learned"] = "learned"
    learned: JsonObject


class Seen(Settings):
    """Content of the participant's page."""

    kind: Literal["seen"] = "seen"
    picture: ParticipantPicture


class Room(Settings):
    """Screen and support come to the participant, or go away."""

    kind: Literal["room"] = "room"
    is_there: bool


class Remember(Settings):
    """State of the participant from before an interruption."""

    kind: Literal["remember"] = "remember"
    learned: JsonObject


ToSession = Annotated[Introduced | Touched | Learned, Field(discriminator="kind")]
ToParticipant = Annotated[Seen | Room | Remember, Field(discriminator="kind")]

TO_SESSION: TypeAdapter[ToSession] = TypeAdapter(ToSession)
"""Reader of the participant's messages."""

TO_PARTICIPANT: TypeAdapter[ToParticipant] = TypeAdapter(ToParticipant)
"""Reader of the session's messages."""
