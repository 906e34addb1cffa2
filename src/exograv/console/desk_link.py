"""Link between the process of the pages and the desk (session controller), which is in the guard's parent.

Requests go one way, answers go back, by rings in shared memory. No process waits for the other: the parent answers, or
it does not. Requests are JSON and are checked field by field, so that the parent executes nothing that the process of
the pages, which strangers can reach, has written.
"""

import itertools
import json
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, TypeAdapter, ValidationError

from exograv.errors import RecordingError, RigError
from exograv.experiment.steered.requests import Act, Answer, Desk, Stop, Who
from exograv.experiment.steered.view_models import PlotTrace, SessionSnapshot, SkeletonLines
from exograv.model.rig_settings import Settings
from exograv.model.scene import SceneDescription
from exograv.runtime.processes.shared_memory import PARTS, MessageRing

POLL_S = 0.002
"""Period in which either side looks for messages [s]. A press of Stop passes two of them."""

AT_ONCE_MAX = 64
"""Largest number of requests that the parent takes in one period."""

WAITING_MAX = 2 * PARTS
"""Largest number of requests that wait for the desk. The parent ignores further ones."""


class Shown(Settings):
    """Request for the snapshot."""

    what: Literal["shown"] = "shown"
    number: int


class Trace(Settings):
    """Request for the samples to plot from a number on."""

    what: Literal["trace"] = "trace"
    number: int
    since: int


class Skeleton(Settings):
    """Request for the posture."""

    what: Literal["skeleton"] = "skeleton"
    number: int


class Scene(Settings):
    """Request for the scene, unless it is the known one."""

    what: Literal["scene"] = "scene"
    number: int
    known: str
    """Key of the known scene; empty without one."""


class Decide(Settings):
    """Request to decide about an act."""

    what: Literal["act"] = "act"
    number: int
    act: Act
    by: Who


class Keep(Settings):
    """Heartbeat of the steering page. It has no answer."""

    what: Literal["keep"] = "keep"
    heard_s: float
    window_left_s: float | None


class Write(Settings):
    """Message for the recording. It has no answer."""

    what: Literal["write"] = "write"
    topic: Annotated[str, Field(pattern=r"^/[a-z_/]{1,40}$")]
    t: float
    message: dict[str, Any]


class Ready(Settings):
    """Report that the server accepts connections."""

    what: Literal["ready"] = "ready"
    aircraft_port: int | None
    """UDP port for the aircraft's data."""


class Ended(Settings):
    """Report of a server that has ended as it was asked to."""

    what: Literal["ended"] = "ended"
    refused_lines: dict[str, int]
    totals: dict[str, Any] | None
    """Totals of the protocol."""


Request = Shown | Trace | Skeleton | Scene | Decide | Keep | Write | Ready | Ended
REQUEST: TypeAdapter[Request] = TypeAdapter(Annotated[Request, Field(discriminator="what")])


class LinkNames(NamedTuple):
    """Names of the rings in shared memory."""

    requests: str
    answers: str


