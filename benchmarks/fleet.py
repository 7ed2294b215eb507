"""What a fleet costs: processor time, bytes, memory; and what that comes to for a million flights.

``python -m benchmarks.fleet FOLDER`` replays the recordings in a folder, without one simulated
flights, a folder for each of ``--vehicles``; once for each number of processes, from an empty
store, and once more from the full one.  With ``--cluster`` the same is done by a Dask cluster of
two workers here, of which one is killed in the middle.  What is said of a vehicle over time is
timed on copies of one flight, a day apart.
"""

from __future__ import annotations

import argparse
import importlib
import json
import logging
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from onboard.answers.fleet.history import history_of
from onboard.answers.fleet.record import Flown, Record
from onboard.answers.fleet.vehicles import vehicles_of
from onboard.batches.store import DIGEST, MAGIC
from onboard.recordings.provenance import Provenance
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, write_tlog

MILLION = 1_000_000
FLIGHT_S = 160.0
CORE_HOUR = 0.04
"""Currency of a core for an hour, as clouds ask; told with --core-hour."""
HOUR_S = 3600.0


@dataclass(frozen=True, slots=True)
class Run:
    """One run of the command: s of the clock, s of processors, bytes of the largest process."""

    wall_s: float
    cpu_s: float
    largest: int


@dataclass(frozen=True, slots=True)
class Cost:
    """Of an hour of flight: s of processor, bytes of log; of a flight: bytes kept, in memory."""

    cpu_s: float
    log: float
    record: float
    memory: float


def flights(folder: Path, count: int, vehicles: int, seconds: float) -> None:
    """Simulated flights, a day apart, by turns of so many copters and planes."""
    for k in range(count):
        vehicle, day = k % vehicles, k // vehicles
        own = folder / f"vehicle-{vehicle:02}"
        own.mkdir(exist_ok=True)
        spec = FlightSpec(
            vehicle="plane" if vehicle % 2 else "copter",
            duration=seconds,
            imus=random_imus(vehicle),
            seed=k,
            start_unix_us=1_760_000_000_000_000 + day * 86_400_000_000 + vehicle * 3_600_000_000,
        )
        write_tlog(spec, own / f"{day:02}.tlog")


