"""``onboard match``: what a real flight has that its simulation lacks, vehicle and sensors."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import click
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from onboard.answers.flown_again import FlownAgain
from onboard.answers.match import Match
from onboard.answers.match import match as match_recordings
from onboard.answers.match_document import match_document
from onboard.answers.match_files import frame_text, read_frame, settings_text
from onboard.answers.match_story import sentence
from onboard.answers.match_words import (
    COLOURS,
    blown,
    compared,
    headline,
    number,
    proof,
    proof_unit,
    wind_sentence,
)
from onboard.cli.outputs import STANDARD_OUTPUT, refuse_overwriting
from onboard.cli.progress import reading, waiting
from onboard.cli.replay import write_json, write_text
from onboard.cli.terminal import Terminal
from onboard.errors import RecordingError, UsageError
from onboard.recordings.recording import Recording, because_of
from onboard.recordings.table import open_table

EXAMPLES = """\
\b
onboard match flight.BIN
onboard match simulation.BIN flight.BIN --json result.json
onboard match flight.BIN --with yesterday.BIN --with monday.BIN
onboard match flight.BIN --report flight.html
onboard match flight.BIN --verify
onboard match flight.BIN --verify --ardupilot build/sitl/bin
onboard match flight.csv --columns columns.toml
onboard match flight.BIN --param sim.param --frame-out frame.json
"""
TWO = 2
TABLE = ".csv"
AIR = ("wind", "turbulence")
"""Effects that have a line of their own."""
AXES = {"x": "ahead (x)", "y": "to the side (y)", "z": "up and down (z)"}


@click.command(epilog=EXAMPLES)
@click.argument(
    "logs", nargs=-1, required=True, metavar="[SIM] REAL", type=click.Path(path_type=Path)
)
@click.option(
    "--with",
    "others",
    metavar="FILE",
    multiple=True,
    type=click.Path(path_type=Path),
    help="Another flight of the vehicle: one airframe for all. Repeat.",
)
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON, '-': stdout.")
@click.option("--report", "report_file", metavar="FILE", help="Write one self-contained HTML page.")
@click.option("--param", "param_file", metavar="FILE", help="Write settings of the simulator.")
@click.option(
    "--frame-out", "frame_file", metavar="FILE", help="Write a frame file that SITL loads."
)
@click.option(
    "--verify", "verifies", is_flag=True, help="Let the simulator fly it again with what was found."
)
@click.option(
    "--ardupilot",
    "ardupilot",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="With --verify: the folder of ArduPilot's SITL, which then flies it.",
)
@click.option(
    "--columns",
    "columns_file",
    metavar="FILE",
    help="Recordings that end in .csv are tables; FILE says what their columns are.",
)
@click.option(
    "--frame", "given_frame", metavar="FILE", help="Compare with this frame file of SITL."
)
def match(
    logs: tuple[Path, ...],
    others: tuple[Path, ...],
    json_file: str | None,
    report_file: str | None,
    param_file: str | None,
    frame_file: str | None,
    given_frame: str | None,
    columns_file: str | None,
    ardupilot: Path | None,
    *,
    verifies: bool,
) -> None:
    """Make the simulator fly like the recording.

    With one recording: what the vehicle has that ArduPilot's nominal airframe (or --frame)
    lacks.  With two: what differs between the simulation's and the real one.  Says what, how sure
    that is, and with which settings the simulation flies like the vehicle.
    """
    if len(logs) > TWO:
        raise UsageError("match takes one recording, or a simulation's and a real one")
    if ardupilot is not None and not verifies:
        raise UsageError("--ardupilot is for --verify")
    read = (*logs, *others, given_frame, columns_file)
    refuse_overwriting(read, json_file, report_file, param_file, frame_file)
    frame = None if given_frame is None else read_frame(given_frame)
    opened = [_opened(log, columns_file) for log in logs]
    further = [_opened(log, columns_file) for log in others]
    simulation = opened[0] if len(logs) == TWO else None
    with reading((*logs, *others), then="comparing vehicles") as progress:
        result = match_recordings(
            opened[-1], simulation, others=further, frame=frame, progress=progress
        )
    if result.silent:
        raise RecordingError(f"{logs[-1]}: {result.vehicle.note}{because_of(result.damage)}")
    verified = None
    if verifies:
        # The simulator only when it is wanted.
        from onboard.cli.match_verify import verify

        with waiting("flying it again"):
            verified = verify(result, logs[-1], ardupilot)
    if json_file is not None:
        write_json(match_document(result, verified).to_json(), json_file)
    if report_file is not None:
        # jinja2 only when it is wanted.
        from onboard.report.match import match_html

        write_text(match_html(result, verified), report_file)
    if param_file is not None:
        write_text(settings_text(result), param_file)
    if frame_file is not None:
        write_text(frame_text(result), frame_file)
    if STANDARD_OUTPUT not in (json_file, report_file, param_file, frame_file):
        console = Terminal(highlight=False)
        for part in summary(result):
            console.print(part)
        if verified is not None:
            console.print(flown_again_table(verified))


def _opened(log: Path, columns: str | None) -> Path | Recording:
    """A table by its column map; other recordings are opened by their content.

    Raises:
        UsageError: a table without a map, or one that cannot be used.
    """
    if log.suffix.lower() != TABLE:
        return log
    if columns is None:
        raise UsageError(f"{log}: a table needs --columns: what its columns are")
    return open_table(log, columns)


def summary(result: Match) -> Iterator[RenderableType]:
    """What a person reads in ten seconds, and then the numbers."""
    vehicle = result.vehicle
    names = [result.real.name]
    if result.simulation is not None:
        names.insert(0, result.simulation.name)
    # Of a flight that nothing is told of nobody has counted the seconds.
    flown = f", {vehicle.seconds:.0f} s in the air" if vehicle.series is not None else ""
    yield Text(f"{' against '.join(names)}: {vehicle.vehicle}{flown}")
    yield Text(f"{headline(result)}.", style=f"bold {COLOURS[result.verdict]}")
    yield from (Text(f"damage: {note}", "yellow") for note in result.damage)
    if result.effects:
        yield from ("", _effects(result))
    yield from ("", _facts(result))


def flown_again_table(verified: FlownAgain) -> Table:
    """The simulator's flights beside the recording."""
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    table.add_row("Verified", verified.sentence)
    for key, m in verified.mismatch.items():
        unit = "deg" if key == "tilt" else "m/s^2"
        said = f"{key}: {m.before:.3f} -> {m.after:.3f} {unit} RMS from the recording"
        table.add_row("", f"{said}, nominal and with what was found")
    for key, n in verified.numbers.items():
        same = "" if n.agrees else "  differs"
        again = f"{number(n.again, n.sigma)} flown again"
        if not math.isfinite(n.again):
            again, same = "not told by the simulator's flight", ""
        table.add_row("", f"{key}: {number(n.real, n.sigma)} recorded, {again}{same}")
    if verified.left:
        table.add_row("", f"still against the frame: {', '.join(verified.left)}")
    return table


