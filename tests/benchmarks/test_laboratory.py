"""Which tables of a laboratory's folder are asked about, and what is told of the others."""

from __future__ import annotations

from benchmarks import laboratory
from benchmarks.laboratory import Flight, flights


def test_a_flight_is_counted_once_and_what_cannot_be_used_is_told(tmp_path, monkeypatch):
    for name, text in (("a.csv", "one"), ("b.csv", "two"), ("c.csv", "one")):
        (tmp_path / name).write_text(text, encoding="utf-8")
    asked = []

    def ask(path, columns):
        asked.append(path.name)
        return Flight(path.name, lateral=(0.2, 0.05), document={"effects": [], "verdict": "clean"})

    monkeypatch.setattr(laboratory, "asked", ask)
    told = list(flights(sorted(tmp_path.glob("*.csv")), tmp_path / "columns.toml"))
    assert asked == ["a.csv", "b.csv"]
    assert told[2].document is None
    assert "a.csv" in told[2].line()
    assert "0.200 -> 0.050" in told[0].line()


def test_a_table_that_is_none_is_told_with_its_reason(tmp_path):
    columns, table = tmp_path / "columns.toml", tmp_path / "flight.csv"
    columns.write_text(laboratory.MAP, encoding="utf-8")
    table.write_text("t,px\n0.0,1.0\n", encoding="utf-8")
    flight = laboratory.asked(table, columns)
    assert flight.document is None
    assert "flight.csv" in flight.why
