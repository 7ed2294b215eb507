"""What is kept of one recording: everything that is said of it, and what others need of it.

It does not depend on where the file is or what it is called, so that it can be kept under the hash
of its content.  Numbers go through MessagePack unchanged, to the last digit.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from onboard.answers.answer import Answer
from onboard.answers.flight_share import share_of
from onboard.answers.recorded import Recorded
from onboard.answers.replay import Replay
from onboard.answers.replay_document import ReplayDocument
from onboard.core.diagnosis import together
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.merged_flights import FlightSix
from onboard.core.estimate.result import Calibration
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.model.nuisances import LeverArmError
from onboard.core.physics.catalogue import title_of
from onboard.recordings.provenance import Provenance

NOT_ASKED = "no stretch of flight with trusted GPS and inertial data"


class Said(msgspec.Struct, frozen=True):
    """:class:`~onboard.core.estimate.merged_flights.FlightSix` as plain numbers, row by row."""

    information: list[float]
    vector: list[float]
    floored: list[float]
    floored_vector: list[float]
    alike: list[float] = msgspec.field(default_factory=lambda: [0.0] * 6)

    @classmethod
    def of(cls, six: FlightSix) -> Said:
        """The same as lists."""
        parts = (six.information, six.vector, six.floored, six.floored_vector, six.alike)
        return cls(*(np.ravel(x).tolist() for x in parts))

    @property
    def six(self) -> FlightSix:
        """The same as arrays."""
        return FlightSix(
            np.array(self.information).reshape(6, 6),
            np.array(self.vector),
            np.array(self.floored).reshape(6, 6),
            np.array(self.floored_vector),
            np.array(self.alike),
        )


class Asked(msgspec.Struct, frozen=True, array_like=True):
    """:class:`onboard.core.diagnosis.together.Asked`, packed: most of what is kept of a flight.

    ``numbers`` are little-endian float64: information (its upper triangle), vector, prior, moves.
    """

    effect: str
    unknowns: int
    numbers: bytes

    @classmethod
    def of(cls, asked: together.Asked) -> Asked:
        """The same packed."""
        k = len(asked.vector)
        upper = asked.information[np.triu_indices(k)]
        parts = (upper, asked.vector, asked.prior, asked.moves.ravel())
        return cls(asked.effect, k, np.concatenate(parts).astype("<f8").tobytes())

    @property
    def asked(self) -> together.Asked:
        """The same as arrays."""
        k = self.unknowns
        half = k * (k + 1) // 2
        numbers = np.frombuffer(self.numbers, "<f8").astype(float)
        upper, vector, prior, moves = np.split(numbers, [half, half + k, half + 2 * k])
        information = np.zeros((k, k))
        information[np.triu_indices(k)] = upper
        information = information + np.triu(information, 1).T
        title = title_of(self.effect)
        return together.Asked(self.effect, title, information, vector, prior, moves.reshape(6, k))


class Antenna(msgspec.Struct, frozen=True):
    """Where the antenna is beside where the autopilot is told, body axes, m; without any prior."""

    value: list[float | None]
    sigma: list[float | None]


class ImuRecord(msgspec.Struct, frozen=True, kw_only=True):
    """One accelerometer in one recording.

    ``said`` is what it says to other flights, and ``asked`` of effects that are alike in all of
    them; ``why`` says in words why that is nothing.
    ``missing`` is the physics that spoils the calibration, in words; ``asks`` is whether it asks
    for other parameters than are in force, and the policy would set them.
    """

    calibration: Calibration
    verdict: str
    effects: list[str]
    said: Said | None
    why: str
    antenna: Antenna | None
    missing: str = ""
    asks: bool = False
    asked: list[Asked] = []


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """One recording: ``document`` is what ``onboard replay --json`` says of a file ``name``."""

    name: str
    sha256: str
    vehicle_kind: str
    provenance: Provenance
    imus: list[ImuRecord]
    document: ReplayDocument

    def named(self, path: Path) -> Record:
        """The same of a file with that path."""
        old, r = f"{self.name}: ", self.document.recording

        def anew(notes: list[str]) -> list[str]:
            return [
                f"{path.name}: {x.removeprefix(old)}" if x.startswith(old) else x for x in notes
            ]

        recording = msgspec.structs.replace(
            r, files=[str(path)], damage=anew(r.damage), notes=anew(r.notes)
        )
        document = msgspec.structs.replace(self.document, recording=recording)
        return msgspec.structs.replace(self, name=path.name, document=document)

    @property
    def lean(self) -> Record:
        """The same without what only a JSON document asks for: many are held at once."""
        document = msgspec.structs.replace(self.document, imus=[], accelerometers=msgspec.UNSET)
        return msgspec.structs.replace(self, document=document)

    @property
    def trusted_s(self) -> float:
        """The most flight with trusted GPS that an accelerometer has, s."""
        return max((i.calibration.trusted_s for i in self.imus), default=0.0)


@dataclass(frozen=True, slots=True)
class Flown:
    """One recording: its record, or why there is none.

    ``name`` is as people see it; ``notes`` are about the way it was read, not about the recording.
    """

    path: Path
    name: str
    record: Record | None
    error: str = ""
    notes: tuple[str, ...] = ()


def record_of(
    path: Path, result: Replay, recorded: Recorded, where_from: Provenance, sha256: str
) -> Record:
    """What is kept of a replay.

    Args:
        path: of the recording.
        result: its replay.
        recorded: that it was replayed with.
        where_from: what it says of its vehicle.
        sha256: of its content.
    """
    return Record(
        name=path.name,
        sha256=sha256,
        vehicle_kind=recorded.calibrator.kind,
        provenance=where_from,
        imus=[
            _imu(answer, recorded, asks=advice is not None and advice.settable)
            for answer, advice in zip(result.answers, result.advice, strict=True)
        ],
        document=result.document(),
    )


def _imu(answer: Answer, recorded: Recorded, *, asks: bool) -> ImuRecord:
    c = answer.calibration
    said, why = None, NOT_ASKED
    if answer.imu in recorded.imus:
        in_force = SixParameters(c.in_force_scale, c.in_force_offset)
        share = share_of(recorded, answer.imu, None, in_force)
        said, why = share.said, share.why
    engine = recorded.engine(answer.imu)
    return ImuRecord(
        calibration=c,
        verdict=answer.diagnosis.verdict.value,
        effects=[effect.name for effect in answer.diagnosis.effects],
        said=None if said is None else Said.of(said),
        why=why,
        antenna=None if engine is None else _antenna(engine),
        missing=answer.missing,
        asks=asks,
        asked=[] if said is None else [Asked.of(a) for a in recorded.effects(answer.imu)],
    )


def _antenna(engine: Engine) -> Antenna | None:
    """The antenna's place without its prior: ``1/s^2 = 1/sigma^2 - 1/sigma_0^2``, exactly."""
    solution, model, place = engine.solution(), engine.model, LeverArmError.name
    name = next((f.name for f in model.families if place in (f.name, f.instead_of)), None)
    if solution is None or name is None:
        return None
    which = model.slices[name]
    value, prior = solution.theta[which], model.prior_sigma[which]
    square = np.diag(solution.covariance)[which]
    own = 1.0 / square - 1.0 / prior**2
    # What says less than the prior says nothing: there the difference is rounding.
    known = own > 1.0 / prior**2
    weight = np.where(known, own, 1.0)
    alone = value / square / weight
    return Antenna(
        [float(x) if k else None for x, k in zip(alone, known, strict=True)],
        [float(x) if k else None for x, k in zip(weight**-0.5, known, strict=True)],
    )
