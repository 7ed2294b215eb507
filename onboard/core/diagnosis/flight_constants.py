"""What a flight is taken to have one of, by name: latency, averaging, delay, place of the antenna.

What differs in parts of it (:mod:`onboard.core.diagnosis.constancy`) is told with what it is in
two of them: nothing that is set or switched for a whole flight may follow from a mean of these.
"""

from __future__ import annotations

import math

from onboard.core.diagnosis.constancy import Change, Constant, Growth, changes
from onboard.core.diagnosis.final_model import FinalModel
from onboard.core.diagnosis.limits import ANTENNA_FLOOR_M
from onboard.core.diagnosis.nuisance_effects import nuisance_kinds
from onboard.core.diagnosis.records import Inconstant
from onboard.core.estimate.calibration_model import antenna_of
from onboard.core.estimate.limits import TIMING_FLOOR_S
from onboard.core.model.nuisances import ANTENNA_SIGMA
from onboard.core.physics.catalogue import kinds
from onboard.core.physics.effect import AXES
from onboard.core.physics.effects.clock_skew import ClockSkew
from onboard.core.physics.effects.gps_latency import GpsLatency
from onboard.core.physics.effects.gps_lever_arm import CENTIMETRES, SIDES, GpsLeverArm
from onboard.core.physics.effects.gps_smoothing import GpsSmoothing
from onboard.core.physics.wording import fixed, places


def inconstant(final: FinalModel) -> tuple[Inconstant, ...]:
    """Constants that are not the same in parts of a flight, the most surprising first."""
    engine = final.engine
    found = changes(engine.all_blocks, engine.model, constants_of(final))
    what = {kind.effect: kind.constant for kind in kinds()}
    told = [
        Inconstant(effect, _in_words(final, change, what[effect]), change.contradicts)
        for change in found
        for effect in (change.constant.effect,)
    ]
    grown = [] if any(c.effect == GpsLatency.effect for c in told) else _running_off(final)
    return (*told, *grown)


def constants_of(final: FinalModel) -> list[Constant]:
    """Timing that is an effect from a size on, and the antenna's place."""
    window = max(final.engine.point.window, TIMING_FLOOR_S)
    out = []
    for name, kind in nuisance_kinds().items():
        if kind.least is None or not kind.constant:
            continue
        floor, matters = TIMING_FLOOR_S, kind.least
        if name == GpsSmoothing.effect:  # of which the square is the unknown
            floor, matters = 2.0 * window * floor, matters**2
        growth = _growth(final) if name == GpsLatency.effect else None
        index = (final.index[kind.in_every_model[0]],)
        out.append(Constant(name, index, floor, matters, growth))
    place = tuple(range(final.engine.model.size)[antenna_of(final.engine.model)])
    return [*out, Constant(GpsLeverArm.effect, place, ANTENNA_FLOOR_M, ANTENNA_SIGMA)]


def _growth(final: FinalModel) -> Growth | None:
    """That of the latency, where clocks run at different rates."""
    name, point = ClockSkew.unknowns[0].name, final.engine.point
    return Growth(final.index[name], point.skew, point.skew_from) if name in final.index else None


def _running_off(final: FinalModel) -> list[Inconstant]:
    """The latency, where clocks that run at different rates make another one of it in flight."""
    growth, theta, blocks = _growth(final), final.solution.theta, final.engine.all_blocks
    if growth is None:
        return []
    late = final.engine.point.delay + float(theta[final.index["gps_delay"]])
    rate = growth.taken + float(theta[growth.index])
    first, last = (late + rate * (t - growth.since) for t in (blocks[0].start, blocks[-1].end))
    if abs(last - first) < GpsLatency.least:
        return []
    what = f"{GpsLatency.constant} {'grows' if last > first else 'shrinks'}"
    words = f"{what} from {1e3 * first:.0f} to {1e3 * last:.0f} ms over the flight"
    return [Inconstant(GpsLatency.effect, words, contradicts=False)]


def _in_words(final: FinalModel, change: Change, what: str) -> str:
    """``the latency of GPS is not the same in parts of the flight (100 ms until 120 s, ...)``."""
    first, second, axis = change.apart
    a, b = (_value(final, change, part, axis) for part in (first, second))
    (start, end), (after, last) = (
        [f"{t - final.origin.t0:.0f}" for t in change.spans[part]] for part in (first, second)
    )
    if len(change.spans) == 2:
        said = f"{a} until {end} s, {b} after"
    else:
        said = f"{a} from {start} to {end} s, {b} from {after} to {last} s"
    surely = "is not" if change.contradicts else "may not be"
    return f"{what} {surely} the same in parts of the flight ({said})"


def _value(final: FinalModel, change: Change, part: int, axis: int) -> str:
    """What a constant is in one part of the flight, with its unit."""
    point, effect = final.engine.point, change.constant.effect
    value, sigma = float(change.values[part, axis]), float(change.sigmas[part, axis])
    if effect == GpsLeverArm.effect:
        value += float(final.parameters.antenna[axis])
        side = SIDES[AXES[axis]][value < 0.0]
        return f"{fixed(abs(value), min(places(sigma), CENTIMETRES))} m {side}"
    if effect == GpsSmoothing.effect:
        value = math.sqrt(max(point.window**2 + value, 0.0))
        sigma /= 2.0 * max(value, math.sqrt(sigma) / 2.0)  # at nothing, the root of the square's
    else:
        value += point.delay if effect == GpsLatency.effect else point.attitude_delay
    return f"{fixed(1e3 * value, places(1e3 * sigma))} ms"
