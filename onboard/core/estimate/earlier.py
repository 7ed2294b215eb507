"""What was learned before the last start, until a flight agrees with it or contradicts it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from onboard.core.estimate.agreement import agrees
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.limits import MOST_FLIGHTS, MOST_SAVED, MOST_WAITING
from onboard.core.estimate.saving import SavedEngine, load
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.maths.arrays import vector3
from onboard.core.maths.blocks import Seconds, merged


class EarlierSums:
    """Saved sums by accelerometer, waiting for a flight that agrees with them.

    Sums that have a flight in common with others are never added to them: neither can be taken
    out of the other.
    """

    def __init__(self) -> None:
        self._waiting: dict[int, list[SavedEngine]] = {}
        self._included: dict[int, tuple[str, ...]] = {}

    def __iter__(self) -> Iterator[int]:
        """Accelerometers that have some, in order."""
        return iter(sorted(self._waiting))

    def lay_aside(self, data: bytes) -> None:
        """Keep what :meth:`Calibrator.to_bytes` gave.

        Raises:
            StateError: damaged, or of another version.
        """
        for saved in load(data):
            self.wait_with(saved)

    def wait_with(self, saved: SavedEngine) -> None:
        """Keep the sums of one accelerometer, unless its flights are there already.

        Of those that share flights the ones with more flight stay.
        """
        flights = set(saved.flights)
        if flights & set(self._included.get(saved.imu, ())):
            return
        waiting = self._waiting.setdefault(saved.imu, [])
        sharing = [w for w in waiting if flights & set(w.flights)]
        most = max([*sharing, saved], key=lambda its: its.seconds.trusted)
        waiting[:] = [w for w in waiting if w not in sharing]
        waiting.append(most)
        del waiting[:-MOST_WAITING]

    def begins(self, imu: int, flight: str) -> None:
        """An engine begins to learn: it is of this flight, if it has a name."""
        self._included[imu] = (flight,) if flight else ()

    def ends(self, imu: int) -> None:
        """The engine is no more."""
        self._included.pop(imu, None)

    def forget(self, imu: int) -> None:
        """What was learned of one accelerometer is known to be wrong."""
        self._waiting.pop(imu, None)

    def judge(self, imu: int, engine: Engine, device_id: float | None) -> Counter[str]:
        """Add sums of before to an engine, drop them, or let them wait on.

        Args:
            imu: which accelerometer.
            engine: has flown since.
            device_id: the accelerometer's INS_ACCn_ID, if it was reported.

        Returns:
            What was done, by name.
        """
        done: Counter[str] = Counter()
        for saved in self._waiting.pop(imu, []):
            if None not in (device_id, saved.device_id) and device_id != saved.device_id:
                done["saved_of_another_sensor"] += 1
                continue
            # Sums of a sensor that said who it is wait until this one has said it, too.
            opinion = agrees(engine, saved) if device_id == saved.device_id else None
            if opinion is None:
                self._waiting.setdefault(imu, []).append(saved)
            elif opinion:
                done["restored"] += 1
                engine.restore(
                    engine.brought(saved.blocks, saved.point, np.array(saved.told)), saved.seconds
                )
                of_both = (*saved.flights, *self._included.get(imu, ()))
                self._included[imu] = of_both[-MOST_FLIGHTS:]
            else:
                done["saved_contradicted"] += 1
        return done

    def with_these(
        self, engines: Mapping[int, Engine], parameters: ParametersInForce
    ) -> list[SavedEngine]:
        """The engines' sums, and those that still wait: a flight that says too little loses none.

        Args:
            engines: by accelerometer.
            parameters: in force, for the identifiers of the sensors.
        """
        saved = []
        for imu, engine in sorted(engines.items()):
            blocks = merged(engine.all_blocks, MOST_SAVED)
            if blocks:
                saved.append(
                    SavedEngine(
                        imu,
                        parameters.device_id(imu),
                        tuple(float(x) for x in engine.model.prior[:6]),
                        engine.point,
                        (0.0, 0.0, 0.0) if engine.told is None else vector3(engine.told),
                        engine.noise,
                        Seconds(engine.trusted_s, engine.brisk_s),
                        tuple(blocks),
                        self._included.get(imu, ()),
                    )
                )
        saved.extend(e for waiting in self._waiting.values() for e in waiting)
        return saved
