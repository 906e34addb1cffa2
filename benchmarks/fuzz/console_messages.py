"""Messages of a browser: `read_message` returns a message or the reason to close the line, and raises nothing."""

import contextlib

from pydantic import ValidationError

from console_fuzz import Nonsense
from exograv.console.limits import MESSAGE_MAX_BYTES
from exograv.console.messages import ActMessage, read_message
from exograv.console.permissions import ACTS
from exograv.experiment.steered.requests import ACT

MESSAGES = 200


def seeds() -> list[bytes]:
    """Return messages of benchmarks/console_fuzz.py."""
    nonsense = Nonsense(1000)
    batches = [nonsense.batch() for _ in range(MESSAGES // 10)]
    texts = [text.encode() if isinstance(text, str) else text for batch in batches for text in batch]
    return [text for text in texts if len(text) < MESSAGE_MAX_BYTES][:MESSAGES]


def read(data: bytes) -> None:
    """Read a text as the server does: bytes that are not UTF-8 never become a message of a WebSocket."""
    message = read_message(data.decode("utf-8", "ignore"))
    if isinstance(message, ActMessage) and message.act.get("kind") in ACTS:
        with contextlib.suppress(ValidationError):
            ACT.validate_python({**message.act, "id": message.id, "made_at_s": message.made})
