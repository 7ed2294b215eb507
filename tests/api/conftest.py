"""One short flight, and what each function says of it, worked out once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pytest

import onboard
from onboard import api
from sitl.builtin.airframe.air import Air
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, write_tlog

TRUTH = ImuTruth(scale=(1.021, 0.986, 1.013), offset=(0.21, -0.15, 0.3))
SPEC = FlightSpec(
    duration=90.0,
    seed=5,
    imus=(TRUTH,),
    rates={"RAW_IMU": 25.0, "ATTITUDE": 25.0, "SERVO_OUTPUT_RAW": 25.0, "GPS_RAW_INT": 5.0},
    aircraft=Aircraft(
        craft=Airframe().with_drag(mcoef=0.45), air=Air.from_settings(5.0, 120.0, 0.5)
    ),
)


@dataclass
class Asked:
    """A flight and the answers about it."""

    path: Path

    @cached_property
    def calibration(self) -> onboard.CalibrationResult:
        return api.calibrate(self.path)

    @cached_property
    def explanation(self) -> onboard.ExplanationResult:
        return api.explain(self.path)

    @cached_property
    def match(self) -> onboard.MatchResult:
        return api.match(self.path)

    @cached_property
    def arrays(self) -> onboard.Arrays:
        return onboard.Arrays.read(self.path)

    @cached_property
    def by_arrays(self) -> onboard.CalibrationResult:
        return api.calibrate(self.arrays)

    @cached_property
    def columns(self) -> dict[str, object]:
        """Columns as somebody would have them, without what the recording says beside them."""
        i, a, v = self.arrays.inertial[0], self.arrays.attitude, self.arrays.velocity[0]
        return {
            "inertial": onboard.Inertial(t=i.t, f_b=i.f_b, w_b=i.w_b),
            "attitude": onboard.Attitude(t=a.t, roll=a.roll, pitch=a.pitch, yaw=a.yaw),
            "velocity": onboard.Velocity(t=v.t, v_n=v.v_n, speed_accuracy=v.speed_accuracy),
            "parameters": self.arrays.told.parameters,
            "vehicle": "copter",
        }

    @cached_property
    def by_columns(self) -> onboard.CalibrationResult:
        return api.calibrate(onboard.Arrays(**self.columns))


@pytest.fixture(scope="session")
def asked(tmp_path_factory) -> Asked:
    path = tmp_path_factory.mktemp("api") / "flight.tlog"
    write_tlog(SPEC, path)
    return Asked(path)
