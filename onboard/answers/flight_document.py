"""What each of several merged recordings says by itself, in the documents."""

from __future__ import annotations

import msgspec

from onboard.answers.answer import FlightAnswer
from onboard.answers.document_numbers import Number, Numbers, finite, numbers, timing_document
from onboard.core.estimate.result import Status


class FlightDocument(msgspec.Struct, frozen=True, kw_only=True):
    """What one of several recordings says of one accelerometer by itself.

    ``counted`` flights are in the merged answer; ``why`` says why another one is not.
    ``chi_square`` (``dof`` degrees of freedom) and ``p_value`` are of its difference from the
    others that count, in what both know; ``null`` where it is not compared.
    """

    imu: int
    status: str
    scale: Numbers
    offset: Numbers
    scale_sigma: Numbers
    offset_sigma: Numbers
    timing: dict[str, Number]
    effects: list[str]
    trusted_s: float | None
    chi_square: float | None
    dof: int
    p_value: float | None
    contradicted: bool
    counted: bool
    why: str


class FlightsDocument(msgspec.Struct, frozen=True, kw_only=True):
    """One of several recordings: an entry for each accelerometer that has an answer."""

    file: str
    imus: list[FlightDocument]


def flight_document(imu: int, flight: FlightAnswer) -> FlightDocument:
    """One accelerometer's entry of one recording in ``flights``."""
    given, apart = flight.given, flight.apart
    c = None if given is None else given.calibration
    nothing: Numbers = [None, None, None]
    return FlightDocument(
        imu=imu,
        status=Status.INSUFFICIENT.value if c is None else c.status.value,
        scale=nothing if c is None else numbers(c.scale),
        offset=nothing if c is None else numbers(c.offset),
        scale_sigma=nothing if c is None else numbers(c.scale_sigma),
        offset_sigma=nothing if c is None else numbers(c.offset_sigma),
        timing=timing_document({} if c is None else c.timing),
        effects=[] if given is None else [e.name for e in given.diagnosis.effects],
        trusted_s=0.0 if c is None else finite(c.trusted_s),
        chi_square=finite(apart.chi_square) if apart.dof else None,
        dof=apart.dof,
        p_value=finite(apart.p_value) if apart.dof else None,
        contradicted=flight.contradicted,
        counted=flight.counted,
        why=flight.why,
    )
