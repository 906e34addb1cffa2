"""Controller that speaks docs/reference/udp_protocol.md, as a template: plain Python, no packages to install.

`python peer.py [PORT]`. Put your own drives into `Motor`. The rest lets them obey valid commands only.
"""

import contextlib
import math
import secrets
import select
import socket
import struct
import sys
import time
import zlib

MAGIC, VERSION, JOINTS_MAX = 0x56475845, 1, 16
HELLO, NAMEPLATE, POLL, STATE, COMMAND, BYE = range(1, 7)
ENABLE, ACKNOWLEDGE, TAKEN = 1, 2, 4
ENABLED, PRESENT, WATCHDOG, TEMPERATURE = 1, 2, 1, 2  # bits of status, bits of fault

HEADER, OWN = struct.Struct("<IBBBBIIIIQ"), struct.Struct("<II")
NAMEPLATE_JOINT, STATE_JOINT, COMMAND_JOINT = map(struct.Struct, ("<32sfffI", "<ddffHHHH", "<ff"))
HELLO_BYTES = HEADER.size + OWN.size + JOINTS_MAX * NAMEPLATE_JOINT.size + 4
STATES = 32  # number of recent states that a command may answer

WATCHDOG_S, PERIOD_S = 0.020, 0.001
PLATES = (  # joint, rated and greatest current [A], brake [N·m·s/rad]: the values must equal those of drives.toml
    ("shoulder_flexion", 3.0, 9.0, 10.0),
    ("shoulder_abduction", 3.0, 9.0, 10.0),
    ("shoulder_rotation", 2.2, 6.7, 10.0),
    ("elbow_flexion", 2.2, 6.7, 4.0),
)
N = len(PLATES)
LENGTHS = {  # by type: joints in the header, bytes; a poll is as long as the state that answers it
    HELLO: (0, HELLO_BYTES),
    POLL: (N, HEADER.size + OWN.size + N * STATE_JOINT.size + 4),
    COMMAND: (N, HEADER.size + OWN.size + N * COMMAND_JOINT.size + 4),
    BYE: (N, HEADER.size + 4),
}


class Motor:
    """Pendulum with a motor, in place of a real drive."""

    INERTIA, WEIGHT, FRICTION, PER_AMPERE, WARM_S = 0.5, 5.0, 0.5, 4.0, 60.0

    def __init__(self, rated, most, brake):
        self.rated, self.most, self.brake = rated, most, brake
        self.q, self.v, self.current, self.temperature = 0.0, 0.0, 0.0, 25.0
        self.fault, self.enabled, self.samples = 0, False, 0
        self.asked, self.damping, self.told_at, self.until = 0.0, 0.0, 0.0, 0.0

    def off(self, fault=0):
        """Switch the motor off; the drive brakes from now on."""
        self.fault |= fault
        self.enabled, self.asked = False, 0.0

    def tell(self, current, damping, now, until):
        """Take a command: current [A] and damping [N·m·s/rad] until a time [s]."""
        self.asked, self.damping, self.told_at, self.until = current, damping, now, until

    def step(self, now, dt):
        """Apply the drive's own reactions first: watchdog, heat, end of the command's life, limit."""
        if self.enabled and now - self.told_at > WATCHDOG_S:
            self.off(WATCHDOG)
        if self.temperature > 110.0:
            self.off(TEMPERATURE)
        is_driven = self.enabled and now < self.until
        self.current = max(-self.most, min(self.most, self.asked)) if is_driven else 0.0
        damping = self.damping if is_driven else self.brake
        self.temperature += (25.0 + 60.0 * (self.current / self.rated) ** 2 - self.temperature) * dt / self.WARM_S
        push = self.PER_AMPERE * self.current - self.WEIGHT * math.sin(self.q)
        # The damping is that of the coming step (implicit Euler), so the step is stable for any damping.
        self.v = (self.v + dt / self.INERTIA * push) / (1.0 + dt / self.INERTIA * (damping + self.FRICTION))
        self.q += dt * self.v
        self.samples = (self.samples + 1) % 2**16  # with a real drive: only when its sensors were read anew


