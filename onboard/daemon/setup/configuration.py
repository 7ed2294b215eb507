"""Configuration: one TOML file, one frozen record per section, defaults that work.

Every value is checked when it is read, so that a mistake is one line that names file, section
and key, and never a surprise in flight.  Unknown keys are mistakes too.
"""

from __future__ import annotations

import difflib
import ipaddress
import os
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_type_hints

import msgspec
from msgspec import Meta

from onboard.errors import ConfigurationError
from onboard.push.limits import LEAST_DISARMED_S
from onboard.toml_file import read_toml

LARGEST = 1e9
"""No setting is larger (30 years in seconds); infinity is none [bound]."""
Positive = Annotated[float, Meta(gt=0.0, le=LARGEST)]
NotNegative = Annotated[float, Meta(ge=0.0, le=LARGEST)]
Rate = Annotated[float, Meta(ge=0.0, le=1000.0)]
Port = Annotated[int, Meta(ge=0, le=65535)]
SystemId = Annotated[int, Meta(ge=1, le=255)]
ImuNumber = Annotated[int, Meta(ge=1, le=5)]
Text = Annotated[str, Meta(min_length=1)]


class Section(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of all sections."""


def is_host(text: str) -> bool:
    """Whether the system can be asked for a host of this name (an empty one is for all)."""
    try:
        text.encode("idna")
    except UnicodeError:
        return False
    return True


class RatesSettings(Section, frozen=True, kw_only=True):
    """Message rates to ask for (Hz); 0 leaves a stream as it is."""

    imu: Rate = 50.0
    attitude: Rate = 50.0
    gps: Rate = 10.0
    status: Rate = 2.0
    regime: Rate = 4.0


class LinkSettings(Section, frozen=True, kw_only=True):
    """Where the autopilot is and how to speak to it.

    ``endpoints`` are used side by side; a message is taken from whichever brings it first.
    ``system_id`` 0 takes the first that proves to be an autopilot, ``component_id`` 0 any
    component of it.
    """

    endpoints: Annotated[tuple[Text, ...], Meta(min_length=1)] = ("udpin:127.0.0.1:14550",)
    system_id: Annotated[int, Meta(ge=0, le=255)] = 0
    component_id: Annotated[int, Meta(ge=0, le=255)] = 0
    signing_key_file: Text | None = None
    heartbeat_limit_s: Positive = 30.0
    rates: RatesSettings = RatesSettings()


class PushSettings(Section, frozen=True, kw_only=True):
    """When the estimates may be written into the autopilot, and how far they may go.

    The bounds only ever narrow what the autopilot documents (scale 0.8 ... 1.2, offset
    3.5 m/s^2); ``sure`` is the probability of an improvement that a push needs, ``least_change``
    by how much the force has to change, m/s^2.  ``disarmed_s`` covers two HEARTBEATs, which come
    once a second: one alone says nothing of the second after it.  ``allow_loosening``: a ground
    station may set a policy that writes more than the one in force.
    """

    policy: Literal["never", "landed", "in_flight"] = "landed"
    approval: bool = False
    imus: tuple[ImuNumber, ...] = ()
    disarmed_s: Annotated[float, Meta(ge=LEAST_DISARMED_S, le=LARGEST)] = 5.0
    allow_loosening: bool = False
    scale_min: Annotated[float, Meta(ge=0.8, lt=1.0)] = 0.8
    scale_max: Annotated[float, Meta(gt=1.0, le=1.2)] = 1.2
    offset_max: Annotated[float, Meta(gt=0.0, le=3.5)] = 3.5
    sure: Annotated[float, Meta(ge=0.5, lt=1.0)] = 0.99
    least_change: Positive = 0.01
    in_flight_scale_step: Annotated[float, Meta(gt=0.0, le=0.05)] = 0.005
    in_flight_offset_step: Annotated[float, Meta(gt=0.0, le=0.5)] = 0.05


class EstimatorSettings(Section, frozen=True, kw_only=True):
    """What the estimator is told beforehand; the rest it finds in the data.

    ``window_s`` ends the trust window so long after its first opening (0: never);
    ``satellites_min``, ``hdop_max`` and ``speed_accuracy_max`` (m/s) are what a fix must have.
    ``buffer_s`` of flight are kept for second passes, older flight is forgotten with the time
    constant ``memory_s``.
    """

    minimum_trusted_s: NotNegative = 30.0
    window_s: NotNegative = 0.0
    satellites_min: Annotated[int, Meta(ge=0, le=50)] = 6
    hdop_max: Positive = 2.5
    speed_accuracy_max: Positive = 5.0
    buffer_s: Annotated[float, Meta(ge=60.0, le=3600.0)] = 300.0
    memory_s: Annotated[float, Meta(ge=60.0, le=LARGEST)] = 1800.0
    save_every_s: Positive = 60.0


class StateSettings(Section, frozen=True, kw_only=True):
    """Where sums and journal live.

    Without ``directory``: ``$STATE_DIRECTORY`` (set by systemd), else the user's state directory.
    """

    directory: Text | None = None

    def path(self) -> Path:
        """The directory in force."""
        given = self.directory or os.environ.get("STATE_DIRECTORY", "").split(":")[0]
        if given:
            return Path(given).expanduser()
        base = os.environ.get("XDG_STATE_HOME") or "~/.local/state"
        return Path(base).expanduser() / "onboard"


class RecordingSettings(Section, frozen=True, kw_only=True):
    """Whether to keep what the link brought, as .tlog files that ``onboard replay`` reads."""

    enabled: bool = False
    directory: Text | None = None
    keep_files: Annotated[int, Meta(ge=1, le=1_000_000)] = 20
    file_size_mb: Positive = 100.0


class HttpSettings(Section, frozen=True, kw_only=True):
    """Status page and local control API; port 0 takes a free one."""

    enabled: bool = True
    address: Text = "127.0.0.1"
    port: Port = 8191
    token: Text | None = None
    token_file: Text | None = None

    def __post_init__(self) -> None:
        """Refuse what would leave the autopilot's parameters open to a network."""
        if self.token is not None and self.token_file is not None:
            raise ValueError("token and token_file exclude each other")
        if not is_host(self.address):
            raise ValueError(f"address {self.address} is no address or name of this machine")
        if self.token is not None and not self.token.strip():
            raise ValueError("token is blank")
        if self.enabled and not self.loopback and self.token is None and self.token_file is None:
            raise ValueError(
                f"address {self.address} is not loopback: give a token or a token_file, "
                "it is asked for whatever changes state"
            )

    @property
    def loopback(self) -> bool:
        """Whether only programs of this machine can connect."""
        if self.address == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.address).is_loopback
        except ValueError:
            return False


