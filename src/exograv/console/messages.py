"""Messages of a page on its line, and their parser: it checks size, depth, JSON and fields in this order."""

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from exograv.experiment.steered.requests import Identifier
from exograv.model.rig_settings import Settings
from exograv.task.events import Pixels
from exograv.task.screen import ScreenSpan

from .limits import DEPTH_MAX, MESSAGE_MAX_BYTES, Close

PageTime = Annotated[float, Field(ge=0.0, le=1e8)]
"""Time on the page's own clock since its opening, as `timeStamp` and `performance.now()` give it [s]."""

Page = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{8,64}$")]
"""Identifier of one opening of a page."""

TOUCHES_MAX = 30
"""Largest number of touches in a message."""

POINTS_MAX = 120
"""Largest number of points in a message with a trail."""


class Hello(Settings):
    """First message of a line, with the ticket that opens it."""

    kind: Literal["hello"] = "hello"
    ticket: Annotated[str, Field(max_length=64)]
    page: Page


class Pinged(Settings):
    """Arrival of the answer to an earlier ping."""

    asked: PageTime
    back: PageTime


class Ping(Settings):
    """Question for the server's time. The server fits the page's clock to its own from these questions."""

    kind: Literal["ping"] = "ping"
    asked: PageTime
    previous: Pinged | None = None


class BeatGap(Settings):
    """Gap between two heartbeats, which the page noticed itself."""

    cause: Literal["hidden", "slow", "asleep"]
    seconds: Annotated[float, Field(ge=0.0, le=1e7)]


class Heartbeat(Settings):
    """Heartbeat of the steering page."""

    kind: Literal["beat"] = "beat"
    hidden: bool = False
    """True if the page is in the background, where a browser slows it down."""

    gap: BeatGap | None = None
    """Gap before this heartbeat, if the heartbeat was late; None otherwise."""


class LeaseRequest(Settings):
    """Request of a page for the lease, which allows it to steer."""

    kind: Literal["steer"] = "steer"
    id: Identifier


class ActMessage(Settings):
    """Act of the steered session (`experiment.steered.requests`), without the fields that the server sets."""

    kind: Literal["do"] = "do"
    id: Identifier
    made: PageTime
    seen_version: int | None = None
    act: dict[str, Any]
    """Kind and further fields of the act."""


class RunCommand(Settings):
    """Command to the protocol that runs."""

    kind: Literal["run"] = "run"
    id: Identifier
    made: PageTime
    word: Literal["start", "pause", "resume", "open", "close", "end"]
    window: Annotated[int, Field(ge=0, le=500)] | None = None
    """Window at which to resume."""


class AlarmSeen(Settings):
    """Acknowledgement of an alarm of the run or of the console. Alarms of the machine are acknowledged by an act."""

    kind: Literal["seen"] = "seen"
    id: Identifier
    of: Literal["run", "console"]
    alarm: Annotated[int, Field(ge=0)]


class InviteRequest(Settings):
    """Request for a link for another person."""

    kind: Literal["invite"] = "invite"
    id: Identifier
    role: Literal["operator", "therapist", "participant", "viewer"]


class PageTouch(Settings):
    """Raw data of one finger that came down; lengths in pixels of the panel."""

    page: Page
    """Opening of the page whose clock gave the time. After a reload it differs from that of the line."""

    origin_ms: Annotated[float, Field(ge=0.0, le=1e14)]
    """Origin of the page's `performance.now`, the property `performance.timeOrigin` [ms since 1970]."""

    at: PageTime
    """Time of the event since the page was opened, the property `timeStamp` [s]."""

    sequence: Annotated[int, Field(ge=0, le=1_000_000)]
    x_px: Pixels
    y_px: Pixels
    target_x_px: Pixels
    target_y_px: Pixels
    width_px: Annotated[float, Field(ge=0.0, le=1e5)]
    height_px: Annotated[float, Field(ge=0.0, le=1e5)]
    """Height of the contact [px]."""

    pressure: Annotated[float, Field(ge=0.0, le=1.0)]
    pointer: Literal["touch", "pen", "mouse"]
    is_primary: bool
    ratio: Annotated[float, Field(gt=0.0, le=20.0)]
    """Physical pixels per CSS pixel, the property `devicePixelRatio` [-]."""

    zoom: Annotated[float, Field(gt=0.0, le=20.0)]
    """Pinch zoom; 1 while the page is locked."""


class Touches(Settings):
    """Touches without an acknowledgement, as many as fit."""

    kind: Literal["touches"] = "touches"
    touches: Annotated[list[PageTouch], Field(min_length=1, max_length=TOUCHES_MAX)]


class TouchTrail(Settings):
    """Path of a finger after it came down, with the coalesced events of the browser."""

    kind: Literal["trail"] = "trail"
    page: Page
    sequence: Annotated[int, Field(ge=0, le=1_000_000)]
    """Number of the touch."""

    ended: Literal["up", "cancel"] | None
    """End of the trail; None while it continues."""

    points: Annotated[list[tuple[PageTime, Pixels, Pixels]], Field(max_length=POINTS_MAX)]
    """Time and position on the panel [s, px, px]."""


class Calibrate(Settings):
    """Measurement of the panel's pixels: with a bank card (width and height of its picture), or with a ruler."""

    kind: Literal["calibrate"] = "calibrate"
    id: Identifier
    card_px: tuple[Pixels, Pixels] | None = None
    spans: tuple[ScreenSpan, ...] = Field(default=(), max_length=4)


class Latency(Settings):
    """Result of the latency page: delay of each touch after its flash."""

    kind: Literal["latency"] = "latency"
    id: Identifier
    method: Literal["flash"]
    delays_ms: Annotated[list[Annotated[float, Field(ge=-2000.0, le=5000.0)]], Field(min_length=3, max_length=60)]


Message = (
    Hello | Ping | Heartbeat | LeaseRequest | ActMessage | RunCommand | AlarmSeen | InviteRequest | Touches
    | TouchTrail | Calibrate | Latency
)  # fmt: skip
# Identifiers occur in one message only: a cache of their strings would only fill the memory.
MESSAGE: TypeAdapter[Message] = TypeAdapter(
    Annotated[Message, Field(discriminator="kind")], config=ConfigDict(cache_strings="keys")
)


def read_message(text: str | bytes) -> Message | Close:
    """Return the message of a text, or the reason to close the line (hazard F34)."""
    if isinstance(text, bytes):
        return Close.PROTOCOL
    if len(text) > MESSAGE_MAX_BYTES or len(text.encode("utf-8", "surrogatepass")) > MESSAGE_MAX_BYTES:
        return Close.TOO_BIG
    if depth(text) > DEPTH_MAX:
        return Close.POLICY
    try:
        return MESSAGE.validate_json(text, strict=True)
    except ValidationError as error:
        is_json = all(each["type"] != "json_invalid" for each in error.errors(include_url=False, include_input=False))
        return Close.POLICY if is_json else Close.PROTOCOL


def depth(text: str) -> int:
    """Depth of brackets outside strings. It is checked before any parser reads the text."""
    deepest = level = 0
    is_string = is_escaped = False
    for sign in text:
        if is_string:
            is_escaped, is_string = not is_escaped and sign == "\\", is_escaped or sign != '"'
        elif sign == '"':
            is_string = True
        elif sign in "[{":
            level += 1
            deepest = max(deepest, level)
        elif sign in "]}":
            level -= 1
    return deepest
