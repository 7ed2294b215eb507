"""The engines of all accelerometers, and what was learned of each before."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from typing import Final

from onboard.core.estimate.calibration_record import known_well_enough
from onboard.core.estimate.earlier import EarlierSums
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.saving import SavedEngine
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.estimate.told_antenna import batch_from
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import ParameterValue
from onboard.core.inputs.segments import Batch
from onboard.core.maths.accelerometer import parameter_names

WHICH_SENSOR: Final = {parameter_names(imu).device_id: imu for imu in range(1, 6)}
NO_SENSOR: Final = 0.0
"""INS_ACCn_ID where there is none, or none was found at this boot: no other sensor's name."""


class Engines:
    """One engine an accelerometer, made when the first flight of it comes in.

    Attributes:
        flight: what engines that begin now call the flight that they learn.
        earlier: sums of before the last start, until a flight agrees with them.
        beside: flight of accelerometers that are not estimated, as long as the buffer.
    """

    def __init__(
        self,
        settings: CalibratorSettings,
        parameters: ParametersInForce,
        only: Collection[int],
        flight: str,
    ) -> None:
        """Take settings, parameters in force, accelerometers (none: all), the flight's name."""
        self.flight = flight
        self._settings = settings
        self._parameters = parameters
        self._only = frozenset(only)
        self._engines: dict[int, Engine] = {}
        self._named: dict[int, float] = {}
        self.earlier = EarlierSums()
        self.beside: dict[int, list[Batch]] = {}

    def __iter__(self) -> Iterator[int]:
        """Accelerometers that are estimated, in order."""
        return iter(sorted(self._engines))

    def __getitem__(self, imu: int) -> Engine:
        return self._engines[imu]

    @property
    def known(self) -> set[int]:
        """Accelerometers of which anything was learned, now or before."""
        return {*self._engines, *self.earlier}

    def add(self, batches: Mapping[int, list[Batch]]) -> float | None:
        """Process batches of flight by accelerometer; time of the last fix in them, s.

        A refinement that is due waits while the force is known well enough without it: it would
        say the same with smaller sigmas, and goes several times over all that was flown.
        """
        newest: float | None = None
        for imu, made in batches.items():
            if self._only and imu not in self._only:
                self._lay_beside(imu, made)
                continue
            for batch in made:
                if imu not in self._engines:
                    prior = self._parameters.six(imu).as_linear()
                    self._engines[imu] = Engine(self._settings, prior)
                    self.earlier.begins(imu, self.flight)
                engine = self._engines[imu]
                engine.add(batch)
                if engine.due and not known_well_enough(imu, engine, self._parameters):
                    engine.refine()
                end = float(batch.fixes.t[-1])
                newest = end if newest is None else max(newest, end)
        return newest

    def tell_antenna(self) -> None:
        """The autopilot was told of the antenna's or an accelerometer's place: count from there."""
        for imu, engine in self._engines.items():
            engine.tell_antenna(self._parameters.lever_arm(imu))
        for imu, kept in self.beside.items():
            lever = self._parameters.lever_arm(imu)
            kept[:] = [batch_from(batch, lever) for batch in kept]

    def _lay_beside(self, imu: int, made: list[Batch]) -> None:
        """Keep flight of one that is not estimated: it still tells of those that are."""
        kept = self.beside.setdefault(imu, [])
        kept.extend(made)
        held = sum(batch.duration for batch in kept)
        while held > self._settings.buffer_s and len(kept) > 1:
            held -= kept.pop(0).duration

    def refine(self) -> Counter[str]:
        """A flight is over: refine, and add sums of before that it agrees with; what was done."""
        done: Counter[str] = Counter()
        for imu, engine in self._engines.items():
            engine.finish()
            done += self.earlier.judge(imu, engine, self._parameters.device_id(imu))
        return done

    def begin_flight(self, flight: str) -> None:
        """Begin anew with every accelerometer; what is learned from here on has this name."""
        self.flight = flight
        for imu in tuple(self._engines):
            self.forget(imu)

    def replaced_by(self, parameter: ParameterValue) -> int | None:
        """Forget the accelerometer in whose place this tells of another one; which it was."""
        imu = WHICH_SENSOR.get(parameter.name)
        if imu is None or parameter.value == NO_SENSOR:
            return None
        before, self._named[imu] = self._named.get(imu), parameter.value
        if before in (None, parameter.value):
            return None
        return imu if self.forget(imu) else None

    def forget(self, imu: int) -> bool:
        """Forget the engine of one accelerometer; False if there was none."""
        self.earlier.ends(imu)
        return self._engines.pop(imu, None) is not None

    @property
    def sums(self) -> list[SavedEngine]:
        """Those of every accelerometer, to go on with after a restart."""
        return self.earlier.with_these(self._engines, self._parameters)