class ParametersSettings(Section, frozen=True, kw_only=True):
    """The ``OBC_*`` parameters and messages that a ground station sees of this component.

    ``writable``: a ground station may set the push policy and approve.  ``imus`` accelerometers
    get parameters.  ``messages``: events as STATUSTEXT.
    """

    enabled: bool = True
    writable: bool = True
    imus: Annotated[int, Meta(ge=1, le=5)] = 3
    messages: bool = True


class MqttSettings(Section, frozen=True, kw_only=True):
    """Broker to publish to; off by default.

    ``prefix`` is ``onboard/<system id>`` where none is given; ``state_interval_s`` is the time
    between two publications of the whole state.  ``discovery`` is the prefix of Home Assistant's
    discovery (``homeassistant``); without it nothing is published there.
    """

    enabled: bool = False
    host: Text = "127.0.0.1"
    port: Port = 1883
    prefix: Text | None = None
    commands: bool = False
    discovery: Text | None = None
    state_interval_s: Annotated[float, Meta(ge=0.1, le=LARGEST)] = 2.0
    client_id: Text | None = None
    username: Text | None = None
    password_file: Text | None = None
    tls: bool = False
    ca_file: Text | None = None
    certificate_file: Text | None = None
    key_file: Text | None = None

    def __post_init__(self) -> None:
        """Refuse contradictions."""
        if (self.certificate_file is None) != (self.key_file is None):
            raise ValueError("certificate_file and key_file belong together")
        if not self.tls and (self.ca_file is not None or self.certificate_file is not None):
            raise ValueError("ca_file and certificate_file need tls = true")
        if self.password_file is not None and self.username is None:
            raise ValueError("password_file needs a username")
        if self.prefix is not None and any(c in self.prefix for c in "+#\0"):
            raise ValueError("prefix must not contain + or #")
        if self.discovery is not None and any(c in self.discovery for c in "+#\0"):
            raise ValueError("discovery must not contain + or #")


