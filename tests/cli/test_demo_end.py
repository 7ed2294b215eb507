"""The demonstration as a process: whatever ends it, no simulated autopilot is left behind."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

LIMIT_S = 300.0  # only ends a hopeless test


@pytest.fixture
def hears_interrupts():
    """What runs in a shell's background ignores SIGINT, and its children would, too."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("hears_interrupts")
@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_what_ends_it_ends_its_autopilot(number):
    with subprocess.Popen(
        [sys.executable, "-m", "onboard", "demo", "--once"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as demo:
        try:
            said = next(line for line in demo.stdout if "status page" in line)
            assert "http://127.0.0.1:" in said
            children = Path(f"/proc/{demo.pid}/task/{demo.pid}/children").read_text().split()
            assert children
            demo.send_signal(number)
            rest, _ = demo.communicate(timeout=LIMIT_S)
        finally:
            demo.kill()
    assert demo.returncode == 130
    assert rest.splitlines()[-1] == "onboard: interrupted"
    assert not any(Path(f"/proc/{child}").exists() for child in children)
