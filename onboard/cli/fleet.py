"""``onboard fleet``: many vehicles, many logs; a line for each accelerometer of each recording."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from pathlib import Path

import click
from rich.console import Console
from rich.text import Text

from onboard.answers.fleet import FleetDocument, Flown, fly, found
from onboard.answers.knowledge import determined
from onboard.cli.progress import numbered
from onboard.cli.replay import STANDARD_OUTPUT, write_json, write_text
from onboard.core.estimate.result import Calibration, Status
from onboard.errors import UsageError

NAME = 26
WIDTH = 80
UNKNOWN = "-"
STATES = {
    Status.CALIBRATED: ("calibrated", "green"),
    Status.COLLECTING: ("too short", "yellow"),
    Status.INSUFFICIENT: ("not shown", "yellow"),
    Status.INVALID: ("invalid", "red"),
}
ROW = "{:<26} {:>3} {:<10} {:>5} {:>7} {:>8} {:>14}"
HEAD = ROW.format("recording", "imu", "state", "cover", "scale", "offset", "residual")
EXAMPLES = """\
\b
onboard fleet logs/
onboard fleet kite-1/ kite-2/ --json fleet.json --report pages/
onboard fleet logs/ --json - | jq '.recordings[] | select(.error) | .file'
"""


class UnreadError(UsageError):
    """Some recordings could not be read; the others are done."""


@click.command(epilog=EXAMPLES)
@click.argument(
    "places", nargs=-1, required=True, metavar="DIR...", type=click.Path(path_type=Path)
)
@click.option(
    "--json",
    "json_file",
    metavar="FILE",
    help="Write the results as JSON, '-' for standard output (then without the table).",
)
@click.option(
    "--report",
    "report_folder",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Write one HTML page for each recording into this folder.",
)
@click.option(
    "--imu", type=click.IntRange(1, 5), metavar="N", help="This accelerometer only, 1 to 5."
)
def fleet(
    places: tuple[Path, ...], json_file: str | None, report_folder: Path | None, imu: int | None
) -> None:
    """Calibrate from every recording in folders: .BIN, .tlog and .ulg, sub-folders too.

    Each recording is replayed by itself.  A line says how far it shows each accelerometer, the
    largest change of an observed scale (%) and offset (m/s^2), and the velocity residual (m/s)
    with the parameters in force and with the estimate.  A recording that cannot be read is told
    of and the rest goes on; the exit status is then 2.
    """
    files = found(places)
    console = Console(highlight=False, soft_wrap=True)
    table = json_file != STANDARD_OUTPUT
    if report_folder is not None:
        _make(report_folder)
    if table:
        console.print(Text(HEAD, style="bold"))
    done: list[Flown] = []
    for one in fly(files, imu=imu, watched=report_folder is not None, watching=numbered):
        if report_folder is not None:
            _report(one, report_folder)
        if table:
            for line in _lines(one):
                console.print(line)
        # What a page was drawn from is large, and no longer needed.
        done.append(Flown(one.path, one.name, one.replay, None, one.error))
    if json_file is not None:
        write_json(FleetDocument.of(done).to_json(), json_file)
    failed = sum(bool(one.error) for one in done)
    if failed:
        raise UnreadError(f"{failed} of {len(done)} recordings could not be read")


def _lines(one: Flown) -> Iterator[Text]:
    if one.replay is None:
        said = one.error.removeprefix(f"{one.path}: ")
        yield from _wrapped(f"{_short(one.name):<{NAME}} {said}", "red")
        return
    name = _short(one.name)
    for calibration in one.replay.calibrations:
        yield _line(name, calibration)
        name = ""
    for recording in one.replay.recordings:
        for damage in recording.damage:
            yield from _wrapped(f"{'':<{NAME}} damage: {damage}", "yellow")


def _line(name: str, c: Calibration) -> Text:
    words, style = STATES[c.status]
    scale = _largest(c, (0, 1, 2), c.scale, c.in_force_scale)
    offset = _largest(c, (3, 4, 5), c.offset, c.in_force_offset)
    residual = f"{_fixed(c.velocity_rms_before, 2)} > {_fixed(c.velocity_rms_after, 2)}"
    row = ROW.format(
        name,
        c.imu,
        words,
        f"{c.coverage.percent:.0f} %",
        f"{100.0 * scale:+.2f}" if math.isfinite(scale) else UNKNOWN,
        f"{offset:+.3f}" if math.isfinite(offset) else UNKNOWN,
        residual,
    )
    line = Text(row)
    line.stylize(style, NAME + 5, NAME + 15)
    return line


def _largest(
    c: Calibration, which: tuple[int, ...], values: tuple[float, ...], held: tuple[float, ...]
) -> float:
    """The largest change of a known number, with its sign; NaN if none is known."""
    found = determined(c)
    flags = found.known if found is not None else (False,) * 6
    changes = [values[i % 3] - held[i % 3] for i in which if flags[i]]
    return max(changes, key=abs, default=math.nan)


def _short(name: str) -> str:
    return name if len(name) <= NAME else "..." + name[-NAME + 3 :]


def _wrapped(text: str, style: str) -> Iterator[Text]:
    for line in textwrap.wrap(text, WIDTH, subsequent_indent=" " * (NAME + 1)):
        yield Text(line, style=style)


def _fixed(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else UNKNOWN


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder}: cannot be made ({error.strerror})") from None


def _report(one: Flown, folder: Path) -> None:
    if one.replay is None or one.chronicle is None:
        return
    from onboard.report.replay import replay_html

    name = "-".join(Path(one.name).parts) + ".html"
    write_text(replay_html(one.replay, one.chronicle), str(folder / name))
