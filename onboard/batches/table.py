"""Results as a Parquet file: a row for each accelerometer of each recording, SI units.

:data:`COLUMNS` is the contract: name, type, unit and meaning; the unit and the meaning are in the
file too, as metadata of the fields.  What is not known is null.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from onboard.answers.fleet.history import History
from onboard.answers.fleet.record import Flown, ImuRecord, Record
from onboard.answers.fleet.vehicles import Flight
from onboard.answers.knowledge import seen
from onboard.core.estimate.result import SIX_NAMES
from onboard.errors import UsageError
from onboard.printable import encodable
from onboard.report.files import beside

TEXT, NUMBER, INTEGER, FLAG, TEXTS = "text", "number", "integer", "flag", "texts"
ROWS_AT_ONCE = 10_000
"""Rows are large before they are packed [cost: 50 MB]."""
Value = str | float | int | bool | list[str] | None


@dataclass(frozen=True, slots=True)
class Column:
    """One column of the table."""

    name: str
    kind: str
    unit: str
    meaning: str


def _six() -> Iterator[Column]:
    for name in SIX_NAMES:
        axis, what = name.split(" ")
        unit, column = "1" if what == "scale" else "m/s^2", f"{what}_{axis}"
        yield Column(column, NUMBER, unit, f"{name}, ArduPilot's, absolute")
        yield Column(f"{column}_sigma", NUMBER, unit, f"standard deviation of the {name}")
        yield Column(f"{column}_in_force", NUMBER, unit, f"{name} in force in the recording")
        yield Column(f"{column}_known", TEXT, "", "yes, roughly, together or no")


COLUMNS: tuple[Column, ...] = (
    Column("file", TEXT, "", "path as it was given"),
    Column("sha256", TEXT, "", "of the content"),
    Column("error", TEXT, "", "why it could not be read; then nothing but file and error"),
    Column("vehicle", TEXT, "", "name in the fleet"),
    Column("identified_by", TEXT, "", "board, folder or recording"),
    Column("type", TEXT, "", "kind, board, frame"),
    Column("board", TEXT, "", "serial number in hex"),
    Column("system", INTEGER, "", "MAVLink system id"),
    Column("receiver", TEXT, "", "of GPS"),
    Column("autopilot", TEXT, "", "ardupilot, px4, ..."),
    Column("began_unix_s", NUMBER, "s", "first fix, since 1970, UTC"),
    Column("duration_s", NUMBER, "s", "of the recording"),
    Column("alone", TEXT, "", "why it is not put together with others of its vehicle"),
    Column("damage", TEXTS, "", "what was skipped of a damaged file"),
    Column("imu", INTEGER, "", "accelerometer, from 1"),
    Column("device_id", INTEGER, "", "INS_ACC*_ID"),
    Column("status", TEXT, "", "calibrated, insufficient, invalid, collecting"),
    Column("verdict", TEXT, "", "of the diagnosis"),
    Column("effects", TEXTS, "", "found beside the six"),
    Column("not_counted", TEXT, "", "why it says nothing to other flights"),
    *_six(),
    Column("trusted_s", NUMBER, "s", "of flight with trusted GPS"),
    Column("coverage_percent", NUMBER, "%", "of the weakest of the six"),
    Column("temperature", NUMBER, "degC", "of the accelerometer, mean"),
    Column("velocity_rms_before", NUMBER, "m/s", "10 s of free integration, parameters in force"),
    Column("velocity_rms_after", NUMBER, "m/s", "the same with the estimate"),
    Column("gps_delay_s", NUMBER, "s", "latency of the receiver"),
    Column("gps_delay_sigma_s", NUMBER, "s", "standard deviation of it"),
    Column("imu_delay_s", NUMBER, "s", "delay of the attitude"),
    Column("imu_delay_sigma_s", NUMBER, "s", "standard deviation of it"),
    *(
        Column(f"antenna_{a}_m{s}", NUMBER, "m", f"antenna {w} of where it is told{m}")
        for a, w in zip("xyz", ("forward", "right", "down"), strict=True)
        for s, m in (("", ""), ("_sigma", ", standard deviation"))
    ),
)


def write_parquet(flown: Sequence[Flown], histories: Sequence[History], file: Path) -> None:
    """Write the table.

    Args:
        flown: every recording, in order.
        histories: of the vehicles.
        file: where to.

    Raises:
        UsageError: pyarrow is not installed, or the file cannot be written.
    """
    arrow, parquet = imported()
    of_vehicle = {id(f.flown): (h, f) for h in histories for f in h.vehicle.flights}
    # Names and what is said of them may hold bytes that are no UTF-8, of which a file is.
    rows = (
        encodable(row)
        for one in flown
        for row in rows_of(one, *of_vehicle.get(id(one), (None, None)))
    )
    types = {
        TEXT: arrow.string(),
        NUMBER: arrow.float64(),
        INTEGER: arrow.int64(),
        FLAG: arrow.bool_(),
        TEXTS: arrow.list_(arrow.string()),
    }
    schema = arrow.schema(
        [
            arrow.field(c.name, types[c.kind], metadata={"unit": c.unit, "meaning": c.meaning})
            for c in COLUMNS
        ]
    )
    part = beside(file)
    try:
        with parquet.ParquetWriter(str(part), schema, compression="zstd") as writer:
            while some := list(itertools.islice(rows, ROWS_AT_ONCE)):
                writer.write_table(arrow.Table.from_pylist(some, schema=schema))
        part.replace(file)
    except OSError as error:
        raise UsageError(f"{file}: cannot be written ({error.strerror or error})") from None
    except arrow.ArrowException as error:
        raise UsageError(f"{file}: cannot be written ({error})") from None
    finally:
        with contextlib.suppress(OSError):  # it is there where something went wrong
            part.unlink()


def imported() -> tuple[Any, Any]:
    """``pyarrow`` and ``pyarrow.parquet``.

    Raises:
        UsageError: it is not installed.
    """
    try:
        import pyarrow as pa  # noqa: PLC0415 - an extra
        import pyarrow.parquet as pq  # noqa: PLC0415
    except ImportError:
        raise UsageError(
            "--parquet: needs pyarrow: pip install 'onboard-calibration[fleet]'"
        ) from None
    return pa, pq


def rows_of(
    one: Flown, history: History | None, flight: Flight | None
) -> Iterator[dict[str, Value]]:
    """The rows of one recording: one for each accelerometer, or one with the error."""
    record = one.record
    if record is None:
        yield {"file": str(one.path), "error": one.error}
        return
    shared = _of_recording(one, record, history, flight)
    for imu in record.imus:
        yield shared | _of_imu(record, imu)


def _of_recording(
    one: Flown, record: Record, history: History | None, flight: Flight | None
) -> dict[str, Value]:
    p, r = record.provenance, record.document.recording
    return {
        "file": str(one.path),
        "sha256": record.sha256,
        "vehicle": None if history is None else history.vehicle.name,
        "identified_by": None if history is None else history.vehicle.identified_by,
        "type": None if history is None else history.vehicle.type,
        "board": p.board or None,
        "system": p.system,
        "receiver": p.receiver or None,
        "autopilot": r.autopilot,
        "began_unix_s": p.began_unix_s,
        "duration_s": r.duration_s,
        "alone": None if flight is None else flight.why or None,
        "damage": [note.removeprefix(f"{record.name}: ") for note in r.damage],
    }


def _of_imu(record: Record, imu: ImuRecord) -> dict[str, Value]:
    c = imu.calibration
    row: dict[str, Value] = {
        "imu": c.imu,
        "device_id": record.provenance.accelerometers.get(c.imu),
        "status": c.status.value,
        "verdict": imu.verdict,
        "effects": list(imu.effects),
        "not_counted": imu.why or None,
        "trusted_s": _finite(c.trusted_s),
        "coverage_percent": _finite(c.coverage.percent),
        "temperature": None if c.temperature is None else _finite(c.temperature.value),
        "velocity_rms_before": _finite(c.velocity_rms_before),
        "velocity_rms_after": _finite(c.velocity_rms_after),
    }
    values = c.scale + c.offset
    sigmas = c.scale_sigma + c.offset_sigma
    held = c.in_force_scale + c.in_force_offset
    for name, value, sigma, before, known in zip(
        SIX_NAMES, values, sigmas, held, seen(c), strict=True
    ):
        axis, what = name.split(" ")
        column = f"{what}_{axis}"
        row |= {
            column: _finite(value),
            f"{column}_sigma": _finite(sigma),
            f"{column}_in_force": _finite(before),
            f"{column}_known": known,
        }
    for name in ("gps_delay", "imu_delay"):
        if (estimate := c.timing.get(f"{name}_s")) is not None:
            row[f"{name}_s"] = _finite(estimate.value)
            row[f"{name}_sigma_s"] = _finite(estimate.sigma)
    if imu.antenna is not None:
        for a, value_m, sigma_m in zip("xyz", imu.antenna.value, imu.antenna.sigma, strict=True):
            row[f"antenna_{a}_m"], row[f"antenna_{a}_m_sigma"] = value_m, sigma_m
    return row


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
