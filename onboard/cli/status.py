"""``onboard status``, ``approve``, ``reject``, ``rollback``, ``reset``: talk to the daemon."""

from __future__ import annotations

import http.client
import os
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import click

from onboard.errors import LinkError, RefusedError, UsageError
from onboard.printable import printable

if TYPE_CHECKING:
    from rich.console import RenderableType

    from onboard.daemon.view.snapshot import Snapshot

TIMEOUT_S = 10.0
WATCH_INTERVAL_S = 1.0
LONGEST = 16_000_000
"""bytes of an answer; a snapshot has some hundred thousand, and more is not kept [cost]."""


class Client:
    """The daemon's control API, one short connection per request."""

    def __init__(self, url: str, token: str | None) -> None:
        try:
            parts = urlsplit(url)
            host, port = parts.hostname, parts.port or 80
        except ValueError:  # brackets that do not close, a port that is none
            host, port = None, 0
        # Spaces and control characters would be sent as they are.
        if host is None or parts.scheme != "http" or not re.fullmatch(r"[\w.:%-]+", host):
            raise UsageError(f"{url}: expected http://HOST:PORT")
        self._url = url
        self._host = host
        self._port = port
        self._token = token

    def snapshot(self) -> Snapshot:
        """What the daemon shows now.

        Raises:
            LinkError: nobody answers there, or it is not the daemon.
        """
        import msgspec

        from onboard.daemon.view.snapshot import Snapshot

        answer = self._request("GET", "/api/snapshot", b"")
        try:
            return Snapshot.from_json(answer)
        except (msgspec.DecodeError, ValueError, RecursionError) as error:
            raise LinkError(
                f"{self._url}: not the onboard service of this version: {error}"
            ) from None

    def act(self, action: str, imus: tuple[int, ...], **more: bool) -> str:
        """Ask for a change; the daemon's sentence about what it did.

        Raises:
            RefusedError: the daemon will not, and says why.
            LinkError: nobody answers there, or it is not the daemon.
        """
        import msgspec

        answer = self._request(
            "POST", f"/api/{action}", msgspec.json.encode({"imus": imus, **more})
        )
        try:
            done = msgspec.json.decode(answer, type=dict[str, Any]).get("done")
            if not isinstance(done, str):
                raise ValueError("its answer does not say what was done")  # noqa: TRY004, TRY301
        except (msgspec.DecodeError, ValueError, RecursionError) as error:
            raise LinkError(
                f"{self._url}: not the onboard service of this version: {error}"
            ) from None
        return printable(done)

    def _request(self, method: str, path: str, body: bytes) -> bytes:
        headers = {"Content-Type": "application/json"}
        if self._token is not None:
            headers["Authorization"] = f"Bearer {self._token}"
        connection = http.client.HTTPConnection(self._host, self._port, timeout=TIMEOUT_S)
        try:
            connection.request(method, path, body, headers)
            response = connection.getresponse()
            answer = response.read(LONGEST)
        except (OSError, http.client.HTTPException) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise LinkError(f"{self._url}: no onboard service answers: {reason}") from None
        finally:
            connection.close()
        if response.status != 200:
            raise RefusedError(_reason(response.status, answer))
        return answer


def _reason(status: int, answer: bytes) -> str:
    import msgspec

    try:
        return str(msgspec.json.decode(answer)["error"]["message"])
    except (msgspec.DecodeError, KeyError, TypeError, ValueError, RecursionError):
        return f"the service answered with status {status}"


def _client(url: str | None, config: str | None, token_file: str | None) -> Client:
    """Where the daemon listens: --url, else what its configuration says."""
    from onboard.daemon.setup import configuration, secret_files

    settings = configuration.Configuration()
    if config is not None:
        settings = configuration.load(Path(config))
    token = os.environ.get("ONBOARD_TOKEN") or settings.http.token
    if token_file is not None:
        token = secret_files.read_secret(token_file, key="--token-file")
    elif token is None and settings.http.token_file is not None:
        token = secret_files.read_secret(settings.http.token_file, key="[http] token_file")
    host = settings.http.address
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)  # noqa: S104 - replaced, not bound
    bracketed = f"[{host}]" if ":" in host else host
    return Client(url or f"http://{bracketed}:{settings.http.port}", token)


