"""A matched model as the record of the vehicle level: what was found, how well, and what not."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from onboard.core.diagnosis.records import Ambiguity, NotTestable
from onboard.core.maths.arrays import Array
from onboard.core.physics.finding import NAN
from onboard.core.physics.wording import listed
from onboard.core.vehicle.bounds import above_sentence, below_sentence
from onboard.core.vehicle.changed import undecided_sentence
from onboard.core.vehicle.effects.airspeed_scale import AirspeedScale
from onboard.core.vehicle.effects.beyond import beyond_of, beyond_sentence
from onboard.core.vehicle.effects.motor_lag import DELAY, MotorLag
from onboard.core.vehicle.flown_alone import drift_alone
from onboard.core.vehicle.matching import Matched, left_by
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import rms
from onboard.core.vehicle.places import AXES, FORCE, places_of
from onboard.core.vehicle.records import (
    Alone,
    AxisMismatch,
    Compared,
    Curve,
    Difference,
    ForceSeries,
    VehicleMatch,
)
from onboard.core.vehicle.remainder import left_out_sentence, remainder_sentence
from onboard.core.vehicle.wind_record import (
    change_sentence,
    height_sentence,
    rising_sentence,
    wind_of,
)

PARTLY = "gusts hide a part of its numbers, and only the rest was tested"


def vehicle_match(
    m: Matched,
    vehicle: str,
    untested: tuple[NotTestable, ...],
    *,
    effects: tuple[Difference, ...],
    frame: Mapping[str, float | list[float]],
    curves: tuple[Curve, ...],
) -> VehicleMatch:
    """The record of the vehicle level.

    Args:
        m: what was found.
        vehicle: its kind.
        untested: effects that this flight could not have shown, a wind's profile included.
        effects: those that were found.
        frame: keys of an airframe's file that flies like the recording.
        curves: laws with their data.
    """
    alone = drifts_of(m)
    return VehicleMatch(
        vehicle=vehicle,
        effects=effects,
        wind=wind_of(m),
        other_winds=tuple(wind_of(m, k) for k in range(1, m.model.flight.parts)),
        mismatch=mismatch_of(m),
        alone_before=float(alone.before[-1]) if alone else NAN,
        alone_after=float(alone.after[-1]) if alone else NAN,
        alone=alone,
        ambiguous=ambiguous_of(m),
        not_testable=windless(untested, m),
        numbers=numbers_of(m),
        frame=frame,
        curves=curves,
        series=series_of(m),
        seconds=len(m.model.flight) * m.model.flight.step_s,
        explained=is_explained(m),
        unexplained=m.unexplained,
        note=note_of(m),
    )


def differences(m: Matched) -> tuple[Difference, ...]:
    """The effects that were chosen, and turbulence, with their evidence."""
    fit, chosen = m.fit, m.chosen
    whole = sum(max(chosen.gains[n], 0.0) for n in chosen.effects)
    out = []
    for name in chosen.effects:
        if name not in m.handed_back:
            continue
        without = tuple(n for n in chosen.taken if n != name)
        places = m.model.indices(name)
        effect = m.model.effect(name)
        shown = effect.shown(fit.theta[places].tolist(), fit.sigma[places].tolist())
        if name == MotorLag.name and shown[0].value < 0.0:
            late = Compared(0.0, -shown[0].value, shown[0].sigma, shown[0].unit)
            out.append(Difference(DELAY, "sensor", {"delay": late}))
            continue
        apart = fit.theta[places] - m.model.nominal[places]
        acts = fit.jacobian.of(places) @ apart
        shown_by = _shown_by(m, acts, sensor=name == AirspeedScale.name)
        out.append(
            Difference(
                name,
                "vehicle",
                {s.name: Compared(s.nominal, s.value, s.sigma, s.unit) for s in shown},
                max(chosen.gains[name], 0.0) / whole if whole > 0.0 else 0.0,
                places_of(m.model.flight, acts, m.model.axes, fit.block),
                chosen.rivals[name],
                _weighted(left_by(m.choices, without), shown_by),
                _weighted(m.held, shown_by),
            )
        )
    if m.turbulence.found:
        t = m.turbulence
        value = {"rms": Compared(0.0, t.rms, math.hypot(t.sigma, t.by_law), "m/s")}
        if t.whole is not None:
            value["rms_with_faster"] = Compared(0.0, t.whole, t.whole_sigma, "m/s")
        out.append(Difference("turbulence", "vehicle", value, 0.0))
    return tuple(out)


def _shown_by(m: Matched, acts: Array, *, sensor: bool) -> Array:
    """(k,) weights of the axes that show an effect: its squares over those of the axis's noise.

    Along an axis on which it does not act it proves nothing, whatever the others do there.

    Args:
        m: what was found.
        acts: (n, k) force by the effect, m/s^2, and what it adds to an airspeed, m/s.
        sensor: whether the airspeed's axis alone has it, or the force's.
    """
    its = np.array([(axis in FORCE) != sensor for axis in m.model.axes])
    noise = [rms(noise.size(m.fit.sensitivity[:, k])) for k, noise in enumerate(m.fit.noise)]
    size = np.sqrt(np.mean(acts**2, axis=0)) / np.array(noise)
    out: Array = its * np.square(size)
    # What acts nowhere that it is asked for (a change of nothing) is shown by all alike.
    return out if out.any() else its.astype(np.float64)


def _weighted(residual: Array, weights: Array) -> float:
    """Root of the mean square of (n, k), of which axes have weights (k,)."""
    return math.sqrt(float(np.average(np.mean(residual**2, axis=0), weights=weights)))


def not_testable_of(
    m: Matched, absent: Mapping[str, str], manoeuvres: Mapping[str, str]
) -> tuple[NotTestable, ...]:
    """What this flight could not have shown, why, and what would.

    Args:
        m: what was found.
        absent: why some effects are not in the model, by name.
        manoeuvres: that would show them, by name; those of the model's effects are their own.
    """
    shown_by = dict(manoeuvres) | {e.name: e.manoeuvre for e in m.model.effects if e.name}
    why = dict(absent)
    for name in m.chosen.untestable:
        why.setdefault(name, "the flight would not have shown it")
    for name in m.chosen.partly:
        if name not in m.chosen.effects:
            why.setdefault(name, PARTLY)
    return tuple(
        NotTestable(name, f"{reason}; {shown_by[name]}" if shown_by.get(name) else reason)
        for name, reason in why.items()
    )


def windless(untested: tuple[NotTestable, ...], m: Matched) -> tuple[NotTestable, ...]:
    """A calm has no profile: that is the reason, not the flight."""
    if "wind" in m.chosen.effects:
        return untested
    why = "there was no wind whose profile could show"
    return tuple(replace(n, why=why) if n.name == "wind_profile" else n for n in untested)


def ambiguous_of(m: Matched) -> tuple[Ambiguity, ...]:
    """Pairs that this flight cannot tell apart."""
    return tuple(
        Ambiguity((name, *rivals), m.model.effect(rivals[0]).manoeuvre)
        for name, rivals in m.chosen.rivals.items()
        if rivals
    )


def mismatch_of(m: Matched) -> dict[str, AxisMismatch]:
    """RMS by axis on flight not used, before and after."""
    return {
        AXES[axis]: AxisMismatch(rms(m.nominal[:, k]), rms(m.held[:, k]))
        for k, axis in enumerate(m.model.axes)
        if axis in FORCE
    }


def drifts_of(m: Matched) -> Alone | None:
    """How velocity drifts when the nominal model, and the found one, fly on alone."""
    before = _drift(m.model, m.model.nominal, m.nominal)
    after = _drift(m.model, m.flies_by, m.held)
    if not len(before):
        return None
    t: Array = m.model.flight.step_s * np.arange(1.0, len(before) + 1.0)
    return Alone(t, before, after)


def series_of(m: Matched) -> ForceSeries:
    """Forces over time, for a report; of several recordings, those of the first."""
    columns = [k for k, axis in enumerate(m.model.axes) if axis in FORCE]
    flight = m.model.flight
    mine = np.ix_(flight.part == 0, columns)
    measured = m.model.measured()[mine]
    t = flight.since_start[flight.part == 0]
    axes = tuple(AXES[m.model.axes[k]] for k in columns)
    before, after = measured - m.nominal[mine], measured - m.held[mine]
    speed = np.linalg.norm(flight.v_n[flight.part == 0], axis=1)
    return ForceSeries(t, axes, measured, before, after, speed)


def numbers_of(m: Matched) -> dict[str, Compared]:
    """Every unknown of the model, by ``effect.unknown``, and as the document shows it."""
    out: dict[str, Compared] = {}
    at = 0
    sigmas = m.fit.sigma
    for effect in m.model.effects:
        end = at + len(effect.unknowns)
        values, spread = m.fit.theta[at:end].tolist(), sigmas[at:end].tolist()
        prefix = f"{effect.name}." if effect.name else ""
        for s in effect.shown(values, spread):
            out[prefix + s.name] = Compared(s.nominal, s.value, s.sigma, s.unit)
        for u, value, sigma in zip(effect.unknowns, values, spread, strict=True):
            out[prefix + u.name] = Compared(u.nominal, value, sigma, u.unit, u.floor)
        at = end
    return out


def is_explained(m: Matched) -> bool:
    """Whether what is left is less than errors of the motion, or the gusts found, make."""
    if m.remainders or m.chosen.suspected or m.stand_ins or beyond_of(m.model.effects):
        return False
    unclear = m.model.unclear(m.fit.theta)
    gusts = m.turbulence.largest * m.fit.sensitivity
    return all(
        rms(m.held[:, k]) < math.hypot(rms(unclear[:, k]), rms(gusts[:, k]))
        for k, axis in enumerate(m.model.axes)
        if axis in FORCE
    )


def note_of(m: Matched) -> str:
    """What a person must know of flight that is not described or was not used; may be empty."""
    said = (
        *dict.fromkeys(m.model.effect(n).note for n in m.chosen.effects),
        suspected_sentence(m.chosen.suspected, m.chosen.together),
        below_sentence(m.below),
        above_sentence(m.above),
        undecided_sentence(m.fit, m.undecided),
        beyond_sentence(beyond_of(m.model.effects)),
        change_sentence(m),
        height_sentence(m),
        rising_sentence(m),
        remainder_sentence(m.remainders, m.unexplained),
        left_out_sentence(m.left_out),
    )
    return "; ".join(s for s in said if s)


def suspected_sentence(names: tuple[str, ...], together: tuple[str, ...]) -> str:
    """Of effects that explain more than chance and whose numbers are not known."""
    if not names:
        return ""
    its = "its" if len(names) == 1 else "their"
    said = (
        f"{listed(list(names))} would explain a part of what is left, but this flight does not "
        f"determine {its} numbers"
    )
    if not together:
        return said
    are = "is" if len(together) == 1 else "are"
    return f"{said}; the thrust is known all the same: {listed(list(together))} {are} handed back"


def _drift(model: ForceModel, theta: Array, residual: Array) -> Array:
    n = len(model.flight)
    error, slope = np.zeros((n, 3)), np.zeros((n, 3, 3))
    columns = [k for k, axis in enumerate(model.axes) if axis in FORCE]
    axes = [model.axes[k] for k in columns]
    error[:, axes] = -residual[:, columns]
    # Moving air one way is moving the vehicle the other way.
    slope[:, axes] = -model.gust_slope(theta)[:, columns]
    return drift_alone(model.flight, error, slope)
