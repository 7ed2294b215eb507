"""What a fleet costs: processor time, bytes, memory; and what that comes to for a million flights.

``python -m benchmarks.fleet FOLDER`` replays the recordings in a folder, without one simulated
flights of two vehicles; once for each number of processes, from an empty store, and once more from
the full one.  What is said of a vehicle over time is timed on copies of one flight, a day apart.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from onboard.answers.fleet.history import history_of
from onboard.answers.fleet.record import Flown, Record
from onboard.answers.fleet.vehicles import vehicles_of
from onboard.batches.store import DIGEST, MAGIC
from onboard.recordings.provenance import Provenance
from sitl.builtin.truth import ImuTruth
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


def flights(folder: Path, count: int) -> None:
    """Simulated flights of a copter and a plane."""
    for k in range(count):
        truth = ImuTruth(scale=(1.02, 0.99, 1.01), offset=(0.2, -0.1, 0.3))
        spec = FlightSpec(
            vehicle="plane" if k % 2 else "copter",
            duration=FLIGHT_S,
            imus=(truth,),
            seed=k,
            start_unix_us=1_760_000_000_000_000 + k * 86_400_000_000,
        )
        write_tlog(spec, folder / f"{k:02}.tlog")


def run(folder: Path, jobs: int, store: Path, document: Path) -> Run:
    """The command itself, in a process of its own."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.monotonic()
    command = [sys.executable, "-m", "onboard", "fleet", str(folder), "--jobs", str(jobs),
               "--store", str(store), "--json", str(document)]  # fmt: skip
    quiet = subprocess.DEVNULL
    subprocess.run(command, check=False, stdout=quiet, stderr=quiet)  # noqa: S603 - ours
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Run(time.monotonic() - began, cpu, after.ru_maxrss * 1024)


def measured(folder: Path, processes: Sequence[int]) -> Cost:
    """Print what a folder costs."""
    hours, accelerometers, records, per_hour = 0.0, 0, [0], 0.0
    documents: set[bytes] = set()
    with tempfile.TemporaryDirectory() as scratch:
        for jobs in processes:
            store, out = Path(scratch) / f"store-{jobs}", Path(scratch) / "fleet.json"
            once = run(folder, jobs, store, out)
            again = run(folder, jobs, store, out)
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
    parser.add_argument("--flight-s", type=float, default=900.0, help="of the million")
    parser.add_argument("--core-hour", type=float, default=CORE_HOUR)
    told = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = told.folder or Path(scratch)
        if told.folder is None:
            flights(folder, told.simulated)
        million(measured(folder, told.jobs), told)


if __name__ == "__main__":
    main()
