"""The systemd unit, judged by systemd itself where there is one."""

import configparser
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from onboard.daemon.mqtt import limits as mqtt_limits
from onboard.daemon.process import limits

UNIT = Path(__file__).parents[2] / "systemd" / "onboard.service"
LIMIT = 2.0
"""Exposure level that systemd calls OK."""


@pytest.fixture
def analyze(tmp_path):
    """Run systemd-analyze on the unit, with a program that exists."""
    program = shutil.which("systemd-analyze")
    if program is None:
        pytest.skip("systemd-analyze is not installed")
    unit = tmp_path / UNIT.name
    unit.write_text(UNIT.read_text().replace("/opt/onboard/bin/onboard", sys.executable))

    def run(*arguments):
        return subprocess.run(  # noqa: S603 - a program of the system
            [program, *arguments, str(unit)], capture_output=True, text=True, check=False
        )

    return run


def test_the_unit_is_valid(analyze):
    result = analyze("verify", "--man=no")
    assert (result.returncode, result.stderr) == (0, "")


def test_the_unit_exposes_little(analyze):
    result = analyze("security", "--offline=true", "--no-pager", f"--threshold={LIMIT * 10:.0f}")
    assert result.returncode == 0, result.stdout[-200:]


def test_the_watchdog_and_the_timeouts_fit_the_service():
    unit = configparser.ConfigParser(strict=False, interpolation=None)
    unit.optionxform = str
    unit.read_string(UNIT.read_text())
    settings = unit["Service"]
    assert settings["Type"] == "notify"
    assert settings["StateDirectory"] == "onboard"
    assert float(settings["WatchdogSec"]) > 10.0
    # One after the other at the worst: the page and the recorder take a second or two besides.
    farewell = limits.FINISH_PUSH_S + mqtt_limits.FAREWELL_S + limits.SAVE_S
    assert float(settings["TimeoutStopSec"]) >= farewell + 5.0
    assert set(settings["RestartPreventExitStatus"].split()) == {"2", "203"}  # EXIT_EXEC
    # What a start waits after others that came to nothing leaves time for the start itself.
    assert float(settings["TimeoutStartSec"]) >= 2.0 * limits.LONGEST_WAIT_S
    assert settings["RuntimeDirectory"] == "onboard"
    assert settings["RuntimeDirectoryPreserve"] == "restart"
