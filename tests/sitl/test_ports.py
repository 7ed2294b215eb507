"""Several simulators at once: each has ports of its own, whoever was quicker."""

import asyncio
import sys

import pytest

from sitl.ardupilot import process
from sitl.errors import SitlError

LIKE_ARDUPILOT = """#!{python}
import socket, sys, time
port = 5760 + 10 * int(sys.argv[sys.argv.index("-I") + 1])
listening = socket.socket()
try:
    listening.bind(("127.0.0.1", port))
except OSError:
    sys.exit(f"bind failed on port {{port}} - {said}")
listening.listen()
print("SERIAL0 on TCP port", port, flush=True)
time.sleep(60)
"""


def binary(folder, said="Address already in use"):
    path = folder / "arducopter"
    path.write_text(LIKE_ARDUPILOT.format(python=sys.executable, said=said))
    path.chmod(0o755)
    return folder


async def test_who_comes_too_late_for_the_ports_takes_others(tmp_path, monkeypatch):
    free, asked = process._free_instance, []
    first = free()

    def the_same_for_both():
        asked.append(first if len(asked) < 2 else free())
        return asked[-1]

    monkeypatch.setattr(process, "_free_instance", the_same_for_both)
    both = [process.ArdupilotProcess("copter", folder=binary(tmp_path)) for _ in range(2)]
    try:
        await asyncio.gather(*(p.start() for p in both))
        assert len({p.ports for p in both}) == 2
        assert len(asked) == 3
    finally:
        for p in both:
            await p.stop()


async def test_what_ends_for_another_reason_is_said(tmp_path, monkeypatch):
    free = process._free_instance()
    monkeypatch.setattr(process, "_free_instance", lambda: free)
    one, other = (
        process.ArdupilotProcess("copter", folder=binary(tmp_path, "no such device"))
        for _ in range(2)
    )
    try:
        await one.start()
        with pytest.raises(SitlError, match=r"ended at once: bind failed.*no such device"):
            await other.start()
    finally:
        await one.stop()
        await other.stop()
