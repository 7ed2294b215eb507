"""A simulation's recording against a real one: what one of them cannot say is no difference."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from onboard.answers.match import _apart, _not_testable, _refuse_incomparable
from onboard.core.diagnosis.records import NotTestable
from onboard.core.vehicle.effects.voltage_sag import HELD
from onboard.core.vehicle.records import Compared, Difference, VehicleMatch
from onboard.errors import RecordingError

WEAK = Difference("thrust_scale", "vehicle", {"ratio": Compared(1.0, 0.8, 0.01, "1")})
SAG = Difference("voltage_sag", "vehicle", {"exponent": Compared(0.0, 2.0, 0.02, "1")})


def told(*effects, absent=None, vehicle="copter", series=True):
    numbers = {f"{d.name}.{k}": v for d in effects for k, v in d.values.items()}
    untested = tuple(NotTestable(n, why) for n, why in (absent or {}).items())
    return VehicleMatch(
        vehicle, effects, numbers=numbers, not_testable=untested, series=() if series else None
    )


def test_thrust_of_a_recording_without_outputs_is_not_the_nominal_one():
    blind = told(absent={"thrust_scale": "no motor outputs in the recording"})
    assert _apart(told(WEAK), blind) == ()
    assert _apart(blind, told(WEAK)) == ()
    assert [n.name for n in _not_testable(told(WEAK), blind)] == ["thrust_scale"]
    assert [d.name for d in _apart(told(WEAK), told())] == ["thrust_scale"]


def test_a_battery_that_holds_is_the_nominal_one():
    held = told(absent={"voltage_sag": f"{HELD}; fly from a full battery"})
    assert [d.name for d in _apart(told(SAG), held)] == ["voltage_sag"]
    blind = told(absent={"voltage_sag": "no battery voltage in the recording"})
    assert _apart(told(SAG), blind) == ()


@pytest.mark.parametrize(
    ("simulated", "said"),
    [(told(vehicle="plane"), "a plane, not of a copter"), (told(series=False), "sim.BIN")],
)
def test_there_must_be_something_to_compare_with(simulated, said):
    other = SimpleNamespace(name="sim.BIN")
    with pytest.raises(RecordingError, match=said):
        _refuse_incomparable(other, simulated, told())
    _refuse_incomparable(other, told(), told())
