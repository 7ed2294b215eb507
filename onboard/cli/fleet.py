"""``onboard fleet``: many vehicles, many logs; a line for each accelerometer of each recording."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click
from rich.text import Text

from onboard.answers.fleet.history import history_of
from onboard.answers.fleet.places import found
from onboard.answers.fleet.record import Flown
from onboard.answers.fleet.shared_numbers import common_of
from onboard.answers.fleet.vehicles import vehicles_of
from onboard.batches.cluster import MOST_PER_BATCH, PER_BATCH
from onboard.batches.crew import cores
from onboard.batches.running import Orders, fly
from onboard.batches.store import Store
from onboard.cli.fleet_results import Results, pages_of
from onboard.cli.fleet_table import HEAD, lines, vehicle_lines
from onboard.cli.outputs import STANDARD_OUTPUT, refuse_overwriting, refuse_unwritable
from onboard.cli.progress import many
from onboard.cli.terminal import Terminal
from onboard.errors import UsageError

EXAMPLES = """\
\b
onboard fleet logs/
onboard fleet logs/ --jobs 8 --store results/ --report pages/
onboard fleet kite-1/ kite-2/ --by-folder --json fleet.json
onboard fleet logs/ --parquet fleet.parquet --scheduler tcp://10.0.0.1:8786
onboard fleet logs/ --json - | jq '.recordings[] | select(.error) | .file'
"""


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
    "--parquet",
    "parquet_file",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Write a table, a row for each accelerometer of each recording (needs pyarrow).",
)
@click.option(
    "--report",
    "report_folder",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Write one HTML page for each recording into this folder, and an index of the vehicles.",
)
@click.option(
    "--imu", type=click.IntRange(1, 5), metavar="N", help="This accelerometer only, 1 to 5."
)
@click.option(
    "--by-folder",
    is_flag=True,
    help="Each folder holds recordings of one vehicle, where they do not say a serial number.",
)
@click.option(
    "--jobs",
    type=click.IntRange(1, 1024),
    metavar="N",
    help="Processes beside each other; default: a process for each core.",
)
@click.option(
    "--store",
    "store_folder",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Keep results here; what is there already is not done again.",
)
@click.option(
    "--scheduler",
    default="",
    metavar="ADDRESS",
    help="Let a Dask cluster do it, e.g. tcp://10.0.0.1:8786 (needs dask.distributed).",
)
@click.option(
    "--batch",
    "per_batch",
    type=click.IntRange(1, MOST_PER_BATCH),
    default=PER_BATCH,
    show_default=True,
    metavar="N",
    help="Recordings for each task of the cluster.",
)
def fleet(
    places: tuple[Path, ...],
    json_file: str | None,
    parquet_file: Path | None,
    report_folder: Path | None,
    imu: int | None,
    by_folder: bool,  # noqa: FBT001 - an option of the command
    jobs: int | None,
    store_folder: Path | None,
    scheduler: str,
    per_batch: int,
) -> None:
    """Calibrate from every recording in folders: .BIN, .tlog and .ulg, sub-folders too.

    Each recording is replayed by itself.  A line says how far it shows each accelerometer, the
    largest change of an observed scale (%) and offset (m/s^2), and the velocity residual (m/s)
    with the parameters in force and with the estimate.  A recording that cannot be read is
    reported, and the others are done all the same; the exit status is then 2.

    Recordings of one vehicle, known by the serial number of its board, are then put together: what
    drifts, what has stepped between two flights, and which flights contradict the others.
    """
    files = found(places)
    refuse_overwriting((path for path, _ in files), json_file, parquet_file)
    _possible(parquet_file, json_file, report_folder, store_folder, scheduler)
    orders = Orders(
        processes=jobs or cores(),
        imu=imu,
        paged=report_folder is not None,
        documents=json_file is not None,
        store=store_folder,
        scheduler=scheduler,
        per_batch=per_batch,
    )
    console = Terminal(highlight=False, soft_wrap=True)
    table = json_file != STANDARD_OUTPUT
    places_of = pages_of([name for _, name in files])
    results = Results(report_folder, parquet_file, json_file, places_of)
    if table:
        console.print(Text(HEAD, style="bold"))
    done: list[Flown] = []
    with many(len(files)) as told:
        for one in fly(files, orders, told=told, paged=results.page):
            done.append(one)
            for line in lines(one) if table else ():
                console.print(line)
    histories = [history_of(v) for v in vehicles_of(done, by_folder=by_folder)]
    compared = common_of([h.vehicle for h in histories])
    for line in vehicle_lines(histories, compared) if table else ():
        console.print(line)
    results.write(done, histories, compared)


def _possible(
    parquet_file: Path | None,
    json_file: str | None,
    report_folder: Path | None,
    store_folder: Path | None,
    scheduler: str,
) -> None:
    """See to it before hours of work that their results can be written."""
    refuse_unwritable(json_file)
    refuse_unwritable(parquet_file, anew=True)
    if report_folder is not None:
        _make(report_folder)
    if store_folder is not None:
        Store(store_folder).prepare()
    if parquet_file is not None:
        from onboard.batches.table import imported

        imported()
    if scheduler:
        from onboard.batches.cluster import imported as cluster

        cluster()


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise UsageError(f"{folder}: cannot be made ({error.strerror})") from None
