"""A ground station's half of the parameter protocol, and the line between both halves."""

import random

from onboard.mavlink.codec import Codec
from onboard.mavlink.dialect import mavlink

SYSTEM, COMPONENT = 1, 191


class Line:
    """Carries messages one way, over the wire's bytes, with loss, duplication and reordering."""

    def __init__(self, seed, *, system, component, loss=0.0, duplication=0.0, reordering=0.0):
        self._rng = random.Random(seed)
        self._chances = loss, duplication, reordering
        self._held = []
        self._sender = Codec(system=system, component=component)
        self._receiver = Codec()

    def carry(self, messages):
        loss, duplication, reordering = self._chances
        frames = []
        for message in messages:
            frame = self._sender.encode(message)
            if self._rng.random() < loss:
                continue
            if self._rng.random() < reordering:
                self._held.append(frame)
                continue
            frames += [frame] * (1 + (self._rng.random() < duplication))
            frames += self._held
            self._held = []
        return [f.message for f in self._receiver.feed(b"".join(frames))]


class Station:
    """Fetches the list, asks again for what is missing, sets until it is told the value."""

    RETRY_S = 1.0

    def __init__(self, number):
        self.system = 255 - number
        self.values = {}
        self.by_index = {}
        self.count = None
        self.errors = []
        self.wanted = {}
        self._fetching = False
        self._next = 0.0

    @property
    def complete(self):
        return self.count is not None and len(self.by_index) == self.count

    def fetch(self):
        self._fetching = True

    def poll(self, now):
        if now < self._next:
            return []
        self._next = now + self.RETRY_S
        out = [
            mavlink.MAVLink_param_set_message(SYSTEM, COMPONENT, name.encode(), value, 9)
            for name, value in self.wanted.items()
        ]
        if self._fetching and self.count is None:
            out.append(mavlink.MAVLink_param_request_list_message(SYSTEM, COMPONENT))
        elif self._fetching and not self.complete:
            missing = [i for i in range(self.count) if i not in self.by_index][:10]
            out += [
                mavlink.MAVLink_param_request_read_message(SYSTEM, COMPONENT, b"", index)
                for index in missing
            ]
        return out

    def hear(self, message):
        if message.get_type() == "PARAM_VALUE":
            assert message.get_srcComponent() == COMPONENT
            name = message.param_id
            self.values[name] = message.param_value
            self.count = message.param_count
            assert self.by_index.setdefault(message.param_index, name) == name
            if self.wanted.get(name) == message.param_value:
                del self.wanted[name]
        elif message.get_type() == "PARAM_ERROR" and message.target_system == self.system:
            self.errors.append((message.param_id, message.error))