def _where(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options that say which daemon is meant."""
    command = click.option(
        "--token-file", metavar="FILE", help="File with the token (or ONBOARD_TOKEN)."
    )(command)
    command = click.option(
        "--config", metavar="F.toml", help="The daemon's configuration, for its address and token."
    )(command)
    return click.option(
        "--url", metavar="URL", envvar="ONBOARD_URL", help="Default: http://127.0.0.1:8191."
    )(command)


EXAMPLES = """\
\b
onboard status
onboard status --watch          # as it changes; --full for more than 24 lines
onboard status --json | jq '.push.proposals[].held_back'
onboard status --url http://kite.local:8191 --token-file token
"""
ACTION_EXAMPLES = """\
\b
onboard {name}
onboard {name} 2             # accelerometer 2 only
onboard {name} --url http://kite.local:8191 --token-file token
"""


@click.command(epilog=EXAMPLES)
@_where
@click.option("--watch", is_flag=True, help="Go on showing it until Ctrl-C; fits 80x24.")
@click.option("--full", is_flag=True, help="With --watch: everything, for a tall terminal.")
@click.option("--json", "as_json", is_flag=True, help="The snapshot as JSON.")
def status(
    url: str | None,
    config: str | None,
    token_file: str | None,
    *,
    watch: bool,
    full: bool,
    as_json: bool,
) -> None:
    """Show what the running daemon sees, has learned, and would write."""
    client = _client(url, config, token_file)
    if as_json:
        click.echo(client.snapshot().to_json())
        return
    from onboard.cli.compact import compact
    from onboard.cli.panel import panel
    from onboard.cli.terminal import Terminal

    console = Terminal(highlight=False)
    if not watch:
        console.print(panel(client.snapshot()))
        return
    from rich.live import Live

    def shown() -> RenderableType:
        snapshot = client.snapshot()
        return panel(snapshot) if full else compact(snapshot, console.size.height)

    with Live(shown(), console=console, auto_refresh=False) as live:
        while True:
            time.sleep(WATCH_INTERVAL_S)
            try:
                live.update(shown(), refresh=True)
            except LinkError as error:  # the daemon restarts: go on watching
                live.update(str(error), refresh=True)


def _action(name: str, text: str) -> click.Command:
    @click.command(name, help=text, epilog=ACTION_EXAMPLES.format(name=name))
    @_where
    @click.argument("imus", nargs=-1, type=click.IntRange(1, 5), metavar="[IMU]...")
    def command(
        url: str | None, config: str | None, token_file: str | None, imus: tuple[int, ...]
    ) -> None:
        click.echo(_client(url, config, token_file).act(name, imus))

    return command


APPROVE_EXAMPLES = (
    ACTION_EXAMPLES.format(name="approve") + "onboard approve 1 --despite-diagnosis\n"
)


@click.command(epilog=APPROVE_EXAMPLES)
@_where
@click.option(
    "--despite-diagnosis",
    is_flag=True,
    help="Write them although the diagnosis holds them back; IMUs must be named.",
)
@click.argument("imus", nargs=-1, type=click.IntRange(1, 5), metavar="[IMU]...")
def approve(
    url: str | None,
    config: str | None,
    token_file: str | None,
    imus: tuple[int, ...],
    *,
    despite_diagnosis: bool,
) -> None:
    """Allow the proposed parameters to be written (default: of every IMU that waits)."""
    more = {"despite_diagnosis": True} if despite_diagnosis else {}
    click.echo(_client(url, config, token_file).act("approve", imus, **more))


reject = _action("reject", "Refuse the proposed parameters.")


@click.command(epilog=ACTION_EXAMPLES.format(name="rollback"))
@_where
@click.option("--yes", is_flag=True, help="Do not ask (nobody is asked without a terminal).")
@click.argument("imus", nargs=-1, type=click.IntRange(1, 5), metavar="[IMU]...")
def rollback(
    url: str | None, config: str | None, token_file: str | None, imus: tuple[int, ...], *, yes: bool
) -> None:
    """Write back the values that were in force before the last push.

    Shows both first, and on a terminal asks.
    """
    from onboard.cli.panel import changes
    from onboard.cli.terminal import Terminal

    client = _client(url, config, token_file)
    console = Terminal(highlight=False)
    snapshot = client.snapshot()
    in_force = [w for w in snapshot.push.written if w.in_force]
    chosen = [w for w in in_force if not imus or w.imu in imus]
    for written in chosen:
        console.print(f"IMU {written.imu}: what would be written")
        console.print(changes(written, snapshot.parameters))
    # With several, or none, the daemon refuses in any case.
    ask = len(chosen) == 1 and sys.stdin.isatty() and not yes
    if ask and not click.confirm("Write these values?"):
        click.echo("nothing was written")
        return
    click.echo(client.act("rollback", imus))


reset = _action("reset", "Forget what was learned; the autopilot is left as it is.")
