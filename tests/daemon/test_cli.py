"""run, status and the actions as a person calls them: real processes, real sockets."""

import asyncio
import json
import os
import signal
import subprocess
import sys

import pytest
from rich.cells import cell_len

from onboard.cli.main import run as onboard
from tests.daemon.daemons import calibration, convinced, until
from tests.daemon.standing_vehicle import Vehicle

pytestmark = pytest.mark.virtual_time
EXECUTE = "from onboard.cli.main import main; main()"


@pytest.fixture
def config(tmp_path, port):
    file = tmp_path / "vehicle.toml"
    file.write_text(
        f'[link]\nendpoints = ["udpin:127.0.0.1:{port}"]\nheartbeat_limit_s = 60\n'
        f'[state]\ndirectory = "{tmp_path / "state"}"\n[http]\nport = 0\n'
    )
    return file


def start(*arguments):
    return subprocess.Popen(  # noqa: S603 - our own program
        [sys.executable, "-c", EXECUTE, *map(str, arguments)],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={k: v for k, v in os.environ.items() if k != "NOTIFY_SOCKET"},
    )


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 0), (signal.SIGINT, 130)])
def test_run_serves_until_a_signal(config, number, status):
    process = start("run", "--config", config)
    for line in process.stderr:
        if "status and control at" in line:
            break
    process.send_signal(number)
    _, rest = process.communicate(timeout=60)
    assert process.returncode == status
    assert "Traceback" not in rest


@pytest.mark.parametrize(
    ("text", "status", "words"),
    [
        ("[link]\nendpoint = 1\n", 2, "[link] endpoint: unknown key"),
        ('[link]\nendpoints = ["carrier:pigeon"]\n', 2, "carrier:pigeon"),
        ('[link]\nendpoints = ["udpin:127.0.0.1:0"]\nheartbeat_limit_s = 0.1\n', 3, "no heartbeat"),
        ('[http]\ntoken_file = "/nonexistent/token"\n', 2, "[http] token_file"),
        ("[link", 2, "not TOML"),
    ],
)
def test_what_is_wrong_is_one_line_and_a_status(config, capsys, tmp_path, text, status, words):
    config.write_text(text)
    arguments = ["run", "--config", str(config), "--state", str(tmp_path / "state")]
    if "token" not in text:
        config.write_text(text + ("[http]\nenabled = false\n" if status == 3 else ""))
    assert onboard(arguments) == status
    told = capsys.readouterr().err.strip().splitlines()
    assert words in told[-1]
    assert told[-1].startswith("onboard: ")


def test_check_only_reads(config, capsys):
    assert onboard(["run", "--config", str(config), "--check"]) == 0
    assert "valid" in capsys.readouterr().out


@pytest.mark.parametrize("verb", ["status", "approve", "reject", "rollback", "reset"])
def test_without_a_daemon_it_says_so(capsys, verb):
    assert onboard([verb, "--url", "http://127.0.0.1:9"]) == 3
    assert "no onboard service answers" in capsys.readouterr().err


async def call(capsys, *arguments):
    """Run a verb in a thread, for the daemon is in this loop."""
    status = await asyncio.to_thread(onboard, list(arguments))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


async def test_status_fits_80_columns_and_tells_what_matters(
    document, daemon, port, capsys, monkeypatch
):
    monkeypatch.setenv("COLUMNS", "80")
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port):
        long = calibration(2, note="a note that goes on and on, as notes of the core may " * 3)
        convinced(service, calibration(), long)
        await until(lambda: service.snapshot().push.approval_needed)
        await until(lambda: service.snapshot().link.armed is False)
        status, out, _ = await call(capsys, "status", "--url", service.server.url)
        assert status == 0
        assert max(map(cell_len, out.splitlines())) <= 80
        for words in ("ardupilot copter", "disarmed", "IMU 1: waits for your", "INS_ACC2OFFS_Z"):
            assert words in out
        assert "1.02000" in out
        assert "onboard approve" in out
        status, out, _ = await call(capsys, "status", "--json", "--url", service.server.url)
        assert json.loads(out)["schema"] == "onboard.state/1"


async def test_approve_and_rollback_from_the_terminal(document, daemon, port, capsys):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        url = service.server.url
        status, _, err = await call(capsys, "approve", "--url", url)
        assert (status, "nothing waits" in err) == (2, True)
        convinced(service, calibration())
        await until(lambda: service.snapshot().push.approval_needed)
        status, out, _ = await call(capsys, "approve", "1", "--url", url)
        assert (status, "IMU 1" in out) == (0, True)
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        before = service.snapshot().push.written[0].values[0]
        status, out, _ = await call(capsys, "rollback", "--url", url)
        assert (status, "rolling back" in out) == (0, True)
        shown = next(line for line in out.splitlines() if before.name in line)
        assert shown.split() == [before.name, f"{before.written:.5f}", f"{before.before:.5f}"]
        assert out.index(before.name) < out.index("rolling back")
        await until(lambda: vehicle.parameters["INS_ACCSCAL_X"] == 1.0)


async def test_a_wrong_token_is_told(document, daemon, capsys, tmp_path):
    document["http"]["token"] = "open"
    (tmp_path / "token").write_text("wrong\n")
    (tmp_path / "token").chmod(0o600)
    async with daemon(document) as service:
        status, _, err = await call(
            capsys,
            *("reset", "--url", service.server.url, "--token-file", str(tmp_path / "token")),
        )
        assert (status, "token" in err) == (2, True)
        (tmp_path / "token").write_text("open\n")
        status, out, _ = await call(
            capsys,
            *("reset", "--url", service.server.url, "--token-file", str(tmp_path / "token")),
        )
        assert (status, "forgotten" in out) == (0, True)
