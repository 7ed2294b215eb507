"""Matches of a laboratory's flights: a small quadrotor between cameras, a table of each flight.

``python -m benchmarks.laboratory FOLDER`` asks ``onboard match`` about every table in a folder and
says by how much its model lowers the lateral force on flight that was not used.  The column map is
that of NanoBench (a Crazyflie with Vicon's places and velocities; syediu/nanobench-iros2026 on
GitHub, ``datasets/dataset``), or ``--columns`` for other data.  Nothing of it is kept here.

Tables with the same flight in them are told by their bytes and counted once; tables that cannot be
used, or of which nothing can be said, are told with the reason.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import io
import json
import math
import statistics
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from onboard.cli.main import run

MAP = """\
vehicle = "copter"
world = "enu"
body = "flu"
[time]
column = "t"
unit = "s"
[attitude]
quaternion = ["qw", "qx", "qy", "qz"]
[force]
columns = ["imu_acc_x", "imu_acc_y", "imu_acc_z"]
unit = "g"
[rates]
columns = ["imu_gyro_x", "imu_gyro_y", "imu_gyro_z"]
unit = "rad/s"
[velocity]
columns = ["vx", "vy", "vz"]
[position]
columns = ["px", "py", "pz"]
[motors]
columns = ["motor_motor_m1", "motor_motor_m2", "motor_motor_m3", "motor_motor_m4"]
range = [0, 65535]
[voltage]
column = "pwr_pm_vbat"
[origin]
latitude = 47.4
altitude = 100
"""
"""NanoBench's columns; where its laboratory is it does not say, and a kilometre is a tenth of the
air's density."""


@dataclass(frozen=True, slots=True)
class Flight:
    """What was said of one table.

    Attributes:
        name: of the file.
        why: nothing could be said, and why; empty where something was.
        lateral: RMS of the lateral force on flight that was not used, before and after, m/s^2.
        document: ``onboard.match/1``.
    """

    name: str
    why: str = ""
    lateral: tuple[float, float] = (math.nan, math.nan)
    document: dict[str, Any] | None = None

    def line(self) -> str:
        """For a table on a terminal."""
        if self.document is None:
            return f"{self.name:38} {self.why}"
        names = ", ".join(e["name"] for e in self.document["effects"]) or "nothing"
        before, after = self.lateral
        verdict = self.document["verdict"]
        return f"{self.name:38} {before:.3f} -> {after:.3f} m/s^2  {verdict}: {names}"


def asked(path: Path, columns: Path) -> Flight:
    """``onboard match`` of one table."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "match.json"
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            status = run(["match", str(path), "--columns", str(columns), "--json", str(out)])
        if status or not out.exists():
            why = next((s for s in reversed(said.getvalue().splitlines()) if s.strip()), "")
            return Flight(path.name, why.strip() or f"ended with status {status}")
        document = json.loads(out.read_text(encoding="utf-8"))
    axes = [document["mismatch"][a] for a in ("x", "y") if a in (document["mismatch"] or {})]
    if len(axes) < 2 or any(a[k] is None for a in axes for k in ("before", "after")):
        return Flight(path.name, "no lateral force to compare")
    before, after = (math.sqrt(sum(a[k] ** 2 for a in axes) / 2.0) for k in ("before", "after"))
    return Flight(path.name, lateral=(before, after), document=document)


def flights(paths: list[Path], columns: Path) -> Iterator[Flight]:
    """What is said of each table; of one that another is a copy of, that it is."""
    seen: dict[str, str] = {}
    for path in paths:
        its = hashlib.sha256(path.read_bytes()).hexdigest()
        if its in seen:
            yield Flight(path.name, f"the same as {seen[its]}")
            continue
        seen[its] = path.name
        yield asked(path, columns)


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, help="of tables")
    parser.add_argument("--pattern", default="*.csv", help="of their names")
    parser.add_argument("--columns", type=Path, help="column map; NanoBench's without")
    chosen = parser.parse_args(arguments)
    paths = sorted(chosen.folder.glob(chosen.pattern))
    if not paths:
        parser.error(f"no table {chosen.pattern} in {chosen.folder}")
    with tempfile.TemporaryDirectory() as folder:
        columns = chosen.columns or Path(folder) / "columns.toml"
        if chosen.columns is None:
            columns.write_text(MAP, encoding="utf-8")
        every = []
        for flight in flights(paths, columns):
            print(flight.line(), flush=True)
            every.append(flight)
    told = [f for f in every if f.document is not None]
    print(f"{len(paths)} tables, {len(told)} matched")
    if told:
        before, after = (statistics.median(f.lateral[k] for f in told) for k in (0, 1))
        worst = max(f.lateral[1] for f in told)
        print(
            f"lateral force on flight not used: median {before:.3f} -> {after:.3f} m/s^2, "
            f"worst {worst:.3f}"
        )


if __name__ == "__main__":
    main()
