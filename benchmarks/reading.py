"""Reading recordings: structured arrays and samples against other readers, side by side.

The other reader is the usual loop, ``recv_match`` with the names that are asked for, of pymavlink
(of pyulog, its filter by name); mavparser, if it is installed, and whatever it gives that was asked
for.  All read the same files one after the other, several times, in one process: medians of
processor time, and ratios to the other reader's.  Memory is the most that is held while arrays are
read over the size of the arrays.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import io
import time
import tracemalloc
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from pymavlink import mavutil

from benchmarks.recorded import folder
from onboard.mavlink.decode import Decoder
from onboard.recordings import dataflash, ulog
from onboard.recordings.arrays import read_arrays
from onboard.recordings.opening import kind_of, open_recording

FILES = (
    "frames/f01.BIN",
    "sitl/c02.BIN",
    "real/real-quad-07.BIN",
    "real/real-quad-22-chibios.BIN",
    "real/real-fixedwing-02.BIN",
    "quiver/quiver-00090.BIN",
    "sitl/a02.tlog",
    "sitl/b05.tlog",
    "sitl/c02.tlog",
    "real/real-px4-hex-23.ulg",
)
REPEATS = 5
EVERYTHING: dict[str, tuple[str, ...]] = {
    "dataflash": tuple(sorted(dataflash.WANTED)),
    "tlog": Decoder.names,
    "ulog": tuple(ulog.CONVERTERS),
}
"""What the estimator reads of a log."""
THREE: dict[str, tuple[str, ...]] = {
    "dataflash": ("IMU", "ATT", "GPS"),
    "tlog": ("RAW_IMU", "ATTITUDE", "GPS_RAW_INT"),
    "ulog": ("sensor_combined", "vehicle_attitude", "vehicle_gps_position"),
}
Reader = Callable[[Path, tuple[str, ...]], int]
"""Reads the messages of some names; their number."""
WHERE = "no recordings beside the project; set ONBOARD_RECORDINGS"


def by_pymavlink(path: Path, names: tuple[str, ...]) -> int:
    """The filtered loop."""
    log, wanted, count = mavutil.mavlink_connection(str(path)), list(names), 0
    try:
        while log.recv_match(type=wanted) is not None:
            count += 1
    finally:
        log.close()
    return count


def by_pyulog(path: Path, names: tuple[str, ...]) -> int:
    """Its filter by name."""
    from pyulog.core import ULog

    return sum(len(d.data["timestamp"]) for d in ULog(str(path), list(names)).data_list)


def by_mavparser(path: Path, names: tuple[str, ...]) -> int:
    """Its stream of every message, of which some are counted."""
    parse, wanted = importlib.import_module("mavparser").parse, frozenset(names)
    return sum(m["mavpackettype"] in wanted for m in parse(str(path), mode="iterator"))


def as_arrays(path: Path, names: tuple[str, ...]) -> int:
    """Structured arrays."""
    return sum(len(table) for table in read_arrays(path, names).tables.values())


def as_samples(path: Path, _names: tuple[str, ...]) -> int:
    """What the estimator eats; always of all that it reads."""
    return sum(1 for _ in open_recording(path).samples())


def seconds(readers: dict[str, Reader], path: Path, names: tuple[str, ...]) -> dict[str, float]:
    """Medians of processor time by reader, taken in turn."""
    spent: dict[str, list[float]] = {name: [] for name in readers}
    for _ in range(REPEATS):
        for name, read in readers.items():
            began = time.process_time()
            with contextlib.redirect_stdout(io.StringIO()):
                read(path, names)
            spent[name].append(time.process_time() - began)
    return {name: float(np.median(times)) for name, times in spent.items()}


def memory(path: Path, names: tuple[str, ...]) -> tuple[float, float]:
    """Size of the arrays, MB, and the most that was held over it."""
    read_arrays(path, names)  # tables of checksums are made once
    tracemalloc.start()
    made = read_arrays(path, names)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    size = sum(table.nbytes for table in made.tables.values())
    return size / 1e6, peak / size


def line(path: Path, asked: str, names: dict[str, tuple[str, ...]], *, mavparser: bool) -> str:
    """One row."""
    kind = kind_of(path)
    other = by_pyulog if kind == "ulog" else by_pymavlink
    readers: dict[str, Reader] = {"other": other, "arrays": as_arrays}
    if asked == "all":
        readers["samples"] = as_samples
    if kind == "dataflash" and mavparser:
        readers["mavparser"] = by_mavparser
    took = seconds(readers, path, names[kind])
    ratios = "".join(
        f"{took['other'] / took[name]:10.1f} x" if name in took else f"{'-':>12}"
        for name in ("arrays", "mavparser", "samples")
    )
    size, most = memory(path, names[kind])
    count = as_arrays(path, names[kind])
    return (
        f"{path.name:28}{asked:>6}{count:10}{1e3 * took['other']:12.0f}{ratios}"
        f"{1e3 * took['arrays']:11.1f}{size:10.2f}{most:10.2f}"
    )


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Time and memory of reading recordings.")
    parser.add_argument("files", nargs="*", type=Path, help="others than the usual ones")
    chosen = parser.parse_args(arguments)
    usual = [folder().parent / name for name in FILES]
    files: Iterable[Path] = chosen.files or [path for path in usual if path.is_file()]
    if not files:
        print(WHERE)
        return
    mavparser = importlib.util.find_spec("mavparser") is not None
    heads = ("arrays", "mavparser", "samples", "arrays, ms", "MB", "memory")
    print(
        f"{'file':28}{'asked':>6}{'messages':>10}{'other, ms':>12}"
        f"{heads[0]:>12}{heads[1]:>12}{heads[2]:>12}{heads[3]:>11}{heads[4]:>10}{heads[5]:>10}"
    )
    for path in files:
        for asked, names in (("all", EVERYTHING), ("three", THREE)):
            print(line(path, asked, names, mavparser=mavparser), flush=True)


if __name__ == "__main__":
    main()
