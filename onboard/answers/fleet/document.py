"""``onboard.fleet/1``: recordings, vehicles over time, and what types share, for other programs.

Numbers are SI; times are seconds since 1970, UTC, or days; every number is finite or ``null``.
Fields may be added within the version.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from onboard.answers.document_numbers import Number, Numbers, finite, numbers
from onboard.answers.fleet.history import Accelerometer, History
from onboard.answers.fleet.history import Number as Followed
from onboard.answers.fleet.record import Flown
from onboard.answers.fleet.severity import severity_of
from onboard.answers.fleet.shared_numbers import Common, Comparison
from onboard.answers.fleet.vehicles import Flight
from onboard.answers.json_file import indented
from onboard.answers.replay_document import ReplayDocument
from onboard.core.fleet.course import Sized
from onboard.core.fleet.limits import FALSE_ALARM, SHARED_FALSE_ALARM

SCHEMA = "onboard.fleet/1"


class RecordingEntry(msgspec.Struct, frozen=True, kw_only=True):
    """One recording: ``replay`` as ``onboard replay --json`` writes it, or ``error``.

    ``vehicle`` is one of ``vehicles``; ``began_unix_s`` when it was flown; ``alone`` says why it is
    not put together with others of its vehicle, ``null`` where it is.
    """

    file: str
    error: str | None
    vehicle: str | None
    sha256: str | None
    began_unix_s: float | None
    alone: str | None
    replay: ReplayDocument | None


class SizedDocument(msgspec.Struct, frozen=True):
    """A size with its sigma, and the probability that chance does it."""

    value: float | None
    sigma: float | None
    p_value: float | None

    @classmethod
    def of(cls, sized: Sized) -> SizedDocument:
        """The same as finite numbers."""
        return cls(finite(sized.size), finite(sized.sigma), finite(sized.p_value))


class StepDocument(msgspec.Struct, frozen=True, kw_only=True):
    """A jump between two flights; it may be anywhere between ``first`` and ``last`` too."""

    after: str
    before: str
    first: str
    last: str
    step: SizedDocument


class OddDocument(msgspec.Struct, frozen=True, kw_only=True):
    """A flight that contradicts the others, and how far it is from them."""

    file: str
    apart: SizedDocument


class ValueDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One flight's value without any prior; ``part`` counts up at each step."""

    file: str
    began_unix_s: float | None
    value: float | None
    sigma: float | None
    temperature: float | None
    part: int


class NumberDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One number over time.

    ``drift_per_day`` beside everything else that was found, whether it is chance or not;
    ``drifts``: it is not.  ``per_kelvin`` where the temperatures of the flights differ.
    ``factor`` on the claimed sigmas; ``latest`` at the last flight, at the mean temperature, with
    what is wrong with all flights alike in its sigma.
    """

    name: str
    unit: str
    flights: list[ValueDocument]
    drift_per_day: SizedDocument | None
    drifts: bool
    steps: list[StepDocument]
    odd: list[OddDocument]
    per_kelvin: SizedDocument | None
    factor: float | None
    chi_square: float | None
    dof: int
    latest: Number


class MergedDocument(msgspec.Struct, frozen=True, kw_only=True):
    """The six of the flights that count, since the last step; ``inflation`` on their variance.

    ``note``: which effects all of them leave open, where most of a sigma is of one.
    """

    scale: Numbers
    offset: Numbers
    scale_sigma: Numbers
    offset_sigma: Numbers
    counted: list[str]
    contradicted: list[str]
    inflation: float | None
    note: str = ""


class LeftOutDocument(msgspec.Struct, frozen=True, kw_only=True):
    """A flight that says nothing of an accelerometer to others, and why."""

    file: str
    why: str


class AccelerometerDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One accelerometer of a vehicle; ``why`` there is nothing merged."""

    imu: int
    device_id: int | None
    merged: MergedDocument | None
    why: str | None
    left_out: list[LeftOutDocument]
    numbers: list[NumberDocument]


class VehicleDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One vehicle; ``identified_by`` is ``board``, ``folder`` or ``recording``."""

    vehicle: str
    identified_by: str
    type: str
    board: str | None
    system: int | None
    severity: str
    recordings: list[str]
    accelerometers: list[AccelerometerDocument]
    numbers: list[NumberDocument]
    looked_at: int
    false_alarm: float = FALSE_ALARM


class MemberDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One vehicle's mean."""

    vehicle: str
    value: float | None
    sigma: float | None


class SharedDocument(msgspec.Struct, frozen=True, kw_only=True):
    """What vehicles of a type share; ``next_sigma`` is of another vehicle about the mean."""

    name: str
    unit: str
    of: str
    value: float | None
    sigma: float | None
    between: float | None
    next_sigma: float | None
    p_value: float | None
    scatter_p_value: float | None
    vehicles: list[MemberDocument]


