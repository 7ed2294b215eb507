"""What the service manager hears, on a real datagram socket."""

import os
import socket

import pytest

from onboard.daemon.process.notify import Notifier


@pytest.fixture
def manager(tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver:
        receiver.bind(str(tmp_path / "notify"))
        receiver.settimeout(5.0)
        yield receiver


def test_fields_arrive_in_one_datagram(manager, monkeypatch):
    monkeypatch.setenv("NOTIFY_SOCKET", manager.getsockname())
    Notifier.from_environment().send(READY="1", STATUS="calibrating")
    assert manager.recv(4096) == b"READY=1\nSTATUS=calibrating"


def test_abstract_sockets_are_understood():
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver:
        receiver.bind(f"\0onboard-test-{os.getpid()}")
        receiver.settimeout(5.0)
        Notifier(f"@onboard-test-{os.getpid()}").send(WATCHDOG="1")
        assert receiver.recv(4096) == b"WATCHDOG=1"


@pytest.mark.parametrize("address", [None, "", "nowhere/at/all"])
def test_without_a_manager_nothing_happens(address):
    Notifier(address).send(READY="1")