class Controller:
    """`receive` for each packet, `step` for each period; `now` [s] is any clock that never goes back."""

    def __init__(self):
        self.motors = [Motor(*plate[1:]) for plate in PLATES]
        self.session = self.grant = self.newest = self.sequence = self.command = self.refused = 0
        self.address, self.heard_at, self.was_enabled = None, 0.0, False
        self.states = [(-1, 0.0)] * STATES

    def receive(self, data, sender, now):
        """Return the answer to a packet, or None. An invalid packet is only counted."""
        answer = self._believe(data, sender, now)
        self.refused = (self.refused + (answer is False)) % 2**32
        return answer or None

    def _believe(self, data, sender, now):
        if len(data) < HEADER.size + 4:
            return False
        magic, version, kind, n, flags, session, grant, sequence, answers, _ = HEADER.unpack_from(data)
        if (magic, version) != (MAGIC, VERSION) or LENGTHS.get(kind) != (n, len(data)):
            return False
        if zlib.crc32(data[:-4]) != int.from_bytes(data[-4:], "little"):
            return False
        is_newer = 0 < (sequence - self.newest) % 2**32 < 2**31
        if kind == HELLO:
            return self._greet(session, grant, sequence, is_newer, sender, now)
        if (session, grant, sender) != (self.session, self.grant, self.address) or not session or not is_newer:
            return False
        if kind == COMMAND and not self._obey(data, flags, answers, now):
            return False
        self.newest, self.heard_at = sequence, now
        self.command = sequence if kind == COMMAND else self.command
        if kind == BYE:
            self._all_off()
            self.session = 0
        return self._state(sequence, now) if kind == POLL else None

    def _greet(self, session, grant, sequence, is_newer, sender, now):
        """Answer a hello. The first host keeps the controller until BYE, or a silence of the watchdog's time."""
        is_holder = (session, sender) == (self.session, self.address)
        if session == 0 or grant != 0 or (is_holder and not is_newer):
            return False
        if not is_holder:
            if self.session and now - self.heard_at <= WATCHDOG_S:
                return self._nameplate(TAKEN, session, 0, sequence, now)
            self.session, self.grant, self.address = session, secrets.randbelow(2**32 - 1) + 1, sender
        self.newest, self.heard_at = sequence, now
        self._all_off()
        return self._nameplate(0, session, self.grant, sequence, now)

    def _all_off(self):
        self.was_enabled, self.command, self.states = False, 0, [(-1, 0.0)] * STATES
        for motor in self.motors:
            motor.off()

    def _obey(self, data, flags, answers, now):
        """Return True if the command is valid. Switching off is never too late; every other command may be."""
        at = HEADER.size + OWN.size
        told = [COMMAND_JOINT.unpack_from(data, at + k * COMMAND_JOINT.size) for k in range(len(self.motors))]
        if not all(math.isfinite(i) and math.isfinite(d) and d >= 0.0 for i, d in told):
            return False
        age_us, life_us = OWN.unpack_from(data, HEADER.size)
        number, polled_at = self.states[answers % STATES]
        until = min(polled_at + 1e-6 * age_us, now) + 1e-6 * life_us
        if flags & (ENABLE | ACKNOWLEDGE) and (number != answers or until <= now):
            return False
        for motor, (current, damping) in zip(self.motors, told, strict=True):
            if not flags & ENABLE:
                motor.off()
                if flags & ACKNOWLEDGE:  # clear the faults that are over
                    motor.fault &= TEMPERATURE if motor.temperature > 95.0 else 0
            elif not self.was_enabled:  # the first such command only enables, at zero torque
                motor.enabled = not motor.fault
                motor.tell(0.0, 0.0, now, now)
            elif motor.enabled:
                motor.tell(current, damping, now, until)
        self.was_enabled = bool(flags & ENABLE)
        return True

    def _state(self, asked, now):
        body = OWN.pack(self.command, self.refused)
        for motor in self.motors:
            status = PRESENT | (ENABLED if motor.enabled else 0)
            numbers = motor.q, math.nan, motor.current, motor.temperature
            body += STATE_JOINT.pack(*numbers, status, motor.fault, 0, motor.samples)
        self.states[(self.sequence + 1) % STATES] = (self.sequence + 1) % 2**32, now
        return self._packet(STATE, 0, self.session, self.grant, asked, now, body)

    def _nameplate(self, flags, session, grant, asked, now):
        body = OWN.pack(round(1e6 * WATCHDOG_S), round(1e6 * PERIOD_S))
        body += b"".join(NAMEPLATE_JOINT.pack(name.encode(), *numbers, 1) for name, *numbers in PLATES)
        filled = body.ljust(HELLO_BYTES - HEADER.size - 4, b"\0")
        return self._packet(NAMEPLATE, flags, session, grant, asked, now, filled)

    def _packet(self, kind, flags, session, grant, asked, now, body):
        self.sequence = (self.sequence + 1) % 2**32
        who = MAGIC, VERSION, kind, N, flags, session, grant, self.sequence, asked, int(1e9 * now)
        data = HEADER.pack(*who) + body
        return data + zlib.crc32(data).to_bytes(4, "little")

    def step(self, now, dt=PERIOD_S):
        """Advance one period; call this also when no packet arrives."""
        for motor in self.motors:
            motor.step(now, dt)


def main():
    """Serve on one port until Ctrl-C."""
    controller = Controller()
    port = int(sys.argv[1]) if len(sys.argv) > 1 else 47100
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", port))  # use the address of the cable to the host, never all addresses
        print("listening on port", link.getsockname()[1], flush=True)
        due = time.monotonic()
        while True:
            due = max(due + PERIOD_S, time.monotonic() - 0.1)
            while (left := due - time.monotonic()) > 0.0:
                if select.select([link], [], [], left)[0]:
                    data, sender = link.recvfrom(2048)
                    if answer := controller.receive(data, sender, time.monotonic()):
                        link.sendto(answer, sender)
            controller.step(time.monotonic())


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        main()
