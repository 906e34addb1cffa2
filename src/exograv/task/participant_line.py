"""Messages between a participant who is simulated in another process and what the participant sees, as lines of JSON.

In lock-step the session tells what its page would show, and the participant tells the touches as a panel reports them.
In real time a stimulus process tells what the page shows, and the participant tells each contact of the finger with the
panel. No message carries a parameter of the arm or the machine.
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
    panel_px: tuple[int, int]
    """Width and height of the screen [px]."""

    recorded: JsonObject
    """Settings of room and participant for the recording, by name."""


class Touched(Settings):
    """Touch as the panel reports it."""

    kind: Literal["touched"] = "touched"
    now: float
    """Time of this message on the participant's clock [s]."""

    touch: Touch
    """Touch, with times on the participant's clock."""


class Contact(Settings):
    """Finger that has met the panel, or has left it, for who makes the touch at a page."""

    kind: Literal["contact"] = "contact"
    t: float
    """Time on the common monotonic clock of this computer [s]."""

    is_down: bool
    """True if the finger has met the panel, False if it has left it."""

    x_px: float
    y_px: float
    """Place of the finger, right and down of the panel's corner [px]."""

    contact_px: float
    """Longer side of the contact [px]."""


class Learned(Settings):
    """State that the participant keeps for the next session. The session stores it in its checkpoint."""

    kind: Literal["learned"] = "learned"
    learned: JsonObject


class Seen(Settings):
    """Content of the participant's page."""

    kind: Literal["seen"] = "seen"
    picture: ParticipantPicture
    target_px: tuple[float, float] | None = None
    """Centre of the target as it is drawn, right and down of the panel's corner [px]; None for the protocol's place."""


class Room(Settings):
    """Screen and support come to the participant, or go away."""

    kind: Literal["room"] = "room"
    is_there: bool


class Remember(Settings):
    """State of the participant from before an interruption."""

    kind: Literal["remember"] = "remember"
    learned: JsonObject


class Electrodes(Settings):
    """Electrodes of a simulated amplifier on the participant's arm. The session never sends this message."""

    kind: Literal["electrodes"] = "electrodes"
    port: int
    """UDP port of the amplifier."""


ToSession = Annotated[Introduced | Touched | Contact | Learned, Field(discriminator="kind")]
ToParticipant = Annotated[Seen | Room | Remember | Electrodes, Field(discriminator="kind")]

TO_SESSION: TypeAdapter[ToSession] = TypeAdapter(ToSession)
"""Reader of the participant's messages."""

TO_PARTICIPANT: TypeAdapter[ToParticipant] = TypeAdapter(ToParticipant)
"""Reader of the session's messages."""