class Configuration(Section, frozen=True, kw_only=True):
    """The whole file; every section may be left out."""

    link: LinkSettings = LinkSettings()
    push: PushSettings = PushSettings()
    estimator: EstimatorSettings = EstimatorSettings()
    state: StateSettings = StateSettings()
    recording: RecordingSettings = RecordingSettings()
    http: HttpSettings = HttpSettings()
    parameters: ParametersSettings = ParametersSettings()
    mqtt: MqttSettings = MqttSettings()


def load(path: Path) -> Configuration:
    """Read and check a configuration file.

    Raises:
        ConfigurationError: it cannot be read, is not TOML, or has a wrong key or value.
    """
    return from_mapping(read_toml(path), source=str(path))


def from_mapping(document: dict[str, Any], *, source: str) -> Configuration:
    """Check an already parsed document; ``source`` names it in errors.

    Raises:
        ConfigurationError: a wrong key or value, named by its path.
    """
    try:
        chosen = msgspec.convert(document, Configuration)
    except msgspec.ValidationError as error:
        raise ConfigurationError(f"{source}: {_explain(str(error))}") from None
    _refuse_control_characters(chosen, source)
    return chosen


def _refuse_control_characters(chosen: Configuration, source: str) -> None:
    """A NUL ends a path for the system, and a line break one in the log."""
    tables: list[tuple[str, msgspec.Struct]] = [("", chosen)]
    while tables:
        place, table = tables.pop()
        for name in table.__struct_fields__:
            value = getattr(table, name)
            if isinstance(value, msgspec.Struct):
                tables.append((f"{place}.{name}".lstrip("."), value))
            for text in value if isinstance(value, tuple) else (value,):
                if isinstance(text, str) and not text.isprintable():
                    raise ConfigurationError(
                        f"{source}: [{place}] {name}: a character that is not printable"
                    )


def _explain(message: str) -> str:
    """Msgspec's message turned into '[section] key: what is wrong'."""
    what, _, where = message.partition(" - at `$")
    names = [name for name in where.rstrip("`").replace("[", ".[").split(".") if name]
    prefix = "Object contains unknown field `"
    if what.startswith(prefix):
        unknown = what[len(prefix) :].rstrip("`")
        kind = "key" if names else "section"
        return f"{_place([*names, unknown])}: unknown {kind}; {_suggestion(names, unknown)}"
    if what.startswith("Invalid enum value"):
        choices = ", ".join(str(value) for value in get_args(_kind(names)))
        return f"{_place(names)}: {what[len('Invalid enum value ') :]} is not one of {choices}"
    what = what.replace("`object`", "a table").replace("`array`", "a list")
    return f"{_place(names)}: {what[:1].lower()}{what[1:]}"


def _place(names: list[str]) -> str:
    """TOML's way of naming a place: [table] key, list items as key[2]."""
    items = "".join(name for name in names if name.startswith("["))
    plain = [name for name in names if not name.startswith("[")]
    if len(plain) == 1:
        return f"[{plain[0]}]"
    return f"[{'.'.join(plain[:-1])}] {plain[-1]}{items}"


def _kind(names: list[str]) -> object:
    """The declared type of the field at a path."""
    kind: Any = Configuration
    for name in names:
        kind = get_type_hints(kind)[name]
    return kind


def _suggestion(names: list[str], unknown: str) -> str:
    """The nearest key that exists there, if one is near, else all of them."""
    table: Any = _kind(names)
    known = [field.name for field in msgspec.structs.fields(table)]
    near = difflib.get_close_matches(unknown, known, n=1)
    return f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
