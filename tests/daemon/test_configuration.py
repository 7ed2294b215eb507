"""A configuration mistake is one line that names file, section and key."""

import re
from pathlib import Path

import msgspec
import pytest

from onboard.daemon.setup import configuration, secret_files
from onboard.daemon.setup.configuration import Configuration, HttpSettings
from onboard.errors import ConfigurationError

TABLE = r"^\[([\w.]+)\]\n((?:(?!\[\w).*\n?)*)"
EXAMPLE = Path(__file__).parents[2] / "systemd" / "onboard.toml"


def write(directory: Path, text: str) -> Path:
    file = directory / "vehicle.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_an_empty_file_is_the_defaults(tmp_path):
    assert configuration.load(write(tmp_path, "")) == Configuration()


def test_the_defaults_only_listen_on_this_machine_and_only_write_when_landed():
    settings = Configuration()
    assert settings.http.loopback
    assert settings.push.policy == "landed"
    assert settings.push.disarmed_s == 5.0
    assert not settings.mqtt.enabled


@pytest.mark.parametrize(
    ("text", "place", "hint"),
    [
        ("[lnk]\n", "[lnk]", "did you mean link?"),
        ("[link]\nendpoint = 'x'\n", "[link] endpoint", "did you mean endpoints?"),
        ("[link]\nendpoints = []\n", "[link] endpoints", "length >= 1"),
        ("[link]\nendpoints = ['udpin:127.0.0.1:1', 5]\n", "[link] endpoints[1]", "`str`"),
        ("[link.rates]\nimu = -1\n", "[link.rates] imu", ">= 0"),
        ("[link.rates]\natitude = 1\n", "[link.rates] atitude", "did you mean attitude?"),
        ("[push]\npolicy = 'always'\n", "[push] policy", "never, landed, in_flight"),
        ("[push]\nimus = [1, 6]\n", "[push] imus[1]", "<= 5"),
        ("[push]\nscale_max = 1.5\n", "[push] scale_max", "<= 1.2"),
        ("[push]\noffset_max = 9.0\n", "[push] offset_max", "<= 3.5"),
        ("[http]\nport = 70000\n", "[http] port", "65535"),
        ("[http]\naddress = '0.0.0.0'\n", "[http]", "token"),
        ("[http]\ntoken = 'a'\ntoken_file = 'b'\n", "[http]", "exclude each other"),
        ("[mqtt]\nca_file = 'x'\n", "[mqtt]", "tls"),
        ("[mqtt]\ntls = true\ncertificate_file = 'x'\n", "[mqtt]", "belong together"),
        ("[mqtt]\npassword_file = 'x'\n", "[mqtt]", "needs a username"),
        ("[mqtt]\nprefix = 'a/+'\n", "[mqtt]", "must not contain"),
        ("[mqtt]\ndiscovery = 'a/#'\n", "[mqtt]", "must not contain"),
        ("link = 3\n", "[link]", "a table"),
    ],
)
def test_a_mistake_is_named_by_file_and_key(tmp_path, text, place, hint):
    file = write(tmp_path, text)
    with pytest.raises(ConfigurationError) as caught:
        configuration.load(file)
    message = str(caught.value)
    assert message.startswith(f"{file}: {place}: ")
    assert hint in message
    assert "\n" not in message
    assert caught.value.exit_status == 2


def test_text_that_is_not_toml_is_told_with_its_line(tmp_path):
    with pytest.raises(ConfigurationError, match="line 2"):
        configuration.load(write(tmp_path, "[link]\nendpoints = \n"))


def test_a_file_that_is_not_there_or_not_text(tmp_path):
    with pytest.raises(ConfigurationError, match=re.escape(str(tmp_path / "no.toml"))):
        configuration.load(tmp_path / "no.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigurationError, match="not UTF-8"):
        configuration.load(binary)


@pytest.mark.parametrize(
    ("address", "loopback"),
    [
        ("127.0.0.1", True),
        ("::1", True),
        ("localhost", True),
        ("127.8.0.1", True),
        ("192.168.1.2", False),
        ("::", False),
        ("companion.local", False),
    ],
)
def test_which_addresses_are_this_machine_only(address, loopback):
    assert HttpSettings(address=address, token_file="t").loopback is loopback


def test_the_example_is_valid_and_shows_every_key_with_its_default():
    """Commented keys count as shown: an example that forgets a key is out of date."""
    text = EXAMPLE.read_text(encoding="utf-8")
    configuration.load(EXAMPLE)
    uncommented = "\n".join(re.sub(r"^# ?(?=\[|\w+ = )", "", line) for line in text.splitlines())
    shown = {
        (section, key)
        for section, body in re.findall(
            r"^\[([\w.]+)\]\n((?:(?!\[\w).*\n?)*)", uncommented, re.MULTILINE
        )
        for key in re.findall(r"^(\w+) = ", body, re.MULTILINE)
    }
    wanted = set()
    for section in msgspec.structs.fields(Configuration):
        for field in msgspec.structs.fields(section.type):
            if isinstance(field.type, type) and issubclass(field.type, msgspec.Struct):
                wanted |= {
                    (f"{section.name}.{field.name}", inner.name)
                    for inner in msgspec.structs.fields(field.type)
                }
            else:
                wanted.add((section.name, field.name))
    assert shown == wanted


def test_state_directory_follows_systemd_then_the_user(monkeypatch, tmp_path):
    monkeypatch.setenv("STATE_DIRECTORY", str(tmp_path / "a"))
    assert Configuration().state.path() == tmp_path / "a"
    monkeypatch.delenv("STATE_DIRECTORY")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert Configuration().state.path() == tmp_path / "onboard"
    named = configuration.StateSettings(directory=str(tmp_path / "b"))
    assert named.path() == tmp_path / "b"


def test_a_secret_is_the_first_line_of_its_file(tmp_path):
    secret = tmp_path / "token"
    secret.write_text("  open sesame \nrest\n")
    secret.chmod(0o600)
    assert secret_files.read_secret(str(secret), key="[http] token_file") == "open sesame"
    secret.write_text("\n")
    with pytest.raises(ConfigurationError, match=r"\[http\] token_file"):
        secret_files.read_secret(str(secret), key="[http] token_file")
