"""What a page may say on its line, and how its text is read: size, depth, form, fields, in this order."""

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from exograv.experiment.steered.requests import Identifier
from exograv.model.rig_settings import Settings
from exograv.task.events import Pixels
from exograv.task.screen import ScreenSpan

from .limits import DEPTH_MAX, MESSAGE_MAX_BYTES, Close

PageTime = Annotated[float, Field(ge=0.0, le=1e8)]
"""Of the page's own clock, from its opening on, as `timeStamp` and `performance.now()` have it [s]."""

Page = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{8,64}$")]
"""Which opening of a page it is."""

TOUCHES_MAX = 30
POINTS_MAX = 120


class Hello(Settings):
    """The first message of a line, and of no other."""

    kind: Literal["hello"] = "hello"
    ticket: Annotated[str, Field(max_length=64)]
    page: Page


class Pinged(Settings):
    """When the answer to an earlier ping was back."""

    asked: PageTime
    back: PageTime


class Ping(Settings):
    """What time is it? From such questions the page's clock is fitted to ours."""

    kind: Literal["ping"] = "ping"
    asked: PageTime
    previous: Pinged | None = None


class Heartbeat(Settings):
    """Whoever steers has the page in view."""

    kind: Literal["beat"] = "beat"


class LeaseRequest(Settings):
    """Asks for the lease."""

    kind: Literal["steer"] = "steer"
    id: Identifier


class ActMessage(Settings):
    """An act of the steered session (`session.steered.contract`), without what the server knows better."""

    kind: Literal["do"] = "do"
    id: Identifier
    made: PageTime
    seen_version: int | None = None
    act: dict[str, Any]
    """Its kind and what else it has."""


class RunCommand(Settings):
    """To the protocol that is run."""

    kind: Literal["run"] = "run"
    id: Identifier
    made: PageTime
    word: Literal["start", "pause", "resume", "open", "close", "end"]
    window: Annotated[int, Field(ge=0, le=500)] | None = None
    """To go on with."""


class AlarmSeen(Settings):
    """An alarm of the run or of the console is known; those of the machine are an act."""

    kind: Literal["seen"] = "seen"
    id: Identifier
    of: Literal["run", "console"]
    alarm: Annotated[int, Field(ge=0)]


class InviteRequest(Settings):
    """A link for somebody else."""

    kind: Literal["invite"] = "invite"
    id: Identifier
    role: Literal["operator", "therapist", "participant", "viewer"]


class PageTouch(Settings):
    """One finger that came down, raw; lengths in pixels of the panel."""

    page: Page
    """Whose clock it is by: after a reload another one than the line's."""

    origin_ms: Annotated[float, Field(ge=0.0, le=1e14)]
    """`performance.timeOrigin`."""

    at: PageTime
    """`timeStamp`."""

    sequence: Annotated[int, Field(ge=0, le=1_000_000)]
    x_px: Pixels
    y_px: Pixels
    target_x_px: Pixels
    target_y_px: Pixels
    width_px: Annotated[float, Field(ge=0.0, le=1e5)]
    height_px: Annotated[float, Field(ge=0.0, le=1e5)]
    """Of the contact."""

    pressure: Annotated[float, Field(ge=0.0, le=1.0)]
    pointer: Literal["touch", "pen", "mouse"]
    is_primary: bool
    ratio: Annotated[float, Field(gt=0.0, le=20.0)]
    """`devicePixelRatio`."""

    zoom: Annotated[float, Field(gt=0.0, le=20.0)]
    """Of two fingers; 1 as long as the lock holds."""


class Touches(Settings):
    """All that were not acknowledged yet, or as many as fit."""

    kind: Literal["touches"] = "touches"
    touches: Annotated[list[PageTouch], Field(min_length=1, max_length=TOUCHES_MAX)]


class TouchTrail(Settings):
    """How a finger went on after it came down, with what the browser had coalesced."""

    kind: Literal["trail"] = "trail"
    page: Page
    sequence: Annotated[int, Field(ge=0, le=1_000_000)]
    """Of the touch."""

    ended: Literal["up", "cancel"] | None
    """None while it goes on."""

    points: Annotated[list[tuple[PageTime, Pixels, Pixels]], Field(max_length=POINTS_MAX)]
    """Time and place on the panel."""


class Calibrate(Settings):
    """The panel's pixels were measured: with a bank card (width and height of its picture), or with a ruler."""

    kind: Literal["calibrate"] = "calibrate"
    id: Identifier
    card_px: tuple[Pixels, Pixels] | None = None
    spans: tuple[ScreenSpan, ...] = Field(default=(), max_length=4)


class Latency(Settings):
    """What the latency page found: touch after the flash it was meant for."""

    kind: Literal["latency"] = "latency"
    id: Identifier
    method: Literal["flash"]
    delays_ms: Annotated[list[Annotated[float, Field(ge=-2000.0, le=5000.0)]], Field(min_length=3, max_length=60)]


Message = (
    Hello | Ping | Heartbeat | LeaseRequest | ActMessage | RunCommand | AlarmSeen | InviteRequest | Touches
    | TouchTrail | Calibrate | Latency
)  # fmt: skip
# Names are made for one message each: kept for the next one they only fill the memory.
MESSAGE: TypeAdapter[Message] = TypeAdapter(
    Annotated[Message, Field(discriminator="kind")], config=ConfigDict(cache_strings="keys")
)


def read_message(text: str | bytes) -> Message | Close:
    """What was said, or why the line is closed for it (F34)."""
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
    """How deep brackets go; those in strings do not count. Read before any parser sees the text."""
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