def run(
    folder: Path, where: Sequence[str], document: Path, during: Callable[[], None] | None = None
) -> Run:
    """The command itself, in a process of its own; ``where`` are options that say who does it."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.monotonic()
    command = [sys.executable, "-m", "onboard", "fleet", str(folder), "--by-folder",
               "--json", str(document), *where]  # fmt: skip
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, stdout=quiet, stderr=quiet):  # noqa: S603 - ours
        if during is not None:
            during()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Run(time.monotonic() - began, cpu, after.ru_maxrss * 1024)


def on_cluster(folder: Path, document: Path, batch: int, lost_after_s: float) -> None:
    """Print what two workers of a Dask cluster need, of which one is killed after some seconds."""
    distributed = importlib.import_module("distributed")
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    quiet = logging.CRITICAL
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=quiet
    ) as cluster:
        held: list[int] = []

        def kill() -> None:
            """A worker that is in the middle of something."""
            time.sleep(lost_after_s)
            while not held:
                states = cluster.scheduler.workers
                for worker in cluster.workers.values():
                    state = states.get(worker.worker_address)
                    if not held and state is not None and state.processing:
                        held.append(len(state.processing))
                        os.kill(worker.pid, signal.SIGKILL)
                time.sleep(0.01)

        where = ["--scheduler", cluster.scheduler_address, "--batch", str(batch)]
        once = run(folder, where, document, during=kill)
    print(
        f"cluster of two: {once.wall_s:.1f} s; one was killed after {lost_after_s:.0f} s, "
        f"with {held[0]} batches"
    )


def measured(folder: Path, processes: Sequence[int], batch: int | None) -> Cost:
    """Print what a folder costs; ``batch``: recordings a task of a cluster, None: no cluster."""
    hours, accelerometers, records, per_hour = 0.0, 0, [0], 0.0
    documents: set[bytes] = set()
    with tempfile.TemporaryDirectory() as scratch:
        for jobs in processes:
            store, out = Path(scratch) / f"store-{jobs}", Path(scratch) / "fleet.json"
            where = ["--jobs", str(jobs), "--store", str(store)]
            once, again = run(folder, where, out), run(folder, where, out)
            documents.add(out.read_bytes())
            replays = [r["replay"] for r in json.loads(out.read_bytes())["recordings"]]
            seconds = [r["recording"]["duration_s"] for r in replays if r]
            hours, accelerometers = sum(seconds) / HOUR_S, sum(len(r["imus"]) for r in replays if r)
            records = [file.stat().st_size for file in store.rglob("*.record")]
            per_hour = once.cpu_s / hours
            print(
                f"{jobs} process{'es' if jobs > 1 else ''}: {once.wall_s:.1f} s, "
                f"{once.cpu_s:.1f} s of processor, largest process {once.largest / 1e6:.0f} MB; "
                f"from the store {again.wall_s:.1f} s"
            )
        if batch is not None:
            on_cluster(folder, Path(scratch) / "cluster.json", batch, 0.4 * once.wall_s)
            documents.add((Path(scratch) / "cluster.json").read_bytes())
        size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
        print(f"documents: {'the same' if len(documents) == 1 else 'DIFFERENT'}")
        print(f"{len(seconds)} flights, {hours:.3f} h, {accelerometers} accelerometers, {size} B")
        each = per_hour * len(seconds) / accelerometers
        print(f"processor: {per_hour:.0f} s an hour of flight, {each:.0f} s for one accelerometer")
        print(f"store: {np.mean(records):.0f} B a flight, "
              f"{sum(records) / accelerometers:.0f} B an accelerometer")  # fmt: skip
        print(f"document: {len(out.read_bytes()) / len(seconds):.0f} B a flight")
        kept = next(store.rglob("*.record")).read_bytes()[len(MAGIC) + DIGEST :]
        statistics(msgspec.msgpack.decode(kept, type=Record))
        return Cost(per_hour, size / hours, float(np.mean(records)), _in_memory(kept))


def _in_memory(kept: bytes, count: int = 50) -> float:
    """Bytes that a record takes in the process that puts vehicles together; prints both kinds."""
    sizes = []
    for lean in (False, True):
        tracemalloc.start()
        held = []
        for _ in range(count):
            record = msgspec.msgpack.decode(kept, type=Record)
            held.append(record.lean if lean else record)
        del record
        sizes.append(tracemalloc.get_traced_memory()[0] / len(held))
        tracemalloc.stop()
    print(f"memory: {sizes[0]:.0f} B a flight, {sizes[1]:.0f} B without --json")
    return sizes[1]


def statistics(kept: Record) -> None:
    """Time what is said of one vehicle, with copies of one flight's record, a day apart."""
    for count in (10, 100, 1000):
        logs = [Flown(Path(f"{k}.BIN"), f"{k}.BIN", _another_day(kept, k)) for k in range(count)]
        began = time.process_time()
        (vehicle,) = vehicles_of(logs)
        history_of(vehicle)
        print(f"{count} flights of a vehicle: {1e3 * (time.process_time() - began):.0f} ms")


def _another_day(record: Record, day: int) -> Record:
    began = 1_700_000_000.0 + 86_400.0 * day
    where = Provenance(board="00", began_unix_s=began, ended_unix_s=began + 200.0)
    return msgspec.structs.replace(record, sha256=str(day), provenance=where)


def million(cost: Cost, told: argparse.Namespace) -> None:
    """Print the arithmetic."""
    hours = MILLION * told.flight_s / HOUR_S
    cores, logs = cost.cpu_s * hours / HOUR_S, cost.log * hours
    price = cores * told.core_hour
    print(f"\na million flights of {told.flight_s:.0f} s: {hours:,.0f} h")
    print(f"{cores:,.0f} core hours, at {told.core_hour} each {price:,.0f}")
    print(f"in a day: {cores / 24:,.0f} cores, which read {logs / 86400 / 1e6:,.0f} MB/s")
    print(f"logs: {logs / 1e12:.1f} TB; store: {MILLION * cost.record / 1e9:.1f} GB")
    print(f"memory where vehicles are put together: {MILLION * cost.memory / 1e9:.1f} GB")


def main() -> None:
    """Measure, and multiply."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--jobs", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--simulated", type=int, default=8, help="flights, without a folder")
    parser.add_argument("--vehicles", type=int, default=2, help="that fly them")
    parser.add_argument("--seconds", type=float, default=FLIGHT_S, help="of each of them")
    parser.add_argument("--cluster", type=int, metavar="N", help="with N recordings a task")
    parser.add_argument("--flight-s", type=float, default=900.0, help="of the million")
    parser.add_argument("--core-hour", type=float, default=CORE_HOUR)
    told = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = told.folder or Path(scratch)
        if told.folder is None:
            flights(folder, told.simulated, told.vehicles, told.seconds)
        million(measured(folder, told.jobs, told.cluster), told)


if __name__ == "__main__":
    main()
