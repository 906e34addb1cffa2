"""Events of a run. Times are seconds on one clock that never goes back: the rig's or the server's."""

from typing import Annotated, Literal

from pydantic import Field, TypeAdapter

from exograv.model.rig_settings import Settings

Time = Annotated[float, Field(ge=-1e12, le=1e12)]
Pixels = Annotated[float, Field(ge=-1e5, le=1e5)]
Text = Annotated[str, Field(max_length=500)]


class Start(Settings):
    """Start of the run with its first rest."""

    kind: Literal["start"] = "start"
    t: Time
    participant: str | None = None
    """Code of the person; None if the recording states it elsewhere."""

    session: int | None = None
    """Number of the session with this protocol; None if the recording states it elsewhere."""


class Tick(Settings):
    """Time signal without any other event."""

    kind: Literal["tick"] = "tick"
    t: Time


class Touch(Settings):
    """Touch on the participant's page. The page sends a touch until the server has confirmed it."""

    kind: Literal["touch"] = "touch"
    t: Time
    """Time of contact on the page's clock, converted to our clock."""

    received: Time
    """Time of arrival at the server. After a lost connection it may be much later than the contact."""

    page: Annotated[str, Field(min_length=1, max_length=64)]
    """Identifier of one opening of the page. Each opening counts its touches from 0."""

    sequence: Annotated[int, Field(ge=0, le=1_000_000)]
    x_px: Pixels
    y_px: Pixels
    target_x_px: Pixels
    target_y_px: Pixels
    """Positions on the panel, right and down: CSS pixels times devicePixelRatio. The target is as the page drew it."""

    pointer: Literal["touch", "pen", "mouse"] = "touch"
    is_primary: bool = True
    contact_px: Annotated[float, Field(ge=0.0, le=1e5)] = 0.0
    """Longer side of the contact; 0 if the screen does not report it."""


class Return(Settings):
    """Detection of the hand at its resting place, by a sensor or by a zone of the screen."""

    kind: Literal["return"] = "return"
    t: Time


class Distance(Settings):
    """Distance of the hand from its resting place, by the machine. Unknown values are absent."""

    kind: Literal["distance"] = "distance"
    t: Time
    fingertip_m: Annotated[float, Field(ge=0.0, le=10.0)] | None = None
    joints_rad: Annotated[float, Field(ge=0.0, le=10.0)] | None = None
    """Distance of the joint that is farthest from the resting posture [rad]; None if it is unknown."""


class OpenWindow(Settings):
    """Request of the aircraft or of the operator to open the next window."""

    kind: Literal["open"] = "open"
    t: Time
    by: Literal["aircraft", "hand"]
    since: Time | None = None
    """Time since which g has been within its limits [s]; None if the operator opens the window."""

    parabola: Annotated[int, Field(ge=0, le=999)] | None = None
    """Number of the parabola, as the aircraft counts; None if it is unknown."""

    confirmed: bool | None = None
    """True if the aircraft's announcement agrees with g; None if the text is unknown."""


class CloseWindow(Settings):
    """Request of the aircraft or of the operator to close the window."""

    kind: Literal["close"] = "close"
    t: Time
    by: Literal["aircraft", "hand"]


class FeedLost(Settings):
    """Loss of the aircraft's data feed."""

    kind: Literal["feed_lost"] = "feed_lost"
    t: Time


class FeedBack(Settings):
    """Return of the aircraft's data feed."""

    kind: Literal["feed_back"] = "feed_back"
    t: Time


class Pause(Settings):
    """Interruption by a person. An open window is broken off."""

    kind: Literal["pause"] = "pause"
    t: Time
    why: Text = ""


class Resume(Settings):
    """Continuation of the run with the given window. Without a window: the next one that is not complete."""

    kind: Literal["resume"] = "resume"
    t: Time
    window: Annotated[int, Field(ge=0, le=500)] | None = None


class Interrupted(Settings):
    """Restart of the program, perhaps with another clock. The run is then paused."""

    kind: Literal["interrupted"] = "interrupted"
    t: Time


class Stop(Settings):
    """End of the run."""

    kind: Literal["stop"] = "stop"
    t: Time
    why: Text = ""


class AcknowledgeAlarm(Settings):
    """Confirmation that the operator has seen an alarm."""

    kind: Literal["acknowledge"] = "acknowledge"
    t: Time
    alarm: Annotated[int, Field(ge=0)]


Event = (
    Start
    | Tick
    | Touch
    | Return
    | Distance
    | OpenWindow
    | CloseWindow
    | FeedLost
    | FeedBack
    | Pause
    | Resume
    | Interrupted
    | Stop
    | AcknowledgeAlarm
)
EVENT: TypeAdapter[Event] = TypeAdapter(Annotated[Event, Field(discriminator="kind")])
"""Reads an event that was stored as JSON."""