class FleetDocument(msgspec.Struct, frozen=True, kw_only=True):
    """``onboard fleet --json``."""

    recordings: list[RecordingEntry]
    read: int
    failed: int
    vehicles: list[VehicleDocument]
    shared: list[SharedDocument]
    shared_looked_at: int
    shared_false_alarm: float = SHARED_FALSE_ALARM
    schema: str = SCHEMA

    def to_json(self) -> bytes:
        """Indented JSON, ``schema`` first, with a final newline."""
        fields = msgspec.to_builtins(self)
        ordered = {"schema": fields.pop("schema"), **fields}
        return indented(ordered)


def fleet_document(
    flown: Sequence[Flown], histories: Sequence[History], compared: Comparison
) -> FleetDocument:
    """The document of a fleet.

    Args:
        flown: every recording, in order, with all that is said of it.
        histories: of its vehicles.
        compared: what types share.
    """
    of_vehicle = {
        str(f.flown.path): (h.vehicle.name, f) for h in histories for f in h.vehicle.flights
    }
    entries = [_entry(one, *of_vehicle.get(str(one.path), (None, None))) for one in flown]
    failed = sum(entry.error is not None for entry in entries)
    return FleetDocument(
        recordings=entries,
        read=len(entries) - failed,
        failed=failed,
        vehicles=[_vehicle(h) for h in histories],
        shared=[_shared(c) for c in compared.common],
        shared_looked_at=compared.looked_at,
    )


def _entry(one: Flown, vehicle: str | None, flight: Flight | None) -> RecordingEntry:
    record = one.record
    return RecordingEntry(
        file=str(one.path),
        error=one.error or None,
        vehicle=vehicle,
        sha256=None if record is None else record.sha256,
        began_unix_s=None if record is None else record.provenance.began_unix_s,
        alone=None if flight is None else flight.why or None,
        replay=None if record is None else record.document,
    )


def _file(flight: Flight) -> str:
    return str(flight.flown.path)


def _vehicle(h: History) -> VehicleDocument:
    p = h.vehicle.latest.provenance
    return VehicleDocument(
        vehicle=h.vehicle.name,
        identified_by=h.vehicle.identified_by,
        type=h.vehicle.type,
        board=p.board or None,
        system=p.system,
        severity=severity_of(h).value,
        recordings=[_file(f) for f in h.vehicle.flights],
        accelerometers=[_accelerometer(a) for a in h.accelerometers],
        numbers=[_number(n) for n in h.numbers],
        looked_at=h.looked_at,
    )


def _accelerometer(a: Accelerometer) -> AccelerometerDocument:
    merged = None
    if (m := a.merged) is not None:
        merged = MergedDocument(
            scale=numbers(m.value[:3].tolist()),
            offset=numbers(m.value[3:].tolist()),
            scale_sigma=numbers(m.sigma[:3].tolist()),
            offset_sigma=numbers(m.sigma[3:].tolist()),
            counted=[_file(a.flights[i]) for i in m.counted],
            contradicted=[_file(a.flights[i]) for i in m.contradicted],
            inflation=finite(m.inflation),
            note=m.open,
        )
    return AccelerometerDocument(
        imu=a.imu,
        device_id=a.device or None,
        merged=merged,
        why=a.why or None,
        left_out=[LeftOutDocument(file=_file(f), why=why) for f, why in a.left_out],
        numbers=[_number(n) for n in a.numbers],
    )


def _number(n: Followed) -> NumberDocument:
    c, s = n.course, n.series
    files = [_file(f) for f in n.flights]
    warm = s.temperature
    return NumberDocument(
        name=n.name,
        unit=n.unit,
        flights=[
            ValueDocument(
                file=files[k],
                began_unix_s=f.record.provenance.began_unix_s,
                value=finite(float(s.value[k])),
                sigma=finite(float(s.sigma[k])),
                temperature=None if warm is None else finite(float(warm[k])),
                part=c.parts[k],
            )
            for k, f in enumerate(n.flights)
        ],
        drift_per_day=None if c.trend is None else SizedDocument.of(c.trend),
        drifts=c.drifts,
        steps=[
            StepDocument(
                after=files[x.after],
                before=files[x.after + 1],
                first=files[x.first],
                last=files[x.last + 1],
                step=SizedDocument.of(x.sized),
            )
            for x in c.steps
        ],
        odd=[OddDocument(file=files[x.flight], apart=SizedDocument.of(x.sized)) for x in c.odd],
        per_kelvin=None if c.warmth is None else SizedDocument.of(c.warmth),
        factor=finite(c.factor),
        chi_square=finite(c.chi_square),
        dof=c.dof,
        latest=Number(*map(finite, n.latest)),
    )


def _shared(c: Common) -> SharedDocument:
    s = c.shared
    return SharedDocument(
        name=c.name,
        unit=c.unit,
        of=c.of,
        value=finite(s.mean),
        sigma=finite(s.sigma),
        between=finite(s.between),
        next_sigma=finite(s.next_sigma),
        p_value=finite(s.p_value),
        scatter_p_value=finite(s.scatter_p_value),
        vehicles=[
            MemberDocument(vehicle=m.vehicle, value=finite(m.value), sigma=finite(m.sigma))
            for m in c.members
        ],
    )
