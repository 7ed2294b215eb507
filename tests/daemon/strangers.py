"""Others on the same wire as the vehicle: sockets that speak as whomever they like."""

import socket

from pymavlink.dialects.v20 import ardupilotmega as mavlink


class Stranger:
    """Speaks to one UDP port from a port of its own; a context manager."""

    def __init__(self, port):
        self._address = ("127.0.0.1", port)
        self._packers = {}
        self._parser = mavlink.MAVLink(None)
        self._parser.robust_parsing = True

    def __enter__(self):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        return self

    def __exit__(self, *_):
        self._socket.close()

    def raw(self, data):
        self._socket.sendto(data, self._address)

    def say(self, message, system=1, component=1):
        packer = self._packers.setdefault(
            (system, component), mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        )
        self.raw(message.pack(packer))
        packer.seq = (packer.seq + 1) & 0xFF

    def beat(self, *, armed=False, system=1, component=1, kind=2, firmware=3, custom=0):
        mode = 128 if armed else 0
        message = mavlink.MAVLink_heartbeat_message(kind, firmware, mode, custom, 4, 3)
        self.say(message, system, component)

    def value(self, name, value, system=1, component=1):
        message = mavlink.MAVLink_param_value_message(name.encode(), value, 9, 900, 65535)
        self.say(message, system, component)

    def set(self, name, value, *, system=255, component=190, target=(1, 191)):
        message = mavlink.MAVLink_param_set_message(*target, name.encode(), value, 9)
        self.say(message, system, component)

    def read(self, name, *, system=255, component=190, target=(1, 191)):
        message = mavlink.MAVLink_param_request_read_message(*target, name.encode(), -1)
        self.say(message, system, component)

    def heard(self):
        """Every message that has come here."""
        found = []
        while True:
            try:
                data = self._socket.recv(4096)
            except BlockingIOError:
                return found
            found += self._parser.parse_buffer(data) or []