def _effects(result: Match) -> Table:
    """One line a number: as the simulation has it, as the recording has it."""
    table = Table(box=None, padding=(0, 1), show_edge=False, pad_edge=False)
    for heading in ("effect", "number"):
        table.add_column(heading)
    for heading in ("simulation", "recording", "sigma"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for d in result.effects:
        for k, (key, value) in enumerate(d.values.items()):
            table.add_row("" if k else d.name, key, *compared(value))
    return table


def _facts(result: Match) -> Table:
    vehicle = result.vehicle
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for k, d in enumerate(d for d in result.effects if d.name not in AIR):
        table.add_row("" if k else "In words", sentence(d))
    wind = wind_sentence(result)
    if wind:
        table.add_row("Wind", wind)
    aside = {a.number for a in vehicle.aside}
    flights = zip(result.others, vehicle.other_winds, strict=False)
    for k, (other, its) in enumerate(flights, 1):
        name = f"{other.name} (flight {k + 1}, set aside)" if k in aside else other.name
        table.add_row("", f"{blown(its)}: {name}")
    for k, (axis, m) in enumerate(vehicle.mismatch.items()):
        said = f"{AXES.get(axis, axis)} off by {m.before:.3f} -> {m.after:.3f} m/s^2 RMS"
        table.add_row("" if k else "Force", said)
    if vehicle.mismatch:
        table.add_row("", "nominal airframe -> what was found, on flight not used in the fit")
    if math.isfinite(vehicle.alone_before):
        said = f"{vehicle.alone_before:.2f} -> {vehicle.alone_after:.2f} m/s"
        table.add_row("Alone", f"velocity off by {said} after 10 s of the model alone")
    for k, d in enumerate(d for d in result.effects if proof(d) and d.level == "vehicle"):
        said = f"{d.name}: {proof(d)} {proof_unit(d)} without and with it"
        table.add_row("" if k else "Proof", said)
    for k, a in enumerate(vehicle.ambiguous):
        said = f"{' and '.join(a.names)}. To tell: {a.tell_apart}."
        table.add_row("" if k else "Not told apart", said)
    for k, s in enumerate(result.settings):
        sigma = f"  (sigma {number(s.sigma, s.sigma)})" if s.sigma > 0.0 else ""
        table.add_row("" if k else "Settings", f"{s.name} {number(s.value, s.sigma)}{sigma}")
    reasons: dict[str, list[str]] = {}
    for n in result.not_testable:
        reasons.setdefault(n.why, []).append(n.name)
    for k, (why, names) in enumerate(reasons.items()):
        table.add_row("" if k else "Not tested", f"{', '.join(names)}: {why}")
    if vehicle.note:
        table.add_row("Note", vehicle.note)
    return table
