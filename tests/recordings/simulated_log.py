"""A simulated flight as the DataFlash log of it: the same samples, stamped as a log stamps them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample, ParameterValue, Sample
from tests.recordings.dataflash_writer import DataflashWriter


def logged(samples: Iterable[Sample], late: Callable[[float], float]) -> DataflashWriter:
    """IMU, ATT, GPS, GPA, PARM; fixes are written ``late(t)`` (s) after the EKF's time of them."""
    log = DataflashWriter()
    log.format(10, "IMU", "QBfffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T")
    log.format(11, "ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw")
    log.format(12, "GPS", "QBBIHBcLLeff", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs")
    log.format(13, "GPA", "QBCBI", "TimeUS,I,SAcc,VV,SMS")
    log.format(14, "PARM", "QNf", "TimeUS,Name,Value")
    fixes = 0
    for s in samples:
        if isinstance(s, ParameterValue):
            log.add("PARM", 0, s.name, s.value)
        elif isinstance(s, ImuSample):
            f_b = [f + math.copysign(0.5 * s.f_step, f) for f in s.f_b]
            w_b = [w + math.copysign(0.5 * s.w_step, w) for w in s.w_b or (0.0, 0.0, 0.0)]
            log.add("IMU", round(s.t * 1e6), s.imu - 1, *w_b, *f_b, s.temperature or 0.0)
        elif isinstance(s, AttitudeSample):
            angles = [math.degrees(x) for x in (s.roll, s.pitch, s.yaw)]
            log.add("ATT", round(s.t * 1e6), *angles)
        elif isinstance(s, GpsFix):
            written, fixes = round((s.t + late(s.t)) * 1e6), fixes + 1
            speed, course = math.hypot(s.v_n, s.v_e), math.degrees(math.atan2(s.v_e, s.v_n))
            place = (math.degrees(s.latitude), math.degrees(s.longitude), s.altitude)
            quality = (s.satellites or 12, s.hdop or 0.7)
            log.add("GPS", written, 0, s.fix_type, 200 * fixes, 2300, *quality, *place,
                    speed, course % 360.0)  # fmt: skip
            log.add("GPA", written, 0, s.speed_accuracy or 0.3, 0, round(s.t * 1e3))
    return log
