"""A match without a flight: every part of the story, with numbers that are easy to recognise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from onboard.answers.match import Match, Setting
from onboard.core.diagnosis.records import Ambiguity, NotTestable, Verdict
from onboard.core.physics.finding import Where
from onboard.core.vehicle.records import (
    Alone,
    AxisMismatch,
    Compared,
    Curve,
    Difference,
    ForceSeries,
    VehicleMatch,
    WindEstimate,
)

WIND = Difference(
    "wind",
    "vehicle",
    {"north": Compared(0.0, -3.0, 0.02, "m/s"), "east": Compared(0.0, 4.0, 0.02, "m/s")},
    0.9,
    (Where(10.0, 22.0, "body_y", "turning", 0.4),),
    (),
    1.687,
    0.0811,
)
ROTORS = Difference(
    "rotor_drag",
    "vehicle",
    {"mcoef": Compared(0.248, 0.497, 0.003, "1/s")},
    0.1,
    (Where(30.0, 42.0, "body_x", "fast", 0.3),),
    ("body_drag",),
    0.283,
    0.0811,
)


def by_hand(name: str = "flight.BIN", **changes: Any) -> Match:
    """A copter's match; ``changes`` are fields of the vehicle level."""
    t = np.arange(0.0, 100.0, 0.1)
    error = np.column_stack([np.sin(t), np.cos(t)])
    measured = np.column_stack([t, -t]) * 0.01
    x = np.linspace(-8.0, 8.0, 20)
    blocks = np.arange(6.0, 96.0, 12.0)
    one = np.ones((len(blocks), 2))
    fields: dict[str, Any] = {
        "vehicle": "copter",
        "effects": (WIND, ROTORS),
        "wind": WindEstimate(
            *(-3.0, 4.0, 0.02, 0.02, 40.0, None, None),
            blocks,
            blocks,
            one * [-3.0, 4.0],
            0.05 * one,
            one * 0.7,
            one * [-3.0, 4.0],
        ),
        "mismatch": {"x": AxisMismatch(1.987, 0.0123), "y": AxisMismatch(1.754, 0.0456)},
        "alone_before": 7.89,
        "alone_after": 0.0321,
        "alone": Alone(t[1:101], 0.789 * t[1:101], 0.00321 * t[1:101]),
        "ambiguous": (Ambiguity(("rotor_drag", "body_drag"), "fly straight legs at full speed"),),
        "not_testable": (
            NotTestable("ground_effect", "not flown near the ground; hover at half a metre"),
        ),
        "curves": (
            Curve("drag_x", "speed", "m/s", "force", "m/s^2", x, -0.5 * x, 0.1 + 0 * x,
                  -0.5 * x, -0.25 * x, np.column_stack([x, -0.5 * x])),
            Curve("thrust", "command", "1", "specific thrust", "m/s^2", x + 8, x + 8, 0 * x,
                  x + 8, x + 7),
        ),
        "series": ForceSeries(
            t, ("x", "y"), measured, measured - error, measured - 0.01 * error, 5.0 + 0.0 * t
        ),
        "seconds": 100.0,
    }  # fmt: skip
    vehicle = VehicleMatch(**(fields | changes))
    real: Any = SimpleNamespace(name=name, autopilot="ardupilot", source=SimpleNamespace(damage=[]))
    settings = (Setting("SIM_WIND_SPD", 5.0, 0.02, "wind"),) if vehicle.effects else ()
    verdict = Verdict.EXPLAINED if vehicle.effects else Verdict.CLEAN
    return Match(
        real, None, verdict, vehicle.effects, vehicle, None, settings, vehicle.not_testable
    )
