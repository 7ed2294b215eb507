"""``onboard replay``: calibrate from recordings, as fast as they can be read."""

from __future__ import annotations

from pathlib import Path

import click

from onboard.answers.calibrated import calibrated
from onboard.cli.outputs import STANDARD_OUTPUT, refuse_overwriting
from onboard.cli.progress import reading
from onboard.cli.table import replay_report
from onboard.cli.terminal import Terminal
from onboard.report.files import save

EXAMPLES = """\
\b
onboard replay flight.BIN
onboard replay monday.tlog tuesday.tlog --imu 2
onboard replay flight.BIN --report flight.html --param new.param
onboard replay flight.BIN --mcap flight.mcap        # for Foxglove
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
@click.option("--report", "report_file", metavar="FILE", help="Write one self-contained HTML page.")
@click.option(
    "--param",
    "param_file",
    metavar="FILE",
    help="Write parameters for a ground station; QGroundControl's format if FILE ends in .params.",
)
@click.option(
    "--mcap",
    "mcap_file",
    metavar="FILE",
    help="Write what there is over time, for Foxglove and other viewers of logs.",
)
@click.option(
    "--imu", type=click.IntRange(1, 5), metavar="N", help="This accelerometer only, 1 to 5."
)
def replay(
    logs: tuple[Path, ...],
    json_file: str | None,
    report_file: str | None,
    param_file: str | None,
    mcap_file: str | None,
    imu: int | None,
) -> None:
    """Calibrate from recordings: DataFlash .BIN, MAVLink .tlog, PX4 .ulg.

    Several LOGs of one vehicle are merged: what a single flight does not show, several may.  They
    are taken in the order of their dates; those without a date, in the order given.  Each keeps its
    own noise and timing, and flights that contradict each other are named, not averaged.
    Nothing is written to any autopilot; the table says which parameters to set.
    """
    refuse_overwriting(logs, json_file, report_file, param_file, mcap_file)
    with reading(logs, then="comparing models") as progress:
        watched = report_file is not None or mcap_file is not None
        made = calibrated(logs, imu=imu, watched=watched, progress=progress)
    result, drawn = made.replay, made.chronicle
    if report_file is not None and drawn is not None:
        # jinja2 only when it is wanted.
        from onboard.report.replay import replay_html

        write_text(replay_html(result, drawn), report_file)
    if param_file is not None:
        from onboard.report.parameters import replay_text

        write_text(replay_text(result, param_file), param_file)
    if mcap_file is not None and drawn is not None:
        from onboard.report.mcap import mcap
        from onboard.report.tracks import of_replay

        write_bytes(mcap(of_replay(result, drawn)), mcap_file)
    if json_file is not None:
        write_json(result.document().to_json(), json_file)
    if STANDARD_OUTPUT not in (json_file, report_file, param_file, mcap_file):
        console = Terminal(highlight=False)
        for part in replay_report(result):
            console.print(part)


def write_json(document: bytes, file: str) -> None:
    """Write a document to a file, or to standard output for ``-``.

    Raises:
        UsageError: the file cannot be written.
    """
    _write(document, file)


def write_bytes(content: bytes, file: str) -> None:
    """Write what is no text to a file, or to standard output for ``-``.

    Raises:
        UsageError: the file cannot be written.
    """
    _write(content, file)


def write_text(text: str, file: str) -> None:
    """Write a text in UTF-8 to a file, or to standard output for ``-``.

    Raises:
        UsageError: the file cannot be written.
    """
    _write(text, file)


def _write(content: str | bytes, file: str) -> None:
    if file == STANDARD_OUTPUT:
        data = content.encode("utf-8", "replace") if isinstance(content, str) else content
        click.echo(data, nl=False)
    else:
        save(content, file)
