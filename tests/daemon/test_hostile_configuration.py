"""Whatever a configuration file holds: settings that can be used, or one line that says why not."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.cli.main import run as onboard
from onboard.daemon.setup import configuration, settings
from onboard.daemon.setup.secret_files import read_secret
from onboard.errors import ConfigurationError, OnboardError
from onboard.toml_file import LONGEST_FILE, read_toml

HOSTILE = {
    "nested lists": "a = " + "[" * 3000 + "]" * 3000,
    "nested tables": "a = " + "{b = " * 700 + "1" + "}" * 700,
    "nested over lines": "a = [\n" + "[\n" * 3000 + "]\n" * 3001,
    "a key of many parts": "a." * 20_000 + "b = 1",
    "an integer of 5000 digits": "[push]\ndisarmed_s = " + "1" * 4000 + "1" * 90,
    "many digits": "[push]\ndisarmed_s = " + "1" * 5000,
    "a long file": "# " + "x" * 70 + "\n",
    "infinity": "[recording]\nfile_size_mb = inf",
    "not a number": "[push]\ndisarmed_s = nan",
    "infinite wait": "[push]\ndisarmed_s = inf",
    "infinite memory": "[estimator]\nmemory_s = inf",
    "a NUL in a path": '[state]\ndirectory = "a\\u0000b"',
    "a NUL in a secret's path": '[link]\nsigning_key_file = "a\\u0000b"',
    "a NUL in an endpoint": '[link]\nendpoints = ["udpin:a\\u0000b:1"]',
    "a line break in a name": '[mqtt]\nhost = "a\\nb"',
    "a blank token for everybody": '[http]\naddress = "0.0.0.0"\ntoken = "   "',
    "a blank token": '[http]\ntoken = " \\t"',
    "no text": b"\xff\xfe\x00",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_it_is_one_line_and_status_2_with_and_without_check(tmp_path, capsys, monkeypatch, name):
    monkeypatch.setenv("STATE_DIRECTORY", str(tmp_path / "state"))
    text = HOSTILE[name]
    if name == "a long file":
        text *= LONGEST_FILE // len(text) + 1
    file = tmp_path / "vehicle.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    for arguments in (["--check"], []):
        assert onboard(["run", "--config", str(file), *arguments]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert str(file) in line
    assert not (tmp_path / "state").exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[http]\ntoken_file = "{0}/none"\n', "token_file"),
        ('[link]\nsigning_key_file = "{0}/none"\n', "signing_key_file"),
        ('[mqtt]\nenabled = true\nusername = "u"\npassword_file = "{0}/none"\n', "password_file"),
        ('[mqtt]\nenabled = true\ntls = true\nca_file = "{0}/none"\n', "ca_file"),
        ('[state]\ndirectory = "{0}/vehicle.toml/below"\n', "ot a directory"),
        ('[http]\naddress = "a..b"\ntoken = "x"\n', "a..b"),
        ('[link]\nendpoints = ["udpin:a..b:14550"]\n', "a..b"),
    ],
)
def test_check_finds_what_would_end_the_start(tmp_path, capsys, monkeypatch, text, words):
    monkeypatch.setenv("STATE_DIRECTORY", str(tmp_path / "state"))
    file = tmp_path / "vehicle.toml"
    file.write_text(text.format(tmp_path))
    for arguments in (["--check"], []):
        assert onboard(["run", "--config", str(file), *arguments]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()[-1:]
        assert words in line


@pytest.mark.parametrize("mode", [0o644, 0o604, 0o660, 0o666, 0o601])
def test_a_secret_that_others_may_read_or_change_is_refused(tmp_path, mode):
    secret = tmp_path / "token"
    secret.write_text("open sesame\n")
    secret.chmod(mode)
    with pytest.raises(ConfigurationError, match=r"token_file.*chmod 600"):
        read_secret(str(secret), key="[http] token_file")
    for allowed in (0o600, 0o400, 0o440, 0o640):
        secret.chmod(allowed)
        assert read_secret(str(secret), key="[http] token_file") == "open sesame"


def test_a_configuration_with_a_token_is_a_secret_itself(tmp_path, capsys):
    file = tmp_path / "vehicle.toml"
    file.write_text('[http]\ntoken = "open sesame"\n')
    file.chmod(0o644)
    assert onboard(["run", "--config", str(file), "--check"]) == 2
    assert "everybody may read the [http] token" in capsys.readouterr().err
    file.chmod(0o600)
    assert onboard(["run", "--config", str(file), "--check"]) == 0


@pytest.mark.parametrize("content", [b"", b"\n", b"\xff\xfe", b"\x00" * 9])
def test_a_secret_that_is_none_is_told(tmp_path, content):
    secret = tmp_path / "token"
    secret.write_bytes(content)
    secret.chmod(0o600)
    with pytest.raises(ConfigurationError, match="token_file"):
        read_secret(str(secret), key="[http] token_file")


def test_an_endless_secret_is_not_read_to_its_end():
    endless = Path("/dev/zero")
    if not endless.exists():
        pytest.skip("no /dev/zero")
    with pytest.raises(ConfigurationError, match="token_file"):
        read_secret(str(endless), key="[http] token_file")
    with pytest.raises(ConfigurationError, match="/dev/zero"):
        read_toml(endless)


names = st.sampled_from(
    ["link", "push", "http", "mqtt", "state", "endpoints", "policy", "imus", "token", "rates"]
)
values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(names | st.text(), inner),
    max_leaves=8,
)


@given(st.dictionaries(names | st.text(), values | st.dictionaries(names | st.text(), values)))
def test_any_document_is_settings_or_an_error(document):
    with contextlib.suppress(OnboardError):
        settings.endpoints(configuration.from_mapping(document, source="x").link)
