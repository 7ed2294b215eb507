"""Links without sockets."""

import pytest

from onboard.mavlink import connection as connection_module
from tests.mavlink.mavlink_peer import FakeAir


@pytest.fixture
def air(monkeypatch):
    air = FakeAir()
    monkeypatch.setattr(connection_module, "open_transport", air.open)
    return air
