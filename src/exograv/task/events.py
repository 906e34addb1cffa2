"""What a run is told; times are seconds on one clock, that of the rig or of the server, which never goes back."""

from typing import Annotated, Literal

from pydantic import Field, TypeAdapter

from exograv.model.rig_settings import Settings

Time = Annotated[float, Field(ge=-1e12, le=1e12)]
Pixels = Annotated[float, Field(ge=-1e5, le=1e5)]
Text = Annotated[str, Field(max_length=500)]


class Start(Settings):
    """The first rest begins."""

    kind: Literal["start"] = "start"
    t: Time


class Tick(Settings):
    """So late it is; nothing else has happened."""

    kind: Literal["tick"] = "tick"
    t: Time


class Touch(Settings):
    """A finger on the participant's page, which sends it until it is told that it has come."""

    kind: Literal["touch"] = "touch"
    t: Time
    """When it came down, by the page's clock as fitted to ours."""

    received: Time
    """When it reached us: later, by a lost connection perhaps much later."""

    page: Annotated[str, Field(min_length=1, max_length=64)]
    """Which opening of the page it is: each counts from 0."""

    sequence: Annotated[int, Field(ge=0, le=1_000_000)]
    x_px: Pixels
    y_px: Pixels
    target_x_px: Pixels
    target_y_px: Pixels
    """Of the panel, right and down: CSS pixels times devicePixelRatio. The target as it was drawn."""

    pointer: Literal["touch", "pen", "mouse"] = "touch"
    is_primary: bool = True
    contact_px: Annotated[float, Field(ge=0.0, le=1e5)] = 0.0
    """The longer side of the contact; 0 where the screen does not tell."""


class Return(Settings):
    """A sensor, or a zone of the screen, has the hand at its resting place."""

    kind: Literal["return"] = "return"
    t: Time


class Distance(Settings):
    """How far the machine has the hand from its resting place; what is not known is absent."""

    kind: Literal["distance"] = "distance"
    t: Time
    fingertip_m: Annotated[float, Field(ge=0.0, le=10.0)] | None = None
    joints_rad: Annotated[float, Field(ge=0.0, le=10.0)] | None = None
    """Of the joint that is farthest from the resting posture."""


class OpenWindow(Settings):
    """An aircraft, or a hand, opens the next window."""

    kind: Literal["open"] = "open"
    t: Time
    by: Literal["aircraft", "hand"]
    since: Time | None = None
    """Since when g has been within its limits."""

    parabola: Annotated[int, Field(ge=0, le=999)] | None = None
    """As the aircraft counts."""

    confirmed: bool | None = None
    """Whether its announcement says the same; None where the text is unknown."""


class CloseWindow(Settings):
    """The same close it."""

    kind: Literal["close"] = "close"
    t: Time
    by: Literal["aircraft", "hand"]


class FeedLost(Settings):
    """The aircraft is not heard any more."""

    kind: Literal["feed_lost"] = "feed_lost"
    t: Time


class FeedBack(Settings):
    """It is heard again."""

    kind: Literal["feed_back"] = "feed_back"
    t: Time


class Pause(Settings):
    """Somebody interrupts; an open window is broken off."""

    kind: Literal["pause"] = "pause"
    t: Time
    why: Text = ""


class Resume(Settings):
    """The run goes on with this window, the next one that is not complete if none is named."""

    kind: Literal["resume"] = "resume"
    t: Time
    window: Annotated[int, Field(ge=0, le=500)] | None = None


class Interrupted(Settings):
    """The program was ended and has been started again; its clock may be another. The run is then paused."""

    kind: Literal["interrupted"] = "interrupted"
    t: Time


class Stop(Settings):
    """The run ends here."""

    kind: Literal["stop"] = "stop"
    t: Time
    why: Text = ""


class AcknowledgeAlarm(Settings):
    """The operator has seen an alarm."""

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
"""Reads an event that was kept as JSON."""
