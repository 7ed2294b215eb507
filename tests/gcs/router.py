"""A MAVLink router on loopback: what one peer says, all others hear, as on a real companion."""

import asyncio


class Router(asyncio.DatagramProtocol):
    """Every address that speaks is a peer."""

    def __init__(self):
        self.peers = []
        self.port = 0
        self._transport = None

    async def __aenter__(self):
        loop = asyncio.get_running_loop()
        self._transport, _ = await loop.create_datagram_endpoint(
            lambda: self, local_addr=("127.0.0.1", 0)
        )
        self.port = self._transport.get_extra_info("sockname")[1]
        return self

    async def __aexit__(self, *_):
        self._transport.close()

    def datagram_received(self, data, address):
        if address not in self.peers:
            self.peers.append(address)
        for peer in self.peers:
            if peer != address:
                self._transport.sendto(data, peer)

    def error_received(self, _error):
        """A peer has gone: its port is closed."""
