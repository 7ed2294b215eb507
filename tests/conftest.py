"""Fixtures that every part may use."""

from __future__ import annotations

import asyncio
import gc
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from onboard.core.maths.compiling import prefer_compiled
from sitl.virtual_time import VirtualTimeLoop

prefer_compiled()

# The same examples in every run: a change is judged by what it changes.  Others are looked for
# by hand with --hypothesis-profile=search.
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("search", deadline=None, max_examples=1000)
settings.load_profile("same")


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--sitl=builtin|ardupilot``: which simulated autopilot the end-to-end tests fly."""
    parser.addoption(
        "--sitl",
        choices=("builtin", "ardupilot"),
        default="builtin",
        help="simulated autopilot of the end-to-end tests [builtin]",
    )


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of shared recordings: ONBOARD_RECORDINGS, or beside the project; else skip."""
    beside = Path(__file__).resolve().parents[2] / "shared" / "recordings"
    folder = Path(os.environ.get("ONBOARD_RECORDINGS", beside))
    if not folder.is_dir():
        pytest.skip("no shared recordings beside the project, and ONBOARD_RECORDINGS is not set")
    return folder


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes long comes first: two processes then end at about the same time.

    That is files with slow tests, and then the browser's, the longest of the others.
    """
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: (item.path not in slow, "web" not in item.path.parts))


def pytest_collection_finish() -> None:
    """What is there now stays: six thousand tests and all modules, half a million objects.

    The collector of garbage would look through them again and again, a tenth of the time of tests
    that make many objects.  What a test makes is looked through when it has ended, below, and not
    every 700 objects: a flight is a quarter of a million, and none of them is garbage before.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 20, 20)


@pytest.fixture(autouse=True)
def _garbage_is_told_where_it_is_made() -> Iterator[None]:
    """What a test leaves open, in a cycle or not, is told in it: its fixtures end before this."""
    yield
    gc.collect(1)


def pytest_asyncio_loop_factories(item: pytest.Item) -> dict[str, object]:
    """Tests marked ``virtual_time`` run on a loop whose clock jumps, all others on a common one.

    ArduPilot's own simulator is another process, with a time of its own.
    """
    marker = item.get_closest_marker("virtual_time")
    # Of a real autopilot's process nobody can make the time jump; ``always`` flies none.
    if marker and (item.config.getoption("sitl") == "builtin" or marker.kwargs.get("always")):
        return {"virtual": VirtualTimeLoop}
    return {"real": asyncio.new_event_loop}


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """With ``--dist loadfile``: files that share what takes long are run by one process."""
    if config.getoption("dist") != "loadfile":
        return None
    from tests.scheduling import SharedWork  # noqa: PLC0415 - only where there is xdist

    return SharedWork(config, log)
