"""Who commands a simulated controller: one host, by session, grant, address and ever newer packets."""

import secrets
from collections import Counter
from typing import NamedTuple

from exograv.rig.drives.udp.layout import SEQUENCES, Flag, Type, is_newer
from exograv.rig.drives.udp.packets import Header, Packet, Refusal, RefusedError

Address = tuple[str, int]


class CommandingHost(NamedTuple):
    """The host that commands."""

    session: int
    grant: int
    address: Address


class UdpSession:
    """Times are those of one clock that never goes back [s]."""

    def __init__(self, joints: int, hold_s: float, first_sequence: int = 0):
        """Free for whoever says hello first, and again when that host has been silent for `hold_s`."""
        self._n, self._hold_s = joints, hold_s
        self.holder: CommandingHost | None = None
        self._newest, self._heard_at = 0, 0.0
        self._sequence = first_sequence
        self.refused: Counter[str] = Counter()

    def greet(self, packet: Packet, sender: Address, now: float) -> Flag:
        """A hello: whoever says it has the controller now, or is told that it is taken.

        Raises:
            RefusedError: It is an old one of the host that has it, or names no session.
        """
        header, holder = packet.header, self.holder
        if header.session == 0 or header.grant != 0:
            raise RefusedError(Refusal.SESSION)
        if holder is not None and (header.session, sender) == (holder.session, holder.address):
            if not is_newer(header.sequence, self._newest):
                raise RefusedError(Refusal.SEQUENCE)
        elif holder is not None and now - self._heard_at <= self._hold_s:
            return Flag.TAKEN
        else:
            self.holder = CommandingHost(header.session, secrets.randbelow(SEQUENCES - 1) + 1, sender)
        self._newest, self._heard_at = header.sequence, now
        return Flag.NONE

    def check(self, packet: Packet, sender: Address) -> None:
        """Whether it is the holder's, and newer than all before.

        Raises:
            RefusedError: It is not.
        """
        header, holder = packet.header, self.holder
        if holder is None or (header.session, header.grant, sender) != holder:
            raise RefusedError(Refusal.SESSION)
        if header.joints != self._n:
            raise RefusedError(Refusal.LENGTH)
        if not is_newer(header.sequence, self._newest):
            raise RefusedError(Refusal.SEQUENCE)

    def accept(self, packet: Packet, now: float) -> None:
        """It is believed, so that older ones are not any more."""
        self._newest, self._heard_at = packet.header.sequence, now

    def end(self) -> None:
        """Free for others."""
        self.holder = None

    def answer(self, kind: Type, packet: Packet, time_ns: int, flags: Flag = Flag.NONE) -> Header:
        """The header of an answer."""
        self._sequence = (self._sequence + 1) % SEQUENCES
        holder, asked = self.holder, packet.header
        grant = 0 if holder is None or flags & Flag.TAKEN else holder.grant
        return Header(kind, self._n, int(flags), asked.session, grant, self._sequence, asked.sequence, time_ns)
