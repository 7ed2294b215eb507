"""``onboard replay``: calibrate from recordings, as fast as they can be read."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click
from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as ProgressBar

from onboard.cli.table import replay_report
from onboard.core.calibrator import Calibrator
from onboard.errors import UsageError
from onboard.replay import Progress
from onboard.replay import replay as replay_recordings

STANDARD_OUTPUT = "-"


EXAMPLES = """\
\b
onboard replay flight.BIN
onboard replay monday.tlog tuesday.tlog --imu 2
onboard replay flight.BIN --json - | jq '.imus[0].calibration'
"""


@click.command(epilog=EXAMPLES)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...", type=click.Path(path_type=Path))
@click.option(
    "--json",
    "json_file",
    metavar="FILE",
    help="Write the result as JSON, '-' for standard output (then without the table).",
)
@click.option(
    "--imu", type=click.IntRange(1, 5), metavar="N", help="This accelerometer only, 1 to 5."
)
def replay(logs: tuple[Path, ...], json_file: str | None, imu: int | None) -> None:
    """Calibrate from recordings: DataFlash .BIN, MAVLink .tlog, PX4 .ulg.

    Several LOGs of one vehicle are merged: what a single flight does not show, several may.
    Nothing is written to any autopilot; the table says which parameters to set.
    """
    with _progress(logs) as progress:
        result = replay_recordings(logs, Calibrator(), imu=imu, progress=progress)
    if json_file is not None:
        write_json(result.document().to_json(), json_file)
    if json_file != STANDARD_OUTPUT:
        console = Console(highlight=False)
        for part in replay_report(result):
            console.print(part)


def write_json(document: bytes, file: str) -> None:
    """Write a document to a file, or to standard output for ``-``.

    Raises:
        UsageError: the file cannot be written.
    """
    if file == STANDARD_OUTPUT:
        click.echo(document, nl=False)
        return
    try:
        Path(file).write_bytes(document)
    except OSError as error:
        raise UsageError(f"{file}: cannot be written ({error.strerror})") from None


@contextmanager
def _progress(logs: tuple[Path, ...]) -> Iterator[Progress | None]:
    """A bar on standard error while a person watches, else nothing."""
    if not sys.stderr.isatty():
        yield None
        return
    name = logs[0].name if len(logs) == 1 else f"{len(logs)} recordings"
    columns = TextColumn("reading {task.description}"), BarColumn(), TimeRemainingColumn()
    with ProgressBar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=1.0)
        yield lambda done: bar.update(task, completed=done)
