"""What the tests of a push share."""

import os

import pytest

from tests.push.pushing import PushWorld


@pytest.fixture(autouse=True)
def no_fsync(monkeypatch):
    """What matters is the order of things, not the disk; of what is closed it fails as ever."""
    monkeypatch.setattr(os, "fsync", os.fstat)


@pytest.fixture(params=["eager", "patient"])
def world(tmp_path, request):
    w = PushWorld(tmp_path / "journal.jsonl")
    w.eager = request.param == "eager"
    yield w
    w.journal.close()


@pytest.fixture
def path(tmp_path):
    """Of a journal."""
    return tmp_path / "state" / "journal.jsonl"
