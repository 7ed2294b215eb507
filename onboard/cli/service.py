"""``onboard service``: the systemd unit and the sample configuration that come with the program."""

from __future__ import annotations

import secrets
import shutil
import sys
from importlib.resources import files
from pathlib import Path

import click

from onboard.errors import UsageError

UNIT, SAMPLE = "onboard.service", "onboard.toml"
PROGRAM = "/opt/onboard/bin/onboard"
"""As the unit has it; another place is written into the unit when it is installed."""
UNIT_PLACE = Path("etc/systemd/system") / UNIT
SAMPLE_PLACE = Path("etc/onboard") / SAMPLE
TOKEN_PLACE = Path("etc/onboard/token")

EXAMPLES = """\
\b
onboard service show
onboard service show configuration
sudo /opt/onboard/bin/onboard service install
sudo /opt/onboard/bin/onboard service install --token
"""


@click.group(epilog=EXAMPLES)
def service() -> None:
    """Run onboard at boot, by systemd."""


@service.command()
@click.argument("what", type=click.Choice(["unit", "configuration"]), default="unit")
def show(what: str) -> None:
    """Print the unit, or the sample configuration with every setting in it."""
    click.echo(_text(UNIT if what == "unit" else SAMPLE), nl=False)


@service.command()
@click.option("--root", default="/", metavar="DIR", help="Write below this folder, for an image.")
@click.option(
    "--token", is_flag=True, help="Make a secret for the status page, /etc/onboard/token."
)
@click.option("--force", is_flag=True, help="Replace a unit that was changed.")
def install(root: str, *, token: bool, force: bool) -> None:
    """Write the unit and, if there is none, the configuration, and say what to do next.

    Nothing is started.  An existing configuration or secret stays as it is.
    """
    try:
        written = _install(Path(root), token=token, force=force)
    except OSError as error:
        raise UsageError(f"{error.filename or root}: {error.strerror} (sudo?)") from None
    for path in written:
        click.echo(f"wrote {path}")
    click.echo(
        "now edit /etc/onboard/onboard.toml, at least [link] endpoints, and then\n"
        f"  {_program()} run --config /etc/onboard/onboard.toml --check\n"
        "  systemctl daemon-reload && systemctl enable --now onboard"
    )
    if token:
        click.echo(
            'for the page: token_file = "/run/credentials/onboard.service/token" in [http], and\n'
            "LoadCredential=token:/etc/onboard/token in [Service] of `systemctl edit onboard`"
        )


def _install(root: Path, *, token: bool, force: bool) -> list[Path]:
    """Write what is not there yet; which files that were."""
    unit = _text(UNIT).replace(PROGRAM, _program())
    place = root / UNIT_PLACE
    if place.exists() and place.read_text(encoding="utf-8") != unit and not force:
        raise UsageError(f"{place} exists and differs; --force replaces it")
    written = [_write(place, unit, 0o644)]
    if not (root / SAMPLE_PLACE).exists():
        written.append(_write(root / SAMPLE_PLACE, _text(SAMPLE), 0o644))
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
