"""``onboard run``: the daemon, in the foreground."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from onboard.errors import HeldError, OnboardError, UnavailableError

INTERRUPTED = 130

if TYPE_CHECKING:
    from onboard.daemon.process.starts import Starts
    from onboard.daemon.setup.configuration import Configuration


EXAMPLES = """\
\b
onboard run --endpoint serial:/dev/ttyAMA0:921600
onboard run --endpoint udpin:127.0.0.1:14550 --policy never
onboard run --config /etc/onboard/onboard.toml --check
"""


@click.command(epilog=EXAMPLES)
@click.option("--config", metavar="F.toml", help="Configuration file.")
@click.option(
    "--endpoint",
    "endpoints",
    multiple=True,
    metavar="E",
    help="Where the autopilot is: udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or "
    "serial:DEVICE:BAUD; may be repeated.  Takes the place of [link] endpoints.",
)
@click.option("--state", metavar="DIR", help="Takes the place of [state] directory.")
@click.option(
    "--policy",
    type=click.Choice(["never", "landed", "in_flight"]),
    help="Takes the place of [push] policy.",
)
@click.option("--check", is_flag=True, help="Only read the configuration, and say what is wrong.")
@click.option("--verbose", is_flag=True, help="Log every step.")
def run(
    config: str | None,
    endpoints: tuple[str, ...],
    state: str | None,
    policy: str | None,
    *,
    check: bool,
    verbose: bool,
) -> None:
    """Calibrate the autopilot's accelerometers while it flies.

    Serves until SIGTERM or Ctrl-C.  Without --config the defaults listen on UDP port 14550 of
    this machine and write only when the vehicle is disarmed.
    """
    from onboard.daemon.setup import configuration, secret_files, settings
    from onboard.toml_file import read_toml

    document = {} if config is None else read_toml(Path(config))
    for section, key, value in (
        ("link", "endpoints", list(endpoints)),
        ("state", "directory", state),
        ("push", "policy", policy),
    ):
        if value:
            document[section] = {**document.get(section, {}), key: value}
    chosen = configuration.from_mapping(document, source=config or "command line")
    if config is not None:
        secret_files.refuse_open_token(Path(config), chosen)
    settings.endpoints(chosen.link)
    if check:
        from onboard.daemon.process import checking

        checking.check(chosen)
        click.echo("configuration is valid")
        return
    _log(verbose=verbose)
    from onboard.daemon.process.starts import Starts
    from onboard.daemon.process.turns import MeteredLoop

    starts = Starts.from_environment()
    _wait(starts)
    try:
        with asyncio.Runner(loop_factory=MeteredLoop) as runner:
            stopped_by = runner.run(_serve(chosen, starts))
    except (UnavailableError, HeldError):
        raise  # at once: the next start may be too early as well
    except (OnboardError, KeyboardInterrupt):
        starts.over()  # it has said why
        raise
    starts.over()
    if stopped_by is signal.SIGINT:
        click.get_current_context().exit(INTERRUPTED)


def _wait(starts: Starts) -> None:
    """After starts in a row that came to nothing, leave vehicle, disk and journal alone a while."""
    from onboard.daemon.process.notify import Notifier

    seconds = starts.begin()
    if seconds <= 0.0:
        return
    said = f"the last {starts.failed} starts came to nothing: waiting {seconds:.0f} s"
    logging.getLogger(__name__).warning(said)
    Notifier.from_environment().send(STATUS=said)
    time.sleep(seconds)


async def _serve(configuration: Configuration, starts: Starts) -> signal.Signals | None:
    from onboard.daemon.process.limits import SETTLED_S
    from onboard.daemon.process.service import Service

    service = Service(configuration)
    asyncio.get_running_loop().call_later(SETTLED_S, starts.over)
    try:
        await service.run(handle_signals=True)
    except asyncio.CancelledError:
        if service.stopped_by is None:
            raise
        # A second signal: what was under way is left as it is, for the next start.
        logging.getLogger(__name__).warning("stopped at once, as was asked twice")
    return service.stopped_by


def _log(*, verbose: bool) -> None:
    """To stderr; under systemd without time stamps, which the journal has itself."""
    from onboard.daemon.setup.logs import Restrained

    stamp = "" if "JOURNAL_STREAM" in os.environ else "%(asctime)s "
    ours = logging.StreamHandler(sys.stderr)
    ours.addFilter(Restrained())  # what somebody else has set up to listen hears everything
    logging.basicConfig(
        level=logging.DEBUG if verbose else logging.INFO,
        format=f"{stamp}%(levelname)s %(name)s: %(message)s",
        handlers=[ours],
    )
