"""The table: a row for each accelerometer, the columns that the manual has, SI units."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from onboard.answers.fleet.history import history_of
from onboard.answers.fleet.record import Flown
from onboard.answers.fleet.vehicles import vehicles_of
from onboard.batches import table
from onboard.batches.table import COLUMNS, imported, rows_of, write_parquet
from onboard.errors import UsageError
from tests.fleet.records_by_hand import TRUE, flown

MANUAL = (Path(__file__).resolve().parents[2] / "docs" / "fleet.md").read_text(encoding="utf-8")


def fleet():
    logs = [flown("a", seed=1), flown("b", day=2.0, seed=2), flown("c", began=False)]
    logs.append(Flown(Path("/logs/bad"), "bad", None, "not a recording"))
    return logs, [history_of(v) for v in vehicles_of(logs)]


def test_every_value_has_a_column():
    logs, histories = fleet()
    names = {c.name for c in COLUMNS}
    assert len(names) == len(COLUMNS)
    flights = {id(f.flown): f for h in histories for f in h.vehicle.flights}
    for one in logs:
        for row in rows_of(one, histories[0], flights.get(id(one))):
            assert set(row) <= names


def test_the_manual_has_every_column():
    for column in COLUMNS:
        base = column.name.replace("_sigma", "").replace("_in_force", "").replace("_known", "")
        assert f"`{column.name}`" in MANUAL or f"`{base}`" in MANUAL, column.name


def test_the_file_has_a_row_for_each_accelerometer_and_each_failure(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    logs, histories = fleet()
    write_parquet(logs, histories, tmp_path / "fleet.parquet")
    table = parquet.read_table(tmp_path / "fleet.parquet")
    rows = table.to_pylist()
    assert [r["file"] for r in rows] == ["/logs/a", "/logs/b", "/logs/c", "/logs/bad"]
    assert [r["error"] for r in rows] == [None, None, None, "not a recording"]
    assert rows[0]["scale_x"] == logs[0].record.imus[0].calibration.scale[0]
    assert rows[0]["offset_z"] == pytest.approx(TRUE[5], abs=0.15)
    assert "when it was flown" in rows[2]["alone"]
    field = table.schema.field("offset_z")
    assert field.metadata[b"unit"] == b"m/s^2"
    assert not list(tmp_path.glob(".*"))


def test_what_is_no_utf8_is_written_all_the_same(tmp_path):
    """Names of files are bytes, and the reason why one cannot be read begins with its name."""
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    name = os.fsdecode(b"/logs/fl\xffug.BIN")
    one = Flown(Path(name), name, None, f"{name}: not a recording")
    good = flown(name, seed=1)
    write_parquet([one, good], [history_of(v) for v in vehicles_of([good])], tmp_path / "x.parquet")
    rows = parquet.read_table(tmp_path / "x.parquet").to_pylist()
    assert rows[0]["file"] == "/logs/fl?ug.BIN"
    assert rows[0]["error"] == "/logs/fl?ug.BIN: not a recording"
    assert len(rows) > 1


@pytest.mark.parametrize("wrong", [b"bytes", object()])
def test_nothing_half_written_is_left(tmp_path, monkeypatch, wrong):
    """Whatever goes wrong, and what was there before stays."""
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    place = tmp_path / "fleet.parquet"
    place.write_bytes(b"before")
    logs, histories = fleet()
    broken = [{"imu": wrong}]
    monkeypatch.setattr(table, "rows_of", lambda *_: iter(broken))
    with pytest.raises(UsageError, match=r"fleet\.parquet: cannot be written"):
        write_parquet(logs, histories, place)
    assert [file.name for file in tmp_path.iterdir()] == [place.name]
    assert place.read_bytes() == b"before"


def test_without_pyarrow_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(UsageError, match=r"onboard-calibration\[fleet\]"):
        imported()
