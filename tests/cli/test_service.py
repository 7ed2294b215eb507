"""The unit and the sample configuration travel with the program, and secrets are only root's."""

import stat
from pathlib import Path

import pytest

from onboard.cli import service
from onboard.cli.main import run
from onboard.cli.service import PROGRAM, SAMPLE_PLACE, TOKEN_PLACE, UNIT_PLACE, _program
from onboard.daemon.setup import configuration, secret_files

ROOT = Path(__file__).resolve().parents[2]


def test_what_is_shown_is_what_the_repository_shows(capsys):
    for what, name in (("unit", "onboard.service"), ("configuration", "onboard.toml")):
        assert run(["service", "show", what]) == 0
        assert capsys.readouterr().out == (ROOT / "systemd" / name).read_text()


def test_it_installs_what_is_not_there_and_changes_nothing_else(tmp_path, capsys):
    assert run(["service", "install", "--root", str(tmp_path), "--token"]) == 0
    unit = (tmp_path / UNIT_PLACE).read_text()
    assert f"ExecStart={_program()} run" in unit
    assert PROGRAM in (ROOT / "systemd" / "onboard.service").read_text()
    configuration.load(tmp_path / SAMPLE_PLACE)
    token = tmp_path / TOKEN_PLACE
    assert stat.S_IMODE(token.stat().st_mode) == 0o600
    secret = secret_files.read_secret(str(token), key="[http] token_file")
    assert len(secret) >= 32
    assert secret not in capsys.readouterr().out

    (tmp_path / SAMPLE_PLACE).write_text("[push]\npolicy = 'never'\n")
    assert run(["service", "install", "--root", str(tmp_path), "--token"]) == 0
    assert configuration.load(tmp_path / SAMPLE_PLACE).push.policy == "never"
    assert token.read_text().strip() == secret

    (tmp_path / UNIT_PLACE).write_text(unit + "# mine\n")
    assert run(["service", "install", "--root", str(tmp_path)]) == 2
    assert (tmp_path / UNIT_PLACE).read_text().endswith("# mine\n")
    assert run(["service", "install", "--root", str(tmp_path), "--force"]) == 0
    assert (tmp_path / UNIT_PLACE).read_text() == unit


def test_a_place_that_cannot_be_written_is_one_line(tmp_path, capsys):
    (tmp_path / "etc").write_text("a file")
    assert run(["service", "install", "--root", str(tmp_path)]) == 2
    assert "etc" in capsys.readouterr().err


def test_a_new_configuration_has_the_endpoints_that_were_given(tmp_path, capsys):
    serial, router = "serial:/dev/ttyAMA0:921600", "udpin:127.0.0.1:14650"
    install = ["service", "install", "--root", str(tmp_path), "--endpoint", serial]
    assert run([*install, "--endpoint", router]) == 0
    assert configuration.load(tmp_path / SAMPLE_PLACE).link.endpoints == (serial, router)
    # What somebody has edited is not replaced, and not passed over in silence either.
    assert run(install) == 2
    assert "[link] endpoints" in capsys.readouterr().err


def test_an_endpoint_that_cannot_be_leaves_nothing_behind(tmp_path, capsys):
    for wrong in ("ttyAMA0", "serial:/dev/ttyAMA0:12", "tcp:127.0.0.1:0"):
        assert run(["service", "install", "--root", str(tmp_path), "--endpoint", wrong]) == 2
        assert wrong in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_program_that_the_unit_hides_is_not_installed_as_a_service(monkeypatch, capsys):
    """``pipx install`` puts it below the home, where ProtectHome leaves nothing to see."""
    unit = (ROOT / "systemd" / "onboard.service").read_text()
    assert "ProtectHome=yes" in unit
    assert "PrivateTmp=yes" in unit
    monkeypatch.setattr(service, "_install", lambda *_, **__: pytest.fail("it was installed"))
    for home in (f"{hidden}/pi/.local/share/pipx/venvs/onboard" for hidden in service.HIDDEN):
        monkeypatch.setattr(service, "_program", lambda home=home: f"{home}/bin/onboard")
        assert run(["service", "install"]) == 2
        said = capsys.readouterr().err
        assert home in said
        assert "/opt/pipx" in said


def test_it_is_started_by_systemd_and_a_failure_is_told(tmp_path, monkeypatch, capsys):
    calls = tmp_path / "calls"
    systemctl = tmp_path / "systemctl"
    monkeypatch.setattr(service, "_reachable", lambda: None)
    monkeypatch.setattr(service, "_install", lambda *_, **__: [])
    monkeypatch.setattr(service, "SAMPLE_PLACE", tmp_path / "none.toml")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    systemctl.write_text(f'#!/bin/sh\necho "$@" >> {calls}\n')
    systemctl.chmod(0o755)
    assert run(["service", "install", "--start"]) == 0
    assert calls.read_text().splitlines() == ["daemon-reload", "enable --now onboard.service"]
    systemctl.write_text("#!/bin/sh\necho no bus >&2; exit 1\n")
    assert run(["service", "install", "--start"]) == 2
    assert "no bus" in capsys.readouterr().err
    systemctl.unlink()
    monkeypatch.setenv("PATH", str(tmp_path))
    assert run(["service", "install", "--start"]) == 2
    assert "systemctl" in capsys.readouterr().err
    assert run(["service", "install", "--start", "--root", str(tmp_path)]) == 2
