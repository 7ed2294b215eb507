"""``onboard.match/1``: the answer of a match as other programs read it.

Every number is finite; what is not known is ``null``.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from onboard.answers.document_numbers import finite
from onboard.answers.explain_document import (
    AmbiguityDocument,
    NotTestableDocument,
    WhereDocument,
    ambiguity_documents,
    not_testable_documents,
    where_document,
)
from onboard.answers.flown_again import FlownAgain
from onboard.answers.json_file import indented
from onboard.answers.match import Match
from onboard.core.vehicle.records import AxisMismatch, Difference, WindEstimate

MATCH_SCHEMA = "onboard.match/1"


class ValueDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One number, as the simulation has it and as the recording has it."""

    simulation: float | None
    real: float | None
    sigma: float | None
    unit: str


class HeldOutDocument(msgspec.Struct, frozen=True, kw_only=True):
    """Residual on flight that was not used, without and with."""

    before: float | None
    after: float | None


class MatchedEffectDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One effect that was found."""

    name: str
    level: str
    values: dict[str, ValueDocument]
    share: float | None
    where: list[WhereDocument]
    rivals: list[str]
    held_out: HeldOutDocument


class WindDocument(msgspec.Struct, frozen=True, kw_only=True):
    """Wind of the real flight at its mean height, towards north and east, m/s."""

    north: float | None
    east: float | None
    sigma_north: float | None
    sigma_east: float | None
    profile_exponent: float | None
    turbulence_rms: float | None
    height_m: float | None


class MatchedRecordings(msgspec.Struct, frozen=True, kw_only=True):
    """Names of the files; ``damage``: what was skipped of damaged ones, in sentences."""

    simulation: str | None
    real: str
    damage: list[str] = []


class OtherFlightDocument(msgspec.Struct, frozen=True, kw_only=True):
    """A further flight of the vehicle, and its wind; ``set_aside``: it contradicts the others."""

    recording: str
    wind: WindDocument
    set_aside: bool = False


class TwiceDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One unknown from the recording and from the simulator's flight."""

    real: float | None
    again: float | None
    sigma: float | None
    unit: str
    agrees: bool


class VerifiedDocument(msgspec.Struct, frozen=True, kw_only=True):
    """``--verify``: the simulator flew the recording again, nominally and with what was found.

    ``mismatch`` is between the recording and those two flights: ``x``, ``y``, ``z`` of the force,
    m/s^2, and ``tilt``, degrees.  ``untold`` is why the second flight tells nothing.
    """

    simulator: str
    agrees: bool
    numbers: dict[str, TwiceDocument]
    mismatch: dict[str, HeldOutDocument]
    effects_left: list[str]
    untold: str = ""


class MatchDocument(msgspec.Struct, frozen=True, kw_only=True):
    """``onboard match --json``."""

    vehicle: str
    recordings: MatchedRecordings
    verdict: str
    note: str
    flight_s: float | None
    unexplained_share: float
    effects: list[MatchedEffectDocument]
    wind: WindDocument | None
    mismatch: dict[str, HeldOutDocument]
    settings: dict[str, float]
    frame: dict[str, float | list[float]]
    ambiguous: list[AmbiguityDocument]
    not_testable: list[NotTestableDocument]
    others: list[OtherFlightDocument] = []
    verified: VerifiedDocument | None = None
    schema: str = MATCH_SCHEMA

    def to_json(self) -> bytes:
        """Indented, ends with a line feed."""
        return indented(self)


def match_document(match: Match, verified: FlownAgain | None = None) -> MatchDocument:
    """The document of a match, with its verification if there was one."""
    vehicle = match.vehicle
    alone = AxisMismatch(vehicle.alone_before, vehicle.alone_after)
    aside = {a.number for a in vehicle.aside}
    return MatchDocument(
        vehicle=vehicle.vehicle,
        recordings=MatchedRecordings(
            simulation=None if match.simulation is None else match.simulation.name,
            real=match.real.name,
            damage=match.damage,
        ),
        verdict=match.verdict.value,
        note=vehicle.note,
        flight_s=finite(vehicle.seconds),
        unexplained_share=vehicle.unexplained,
        effects=[_effect(d) for d in match.effects],
        wind=None if vehicle.wind is None else _wind(vehicle.wind),
        others=[
            OtherFlightDocument(recording=its.name, wind=_wind(wind), set_aside=k in aside)
            for k, (its, wind) in enumerate(zip(match.others, vehicle.other_winds, strict=False), 1)
        ],
        mismatch=_mismatch({**vehicle.mismatch, "velocity_after_10s": alone}),
        settings={s.name: s.value for s in match.settings},
        frame=dict(match.frame),
        ambiguous=ambiguity_documents(vehicle.ambiguous),
        not_testable=not_testable_documents(match.not_testable),
        verified=None if verified is None else _verified(verified),
    )


def _verified(v: FlownAgain) -> VerifiedDocument:
    return VerifiedDocument(
        simulator=v.simulator,
        agrees=v.agrees,
        numbers={
            key: TwiceDocument(
                real=finite(n.real),
                again=finite(n.again),
                sigma=finite(n.sigma),
                unit=n.unit,
                agrees=n.agrees,
            )
            for key, n in v.numbers.items()
        },
        mismatch=_mismatch(v.mismatch),
        effects_left=list(v.left),
        untold=v.untold,
    )


def _effect(d: Difference) -> MatchedEffectDocument:
    return MatchedEffectDocument(
        name=d.name,
        level=d.level,
        values={
            key: ValueDocument(
                simulation=finite(v.simulation),
                real=finite(v.real),
                sigma=finite(v.sigma),
                unit=v.unit,
            )
            for key, v in d.values.items()
        },
        share=finite(d.share),
        where=[where_document(w) for w in d.where],
        rivals=list(d.rivals),
        held_out=_held_out(d.held_out_before, d.held_out_after),
    )


def _mismatch(every: Mapping[str, AxisMismatch]) -> dict[str, HeldOutDocument]:
    return {key: _held_out(m.before, m.after) for key, m in every.items()}


def _held_out(before: float, after: float) -> HeldOutDocument:
    return HeldOutDocument(before=finite(before), after=finite(after))


def _wind(wind: WindEstimate) -> WindDocument:
    return WindDocument(
        north=finite(wind.north),
        east=finite(wind.east),
        sigma_north=finite(wind.sigma_north),
        sigma_east=finite(wind.sigma_east),
        profile_exponent=finite(wind.profile_exponent),
        turbulence_rms=finite(wind.turbulence_rms),
        height_m=finite(wind.height),
    )
