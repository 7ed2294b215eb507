"""The unit and the sample configuration travel with the program, and secrets are only root's."""

import stat
from pathlib import Path

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
