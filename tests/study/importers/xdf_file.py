"""Made-up XDF files as LabRecorder writes them. Source of the layout: XDF specification 1.0."""

import struct
from collections.abc import Sequence
from pathlib import Path

HEAD = """<?xml version="1.0"?><info><name>{name}</name><type>{kind}</type><channel_count>{count}</channel_count>
<nominal_srate>{rate}</nominal_srate><channel_format>{form}</channel_format><desc><channels>{labels}</channels></desc>
</info>"""


def chunk(tag: int, content: bytes) -> bytes:
    return b"\x04" + struct.pack("<IH", len(content) + 2, tag) + content


def stream(
    number: int,
    name: str,
    stamps: Sequence[float],
    samples: Sequence[Sequence[str | float]],
    labels: Sequence[str] = (),
    rate: float = 0.0,
    offset: float = 0.0,
) -> bytes:
    """Return all chunks of a stream of texts or of doubles.

    Args:
        number: Number of the stream in the file.
        name: Name of the stream.
        stamps: Stamps of the samples by the sender's clock [s].
        samples: One list per sample.
        labels: Labels of the channels.
        rate: Nominal rate [Hz].
        offset: Offset that LabRecorder measured, every second [s].
    """
    is_text = isinstance(samples[0][0], str)
    head = HEAD.format(
        name=name,
        kind="Markers",
        count=len(samples[0]),
        rate=rate,
        form="string" if is_text else "double64",
        labels="".join(f"<channel><label>{label}</label></channel>" for label in labels),
    )
    of = struct.pack("<I", number)
    body = b"".join(
        b"\x08" + struct.pack("<d", stamp) + b"".join(map(_value, sample))
        for stamp, sample in zip(stamps, samples, strict=True)
    )
    clocks = b"".join(
        chunk(4, of + struct.pack("<dd", float(t), offset)) for t in range(int(min(stamps)) - 1, int(max(stamps)) + 2)
    )
    footer = f"<info><first_timestamp>{stamps[0]}</first_timestamp><sample_count>{len(stamps)}</sample_count></info>"
    return (
        chunk(2, of + head.encode())
        + clocks
        + chunk(3, of + b"\x04" + struct.pack("<I", len(samples)) + body)
        + chunk(6, of + footer.encode())
    )


def _value(value: str | float) -> bytes:
    if isinstance(value, str):
        return b"\x04" + struct.pack("<I", len(value.encode())) + value.encode()
    return struct.pack("<d", value)


def write_xdf(path: Path, *streams: bytes) -> Path:
    header = chunk(1, b'<?xml version="1.0"?><info><version>1.0</version></info>')
    path.write_bytes(b"XDF:" + header + b"".join(streams))
    return path
