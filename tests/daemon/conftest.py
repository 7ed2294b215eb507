"""What the daemon's tests share: a configuration each, and little patience."""

import socket

import pytest

from tests.daemon.daemons import hurried, running


@pytest.fixture
def port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def document(tmp_path, port):
    """A configuration for this test alone; change it before starting a daemon."""
    return {
        "link": {"endpoints": [f"udpin:127.0.0.1:{port}"], "heartbeat_limit_s": 30.0},
        "push": {"disarmed_s": 2.0},
        "state": {"directory": str(tmp_path / "state")},
        "http": {"port": 0},
    }


@pytest.fixture(autouse=True)
def impatient(request, monkeypatch):
    """Who flies at many times its pace is listened to as closely as in real time."""
    virtual = request.node.get_closest_marker("virtual_time") is not None
    hurried(monkeypatch, virtual=virtual and not hasattr(request.module, "flying"))


@pytest.fixture
def daemon():
    """``async with daemon(document) as service``."""
    return running