class DeskClient:
    """`Desk` of the process of the pages: it sends each request to the parent, and waits for the answer."""

    def __init__(self, names: LinkNames):
        """Open the rings of the parent."""
        self._requests, self._answers = MessageRing(names.requests), MessageRing(names.answers)
        self._writing, self._numbers = threading.Lock(), itertools.count(1)
        self._asked = dict[int, Future[Any]]()
        self._scene: SceneDescription | None = None
        self.lost = 0
        """Number of messages for the recording that found no room."""

        threading.Thread(target=self._hear, daemon=True).start()

    def now(self) -> float:
        """Time of CLOCK_MONOTONIC [s], which all processes share."""
        return time.monotonic()

    def shown(self) -> SessionSnapshot:
        """Snapshot for the pages."""
        return self._ask(lambda number: Shown(number=number))

    def trace(self, since: int) -> PlotTrace:
        """Return the samples to plot."""
        return self._ask(lambda number: Trace(number=number, since=since))

    def skeleton(self) -> SkeletonLines:
        """Lines of machine and arm."""
        return self._ask(lambda number: Skeleton(number=number))

    def scene(self) -> SceneDescription | None:
        """Picture of machine and person. It is sent only when it has changed."""
        known = self._scene
        is_new, scene = self._ask(lambda number: Scene(number=number, known="" if known is None else known.key))
        self._scene = scene if is_new else known
        return self._scene

    def act(self, act: Act, by: Who) -> Answer:
        """Have the desk decide about an act."""
        return self._ask(lambda number: Decide(number=number, act=act, by=by))

    def keep(self, window_left_s: float | None = None, heard_s: float | None = None) -> None:
        """Renew the lease. A heartbeat that finds no room is left out, as if it had come late."""
        self.send(Keep(heard_s=self.now() if heard_s is None else heard_s, window_left_s=window_left_s))

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Have a message recorded. It is counted as lost if the parent takes no messages."""
        self.lost += not self._put({"what": "write", "topic": topic, "t": t, "message": dict(message)})

    def send(self, request: Keep | Ready | Ended) -> bool:
        """Send a request without an answer; return False if there is no room."""
        return self._put(request.model_dump(mode="json"))

    def close(self) -> None:
        """End nothing: the machine belongs to the parent."""

    def _put(self, request: Mapping[str, Any]) -> bool:
        with self._writing:
            return self._requests.put_bytes(json.dumps(request, ensure_ascii=False).encode())

    def _ask(self, request: Callable[[int], Request]) -> Any:
        number, answer = next(self._numbers), Future[Any]()
        self._asked[number] = answer
        while not self._put(request(number).model_dump(mode="json")):
            time.sleep(POLL_S)  # the parent stands still: this thread waits, and the event loop goes on
        value = answer.result()
        if isinstance(value, Exception):
            raise value
        return value

    def _hear(self) -> None:
        while True:
            while (answer := self._answers.take()) is not None:
                number, value = answer
                self._asked.pop(number).set_result(value)
            time.sleep(POLL_S)


class DeskLink:
    """Parent's end of the link to one process of the pages. Requests of the process never make the parent wait."""

    def __init__(self, desk: Desk):
        """Create the rings, and begin to answer."""
        self._desk, self._requests, self._answers = desk, MessageRing(), MessageRing()
        self.names = LinkNames(self._requests.name, self._answers.name)
        self.heard_at = time.monotonic()
        """Time of the last request [s]."""

        self.ready: Ready | None = None
        self.ended: Ended | None = None
        self.why_broken = ""
        """Reason why no more requests are taken: one was not valid. Empty without a fault."""

        self.failure: Exception | None = None
        """Programming error of the desk."""

        self._answering, self._waiting, self._is_closed = threading.Lock(), 0, threading.Event()
        # Stop has threads of its own, so that it never waits for another act.
        self._acts, self._stops = ThreadPoolExecutor(2, "acts"), ThreadPoolExecutor(2, "stop")
        self._looks, self._writes = ThreadPoolExecutor(3, "look"), ThreadPoolExecutor(1, "write")
        self._thread = threading.Thread(target=self._serve, name="pages", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Take no more requests, finish those that have begun, and release the memory."""
        self._is_closed.set()
        self._thread.join()
        for threads in (self._acts, self._stops, self._looks, self._writes):
            threads.shutdown(wait=True)
        self._requests.close()
        self._answers.close()

    def _serve(self) -> None:
        while not self._is_closed.wait(POLL_S):
            self._take_all()
        for _ in range(PARTS // AT_ONCE_MAX):
            self._take_all()  # what the process wrote before its end

    def _take_all(self) -> None:
        for _ in range(AT_ONCE_MAX):
            try:
                data = None if self.why_broken else self._requests.take_bytes()
                request = None if data is None else REQUEST.validate_json(data)
            except (RigError, ValidationError) as error:
                self.why_broken = f"{type(error).__name__}: {error}"
                return
            if request is None:
                return
            self.heard_at = time.monotonic()
            self._hear(request)

    def _hear(self, request: Request) -> None:
        match request:
            case Ready():
                self.ready = request
            case Ended():
                self.ended = request
            case Keep():
                self._desk.keep(request.window_left_s, request.heard_s)
            case Write():
                self._give(self._writes, None, self._write, request)
            case Decide():
                threads = self._stops if isinstance(request.act, Stop) else self._acts
                self._give(threads, request.number, self._desk.act, request.act, request.by)
            case Shown():
                self._give(self._looks, request.number, self._desk.shown)
            case Trace():
                self._give(self._looks, request.number, self._desk.trace, request.since)
            case Skeleton():
                self._give(self._looks, request.number, self._desk.skeleton)
            case Scene():
                self._give(self._looks, request.number, self._new_scene, request.known)

    def _write(self, request: Write) -> None:
        try:
            self._desk.write(request.topic, request.t, request.message)
        except RecordingError as error:
            self.why_broken = f"{type(error).__name__}: {error}"

    def _new_scene(self, known: str) -> tuple[bool, SceneDescription | None]:
        scene = self._desk.scene()
        is_known = scene is not None and scene.key == known
        return not is_known, None if is_known else scene

    def _give(self, threads: ThreadPoolExecutor, number: int | None, ask: Callable[..., Any], *values: Any) -> None:
        with self._answering:
            if self._waiting >= WAITING_MAX:
                return
            self._waiting += 1
        threads.submit(self._do, number, ask, *values)

    def _do(self, number: int | None, ask: Callable[..., Any], *values: Any) -> None:
        try:
            value = ask(*values)
        except Exception as error:  # noqa: BLE001 - any error of the desk must end the session, not only this thread
            self.failure, value = error, RigError(f"The desk failed: {error!r}")
        with self._answering:
            self._waiting -= 1
            if number is not None and not self._answers.put((number, value)):
                self._answers.put((number, RigError("The answer does not fit into the link to the pages.")))
