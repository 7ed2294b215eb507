"""Every stream's track in one place: where samples wait until a batch of flight is complete."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator

import numpy as np

from onboard.core.inputs.blocks import AttitudeColumns, Block, ImuColumns
from onboard.core.inputs.limits import SILENT_S, SLOW_KEPT_S
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import (
    AirData,
    AttitudeSample,
    ImuSample,
    ImuSource,
    Throttle,
    Vibration,
)
from onboard.core.inputs.tracks import FixTrack, ImuTrack, SlowTrack
from onboard.core.maths.arrays import Array


class _Passing:
    """A block that is being gone through: how much of it has come, and is in the tracks."""

    __slots__ = ("_block", "_taken", "beside", "parameters", "reached")

    def __init__(self, block: Block, parameters: ParametersInForce) -> None:
        self.parameters = parameters
        self.reached = 0
        self.beside = tuple(raw for raw, _ in block.coarse)
        self._block = block
        self._taken = [0] * (len(block.kept) + len(self.beside) + 1)

    def due(self) -> Iterator[tuple[ImuColumns | AttitudeColumns, slice]]:
        """Columns and rows of them that have come since the last time."""
        streams: tuple[ImuColumns | AttitudeColumns, ...]
        streams = (*self._block.kept, *self.beside, self._block.attitude)
        for k, columns in enumerate(streams):
            first, last = self._taken[k], int(np.searchsorted(columns.places, self.reached))
            if first < last:
                self._taken[k] = last
                yield columns, slice(first, last)


class Streams:
    """Tracks of all streams.

    Attributes:
        imus: inertial samples by accelerometer.
        recorded: the recorded attitude as reported: roll, pitch, yaw, rad.
        turned: whether its trim was taken off by turning the body.
        slow: signals that only a diagnosis looks at, by name.
        fixes: of the receiver that is watched.
        over_mavlink: whether inertial samples came by MAVLink, not from a log.
    """

    __slots__ = ("_R_bs", "_passing", "fixes", "imus", "over_mavlink", "recorded", "slow", "turned")

    def __init__(self) -> None:
        self.imus: dict[int, ImuTrack] = {}
        self.recorded = SlowTrack()
        self.slow: dict[str, SlowTrack] = {}
        self.fixes = FixTrack()
        self.over_mavlink = False
        self.turned = False
        self._R_bs: tuple[float, Array | None] = (0.0, None)
        self._passing: _Passing | None = None

    def imu(self, sample: ImuSample, parameters: ParametersInForce) -> None:
        """Take an inertial sample, raw by the parameters in force now."""
        track = self.imus.get(sample.imu)
        if track is None:
            track = self.imus[sample.imu] = ImuTrack()
        self.over_mavlink = sample.source is not ImuSource.LOG
        track.add(sample, parameters.six(sample.imu), self._turned(parameters))

    def continued_by(self, block: Block) -> bool:
        """Whether a plain block has nothing that would be refused for what is here."""
        times = block.attitude.t
        if len(times) and (self.turned or not times.item(0) > self.recorded.last):
            return False
        for columns in block.kept:
            track = self.imus.get(columns.imu)
            if track is not None and not track.continued_by(columns):
                return False
        for raw, fine in block.coarse:
            # What comes before the first of the finer ones here must follow one of before.
            first = int(np.searchsorted(raw.places, fine.places[0]))
            track = self.imus.get(raw.imu)
            if first and (track is None or not track.covers(raw.t.item(first - 1))):
                return False
        return True

    def begin(self, block: Block, parameters: ParametersInForce) -> None:
        """Begin to take the inertial samples and attitudes of a plain block that continues this."""
        self._passing = _Passing(block, parameters)

    def reach(self, place: int) -> None:
        """What stands before a place of the block has come: :meth:`settle` before it is used."""
        if self._passing is not None:
            self._passing.reached = place

    def settle(self) -> None:
        """Put what has come in the tracks, raw by the parameters in force since the last time."""
        if self._passing is None:
            return
        parameters = self._passing.parameters
        for columns, rows in self._passing.due():
            if isinstance(columns, AttitudeColumns):
                self.recorded.extend(columns.t[rows], columns.angles[rows])
                continue
            track = self.imus.get(columns.imu)
            if track is None:
                track = self.imus[columns.imu] = ImuTrack()
            if columns in self._passing.beside:
                track.lay_beside(columns, rows)
                continue
            self.over_mavlink = columns.source is not ImuSource.LOG
            R_bs = self._turned(parameters)
            track.extend(columns, rows, parameters.six(columns.imu), R_bs)

    def end(self) -> None:
        """All of the block has come."""
        self.reach(sys.maxsize)
        self.settle()
        self._passing = None

    def _turned(self, parameters: ParametersInForce) -> Array | None:
        """The board's orientation in force, the same matrix while it stays the same."""
        orientation = parameters.values.get("AHRS_ORIENTATION", 0.0)
        if orientation != self._R_bs[0]:
            self._R_bs = (orientation, parameters.R_bs)
        return self._R_bs[1]

    def attitude(self, sample: AttitudeSample) -> None:
        """Take a recorded attitude."""
        if sample.turned is not self.turned:
            # All that is kept has its trim taken off in one way.
            self.recorded, self.turned = SlowTrack(), sample.turned
        angles = (sample.roll, sample.pitch, sample.yaw)
        # All three exactly zero: an estimator that has not begun.
        if angles != (0.0, 0.0, 0.0):
            self.recorded.add(sample.t, angles)

    def signal(self, sample: Vibration | Throttle | AirData) -> None:
        """Take a signal that only a diagnosis looks at."""
        if isinstance(sample, Vibration):
            name = "vibration" if sample.imu is None else f"vibration_{sample.imu}"
            self._add(name, sample.t, sample.level)
            # One counter of the accelerometer that the record names, or one of each.
            for imu, count in enumerate(sample.clipping, sample.imu or 1):
                self._add(f"clipping_{imu}", sample.t, (float(count),))
        elif isinstance(sample, Throttle):
            self._add("throttle", sample.t, (sample.throttle,))
        elif sample.airspeed is not None:
            self._add("airspeed", sample.t, (sample.airspeed,))

    def _add(self, name: str, t: float, x: tuple[float, ...]) -> None:
        self.slow.setdefault(name, SlowTrack()).add(t, x)

    @property
    def live(self) -> dict[int, ImuTrack]:
        """Tracks of the accelerometers that still report."""
        newest = max((track.last for track in self.imus.values()), default=-np.inf)
        return {i: x for i, x in self.imus.items() if newest - x.last < SILENT_S}

    def felt(self, since: float) -> float:
        """The largest force that an accelerometer reported since then (s), m/s^2; 0: none did."""
        self.settle()
        return max((track.felt(since) for track in self.live.values()), default=0.0)

    def refused(self, imu: int) -> Counter[str]:
        """What was refused, by name."""
        out = Counter(self.fixes.refused)
        # A fix repeated by a faster stream is the normal case, not a loss.
        del out["gps_repeated"]
        if imu in self.imus:
            out.update(self.imus[imu].refused)
        return out

    def slow_arrays(self, imu: int) -> dict[str, tuple[Array, Array]]:
        """Times (j,) and values (j,) or (j, d) of slow signals, those of this accelerometer."""
        every = {name: s.arrays() for name, s in self.slow.items() if len(s) > 1}
        flat = {n: (a, x[:, 0] if x.shape[1] == 1 else x) for n, (a, x) in every.items()}
        own = {name: f"{name}_{imu}" for name in ("vibration", "clipping")}
        return flat | {name: flat[its] for name, its in own.items() if its in flat}

    def forget_imu(self, imu: int) -> None:
        """Forget what waits of one accelerometer, but not what was refused of it."""
        self.settle()
        if imu in self.imus:
            refused = self.imus[imu].refused
            self.imus[imu] = ImuTrack()
            self.imus[imu].refused = refused

    def clear(self) -> None:
        """Forget all that waits (reboot)."""
        for imu in self.imus:
            self.forget_imu(imu)
        self.recorded = SlowTrack()
        self.slow.clear()
        self.fixes.clear()

    def drop_before(self, t: float) -> None:
        """Forget what is older than ``t``, s; of slow signals what is older by a little more."""
        for track in self.imus.values():
            track.drop_before(t)
        for slow in (self.recorded, *self.slow.values()):
            slow.drop_before(t - SLOW_KEPT_S)
