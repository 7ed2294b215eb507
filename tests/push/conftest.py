"""What the tests of a push share."""

import pytest

from tests.push.pushing import PushWorld


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
