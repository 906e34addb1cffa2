"""Session of a simulated controller with its one host: session number, grant, address and increasing sequences."""

import secrets
from collections import Counter
from typing import NamedTuple

from exograv.rig.drives.udp.layout import SEQUENCES, Flag, Type, is_newer
from exograv.rig.drives.udp.packets import Header, Packet, Refusal, RefusedError

Address = tuple[str, int]


class CommandingHost(NamedTuple):
    """Host that commands the controller."""

    session: int
    grant: int
    address: Address


class UdpSession:
    """Session of a controller; times are those of one clock that never goes back [s]."""

    def __init__(self, joints: int, hold_s: float, first_sequence: int = 0):
        """Start free. The first hello takes the controller; a host that is silent for `hold_s` loses it."""
        self._n, self._hold_s = joints, hold_s
        self.holder: CommandingHost | None = None
        self._newest, self._heard_at = 0, 0.0
        self._sequence = first_sequence
        self.refused: Counter[str] = Counter()

    def greet(self, packet: Packet, sender: Address, now: float) -> Flag:
        """Process a hello: give the controller to its sender, or answer that it is taken.

        Raises:
            RefusedError: The hello is an old one of the present host, or names no session.
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
        """Check that a packet is the present host's, and newer than all before.

        Raises:
            RefusedError: The packet is not.
        """
        header, holder = packet.header, self.holder
        if holder is None or (header.session, header.grant, sender) != holder:
            raise RefusedError(Refusal.SESSION)
        if header.joints != self._n:
            raise RefusedError(Refusal.LENGTH)
        if not is_newer(header.sequence, self._newest):
            raise RefusedError(Refusal.SEQUENCE)

    def accept(self, packet: Packet, now: float) -> None:
        """Accept a packet; older ones are refused from now on."""
        self._newest, self._heard_at = packet.header.sequence, now

    def end(self) -> None:
        """Free the controller for other hosts."""
        self.holder = None

    def answer(self, kind: Type, packet: Packet, time_ns: int, flags: Flag = Flag.NONE) -> Header:
        """Return the header of an answer."""
        self._sequence = (self._sequence + 1) % SEQUENCES
        holder, asked = self.holder, packet.header
        grant = 0 if holder is None or flags & Flag.TAKEN else holder.grant
        return Header(kind, self._n, int(flags), asked.session, grant, self._sequence, asked.sequence, time_ns)
