"""Writes small DataFlash logs for the tests, with any layout."""

from __future__ import annotations

import struct

STRUCT = {
    "b": "b", "B": "B", "h": "h", "H": "H", "i": "i", "I": "I", "f": "f", "d": "d", "n": "4s",
    "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B", "q": "q",
    "Q": "Q", "a": "64s",
}  # fmt: skip
SCALE = dict.fromkeys("cCeE", 100) | {"L": 10_000_000}


class DataflashWriter:
    """Collects records; ``bytes(writer)`` is the log."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.kinds: dict[str, tuple[int, str]] = {}
        self.format(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")

    def __bytes__(self) -> bytes:
        return bytes(self.data)

    def format(self, kind: int, name: str, letters: str, columns: str, length: int = 0) -> None:
        length = length or 3 + struct.calcsize("<" + "".join(STRUCT.get(x, "B") for x in letters))
        self.data += struct.pack(
            "<BBBBB4s16s64s",
            0xA3, 0x95, 128, kind, length, name.encode(), letters.encode(), columns.encode(),
        )  # fmt: skip
        self.kinds[name] = (kind, letters)

    def add(self, name: str, *values: object) -> None:
        kind, letters = self.kinds[name]
        packed = [
            v.encode() if isinstance(v, str) else round(v * SCALE[x]) if x in SCALE else v
            for x, v in zip(letters, values, strict=True)
        ]
        body = struct.pack("<" + "".join(STRUCT[x] for x in letters), *packed)
        self.data += struct.pack("<BBB", 0xA3, 0x95, kind) + body


def modern_log(seconds: int = 4) -> DataflashWriter:
    """A copter of today: two IMUs at 25 Hz, ATT 10 Hz, GPS and GPA 5 Hz, parameters, events."""
    log = DataflashWriter()
    log.format(10, "IMU", "QBffffffIIfBBHH",
               "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz")  # fmt: skip
    log.format(11, "ATT", "QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF")
    log.format(12, "GPS", "QBBIHBcLLeffffB",
               "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U")  # fmt: skip
    log.format(13, "GPA", "QBCCCCfBIHeHH",
               "TimeUS,I,VDop,HAcc,VAcc,SAcc,YAcc,VV,SMS,Delta,AEl,RTCMFU,RTCMFD")  # fmt: skip
    log.format(14, "PARM", "QNff", "TimeUS,Name,Value,Default")
    log.format(15, "EV", "QB", "TimeUS,Id")
    log.format(16, "ODD", "QB", "TimeUS,Id")
    t0 = 5_000_000
    for k, name in enumerate(("INS_ACCOFFS_X", "INS_ACCSCAL_X", "AHRS_TRIM_X")):
        log.add("PARM", t0, name, 0.1 * k + 0.05, 0.0)
    log.add("EV", t0, 10)
    for k in range(25 * seconds):
        t = t0 + 40_000 * k
        for i in range(2):
            f_b = (0.1 + k * 1e-3, -0.2, -9.8 + i)
            log.add("IMU", t, i, 0.01, -0.02, 0.03, *f_b, 0, 0, 31.5, 1, 1, 1000, 1000)
        if k % 2 == 0:
            log.add("ATT", t + 50, 0.0, 1.5, 0.0, -2.5, 0.0, 350.0, 3)
            log.add("ODD", t + 60, 1)
        if k % 5 == 0:
            log.add("GPS", t + 100, 0, 3, 200 * k // 5 + 1000, 2300, 12, 0.71, -35.3632621,
                    149.1652371, 584.05, 10.0, 90.0, -1.25, 0.0, 1)  # fmt: skip
            log.add("GPA", t + 100, 0, 1.1, 0.5, 0.7, 0.25, 0.0, 1, t // 1000, 200, 0.0, 0, 0)
    return log


def old_log(seconds: int = 4) -> DataflashWriter:
    """ArduCopter 3.1: IMU and IMU2 with TimeMS, GPS with week time and boot time T, EV untimed."""
    log = DataflashWriter()
    log.format(10, "STRT", "", "")
    log.format(129, "PARM", "Nf", "Name,Value")
    log.format(130, "GPS", "BIHBcLLeeEefI",
               "Status,TimeMS,Week,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs,VZ,T")  # fmt: skip
    log.format(131, "IMU", "Iffffff", "TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    log.format(135, "IMU2", "Iffffff", "TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    log.format(5, "CURR", "IhIhhhf", "TimeMS,ThrOut,ThrInt,Volt,Curr,Vcc,CurrTot")
    log.format(4, "CTUN", "Ihhhffecchh",
               "TimeMS,ThrIn,AngBst,ThrOut,DAlt,Alt,BarAlt,DSAlt,SAlt,DCRt,CRt")  # fmt: skip
    log.format(13, "EV", "B", "Id")
    log.format(1, "ATT", "IccccCC", "TimeMS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw")
    log.add("PARM", "INS_ACCOFFS_X", 0.25)
    log.add("EV", 10)
    for k in range(25 * seconds):
        t = 300_000 + 40 * k
        log.add("IMU", t, 0.0, 0.0, 0.0, 0.5, 0.0, -9.7)
        log.add("IMU2", t, 0.0, 0.0, 0.0, 0.6, 0.0, -9.6)
        if k % 5 == 0:
            log.add("ATT", t + 1, 0.0, 3.25, 0.0, -1.5, 0.0, 181.5)
            log.add("GPS", 3, 400_000_000 + 40 * k, 1800, 9, 1.2, 30.1557346, -97.9575471,
                    1.0, 297.88, 5.0, 180.0, 0.5, t + 3)  # fmt: skip
            log.add("CTUN", t, 400, 0, 550, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0)
            log.add("CURR", t, 550, 0, 1640, 1050, 5000, 0.0)
    log.add("EV", 11)
    return log
