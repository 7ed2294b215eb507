"""An airframe of another simulator: what its table says is what it flew."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from benchmarks import foreign, foreign_without
from benchmarks.foreign_plane import flown
from onboard.core.maths.frames import rotation_from_euler


def test_without_the_other_simulator_it_says_so(monkeypatch, capsys):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    foreign.main([])
    assert "jsbsim is not installed" in capsys.readouterr().out


def test_coefficients_are_told_in_the_air_of_the_flight():
    document = {
        "wind": {"north": 1.0, "east": 2.0, "sigma_north": 0.1, "sigma_east": 0.2},
        "effects": [{"name": "lift", "values": {"c_lift_a": {"real": 5.0, "sigma": 0.1}}}],
    }
    rows = list(foreign.compared(document, {"c_lift_a": 4.5}, (1.1, 2.2), 0.9 * 1.225))
    assert rows[:2] == [("wind north", 1.1, 1.0, 0.1), ("wind east", 2.2, 2.0, 0.2)]
    name, truth, found, sigma = rows[2]
    assert (name, truth) == ("c_lift_a", 4.5)
    assert found == pytest.approx(4.5)
    assert sigma == pytest.approx(0.09)


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Airframes like JSBSim's, of two functions and a propeller."""
    for folder in ("aircraft/c172p", "engine", "systems"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "aircraft/c172p/c172p.xml").write_text(
        '<a><axis><function name="aero/coefficient/CDbeta"/>'
        '<function name="aero/coefficient/CDo"/></axis></a>'
    )
    (tmp_path / "engine/prop_75in2f.xml").write_text(
        '<p><table name="C_THRUST"><tableData>0 0.07\n0.4 0.07\n1 0.03\n1.8 -0.06\n5 -0.06'
        "</tableData></table></p>"
    )
    monkeypatch.setattr(foreign_without, "installed", lambda: tmp_path)
    return tmp_path


def test_a_piece_that_is_taken_out_is_gone_and_the_rest_is_there(installed):
    with foreign_without.airframes(["slip"]) as folder:
        left = (folder / "aircraft/c172p/c172p.xml").read_text()
    assert "CDbeta" not in left
    assert "CDo" in left
    assert "CDbeta" in (installed / "aircraft/c172p/c172p.xml").read_text()


@pytest.mark.usefixtures("installed")
def test_a_piece_that_the_airframe_has_not_got_is_said():
    with pytest.raises(ValueError, match="CDDe"), foreign_without.airframes(["elevator"]):
        pass


@pytest.mark.usefixtures("installed")
def test_a_propeller_without_its_bend_is_a_straight_line_through_what_is_flown():
    with foreign_without.airframes(["bend"]) as folder:
        text = (folder / "engine/prop_75in2f.xml").read_text()
    first, last = text.split("<tableData>")[1].split("</tableData>")[0].split("\n")
    (a, at_rest), (b, fast) = (map(float, row.split()) for row in (first, last))
    assert (a, b) == (0.0, 5.0)
    assert (fast - at_rest) / 5.0 == pytest.approx(-0.13 / 1.4, rel=0.1)


def test_the_force_that_is_written_is_that_of_the_motion():
    pytest.importorskip("jsbsim")
    flight = flown((4.0, -3.0), 5, 30.0)
    t, angles, force = flight.rows[:, 0], flight.rows[:, 1:4], flight.rows[:, 4:7]
    R = rotation_from_euler(*angles.T)
    acceleration = np.einsum("nij,nj->ni", R, force) + np.array([0.0, 0.0, 9.80665])
    seen = np.isfinite(flight.rows[:, 10])
    gained = np.diff(flight.rows[seen, 10:13][[0, -1]], axis=0)[0]
    integral = np.trapezoid(acceleration, t, axis=0)
    # 30 s of an attitude that is 1 mrad noisy and of the earth's turning: a tenth of a m/s.
    assert np.abs(integral - gained).max() < 0.3
