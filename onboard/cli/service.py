"""``onboard service``: the systemd unit and the sample configuration that come with the program."""

from __future__ import annotations

import json
import secrets
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

import click

from onboard.daemon.setup.configuration import from_mapping
from onboard.errors import UsageError
from onboard.mavlink.endpoint import Endpoint

UNIT, SAMPLE = "onboard.service", "onboard.toml"
PROGRAM = "/opt/onboard/bin/onboard"
"""As the unit has it; another place is written into the unit when it is installed."""
UNIT_PLACE = Path("etc/systemd/system") / UNIT
SAMPLE_PLACE = Path("etc/onboard") / SAMPLE
TOKEN_PLACE = Path("etc/onboard/token")
HIDDEN = tuple(map(Path, ("/home", "/root", "/run/user", "/tmp", "/var/tmp")))  # noqa: S108 - not written
"""Folders that the unit does not let the service look into (ProtectHome, PrivateTmp)."""
FOR_ALL = (
    "Install it for the whole machine: sudo PIPX_HOME=/opt/pipx PIPX_BIN_DIR=/usr/local/bin "
    "pipx install, and what you gave it before"
)
SYSTEM_PYTHON = "Install onboard with the system's: sudo /usr/bin/python3 -m venv /opt/onboard"
DEFAULT_ENDPOINTS = 'endpoints = ["udpin:127.0.0.1:14550"]'
"""The line of the sample that ``--endpoint`` replaces."""

EXAMPLES = """\
\b
onboard service show
onboard service show configuration
sudo onboard service install --endpoint serial:/dev/ttyAMA0:921600 --start
sudo onboard service install --token
"""


@click.group(epilog=EXAMPLES)
def service() -> None:
    """Run onboard at boot, by systemd."""


@service.command(short_help="Print the unit, or the sample configuration.")
@click.argument("what", type=click.Choice(["unit", "configuration"]), default="unit")
def show(what: str) -> None:
    """Print the unit, or the sample configuration with every setting in it."""
    click.echo(_text(UNIT if what == "unit" else SAMPLE), nl=False)


@service.command(short_help="Write the unit and the configuration, and start it if asked to.")
@click.option(
    "--endpoint",
    "endpoints",
    multiple=True,
    metavar="E",
    help="Where the autopilot is, for a new configuration: serial:DEVICE:BAUD, udpin:HOST:PORT, "
    "udpout:HOST:PORT or tcp:HOST:PORT; may be repeated.",
)
@click.option("--start", is_flag=True, help="Start the service, now and at every boot.")
@click.option("--root", default="/", metavar="DIR", help="Write below this folder, for an image.")
@click.option(
    "--token", is_flag=True, help="Make a secret for the status page, /etc/onboard/token."
)
@click.option("--force", is_flag=True, help="Replace a unit that was changed.")
def install(endpoints: Sequence[str], root: str, *, start: bool, token: bool, force: bool) -> None:
    """Write the unit and, if there is none, the configuration, and say what to do next.

    Nothing is started without --start.  An existing configuration or secret stays as it is.
    """
    here = Path(root) == Path("/")
    if here:
        _reachable()
    elif start:
        raise UsageError("--start is for this machine, and --root for another one's files")
    configuration = _configuration(endpoints)
    if endpoints and (Path(root) / SAMPLE_PLACE).exists():
        raise UsageError(f"{Path(root) / SAMPLE_PLACE} exists: change [link] endpoints in it")
    try:
        written = _install(Path(root), configuration, token=token, force=force)
    except OSError as error:
        raise UsageError(f"{error.filename or root}: {error.strerror} (sudo?)") from None
    for path in written:
        click.echo(f"wrote {path}")
    if start:
        _start()
        click.echo("the service is running; see: onboard status")
    else:
        edit = "now" if endpoints else "now set [link] endpoints in /etc/onboard/onboard.toml, and"
        click.echo(
            f"{edit} check it and start it:\n"
            f"  {_program()} run --config /etc/onboard/onboard.toml --check\n"
            "  sudo systemctl daemon-reload && sudo systemctl enable --now onboard"
        )
    if token:
        click.echo(
            'for the page: token_file = "/run/credentials/onboard.service/token" in [http], and\n'
            "LoadCredential=token:/etc/onboard/token in [Service] of `systemctl edit onboard`"
        )


def _reachable() -> None:
    """Refuse a program in a place that the unit hides from the service."""
    for what, place, cure in (
        ("onboard", Path(_program()), FOR_ALL),
        ("the Python of onboard", Path(sys.base_prefix), SYSTEM_PYTHON),
    ):
        hidden = next((h for h in HIDDEN if place.resolve().is_relative_to(h)), None)
        if hidden is not None:
            raise UsageError(
                f"{what} is in {place}, and the service may not look into {hidden}. {cure}"
            )


def _configuration(endpoints: Sequence[str]) -> str:
    """The sample, with these endpoints if there are any."""
    text = _text(SAMPLE)
    if endpoints:
        for endpoint in endpoints:
            Endpoint.parse(endpoint)
        text = text.replace(DEFAULT_ENDPOINTS, f"endpoints = {json.dumps(list(endpoints))}")
    from_mapping(tomllib.loads(text), source="--endpoint")
    return text


def _start() -> None:
    systemctl = shutil.which("systemctl")
    if systemctl is None:
        raise UsageError("--start: there is no systemctl here")
    for words in (["daemon-reload"], ["enable", "--now", UNIT]):
        done = subprocess.run([systemctl, *words], capture_output=True, text=True, check=False)  # noqa: S603
        if done.returncode:
            why = " ".join(done.stderr.split()) or f"exit status {done.returncode}"
            raise UsageError(f"systemctl {' '.join(words)}: {why}")


def _install(root: Path, configuration: str, *, token: bool, force: bool) -> list[Path]:
    """Write what is not there yet; which files that were."""
    unit = _text(UNIT).replace(PROGRAM, _program())
    place = root / UNIT_PLACE
    if place.exists() and place.read_text(encoding="utf-8") != unit and not force:
        raise UsageError(f"{place} exists and differs; --force replaces it")
    written = [_write(place, unit, 0o644)]
    if not (root / SAMPLE_PLACE).exists():
        written.append(_write(root / SAMPLE_PLACE, configuration, 0o644))
    if token and not (root / TOKEN_PLACE).exists():
        secret = secrets.token_urlsafe(24)
        written.append(_write(root / TOKEN_PLACE, f"{secret}\n", 0o600))
    return written


def _write(path: Path, text: str, mode: int) -> Path:
    """Write a file that has its mode before it has its text."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch(mode=mode)
    path.chmod(mode)
    path.write_text(text, encoding="utf-8")
    return path


def _text(name: str) -> str:
    return (files("onboard") / "systemd" / name).read_text(encoding="utf-8")


def _program() -> str:
    """The program that the unit is to start: the one that was called."""
    beside = Path(sys.executable).with_name("onboard")
    found = str(beside) if beside.exists() else shutil.which("onboard")
    return found or PROGRAM
