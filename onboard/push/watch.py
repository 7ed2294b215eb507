"""The flight after a push judges it: kept, or rolled back.

Feed :class:`PushWatch` with the calibration of *what was flown since the push* (sums begun
after it) when a trust window closes; it is sans-IO and answers with a verdict once there is
enough to judge.  Two questions are asked:

* Has the held-out residual with the pushed parameters become larger than it was with the old
  ones?  Whitened, so that flights compare; velocity RMS where there is no whitened one.
* Would the old parameters have done better on *this* flight?  The residual sum of the linear
  model is a parabola about the new estimate, ``J(p) = J(x) + (p - x)^T P^-1 (p - x)``, so the
  difference between old and pushed needs nothing but the estimate and its covariance.

The second compares like with like and therefore overrules the first where it is clear
(``evidence``): a rough flight is no reason to go back to values that would have been worse.

Values that are better than the old ones need not be right: the sensor may have changed since they
were learned.  So a push that is not taken back is held to what it had promised.  The flight does
not fit it (*doubted*; it is kept, and the next flight judges anew) if the residual is larger than
the one promised, by more than the same margin, **and** the flight's own six are off those written
by more than the uncertainties of both leave room for, past the 0.999 quantile of chi-square.  The
first alone may be the weather, the second alone may not matter.

A push made in flight is also watched for EKF health during its first half minute.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.estimate.result import Calibration
from onboard.core.maths.chi_square import CHI_SQUARE_999
from onboard.push import limits
from onboard.push.entries import Planned, Verdict, Watched
from onboard.push.plan import PushPlan
from onboard.push.signals import VehicleReport

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class WatchSettings:
    """``margin``: share by which a residual may grow; ``evidence``: of a residual sum, clear."""

    minimum_s: float = limits.JUDGED_AFTER_S
    margin: float = limits.RESIDUAL_MARGIN
    evidence: float = limits.CLEAR_EVIDENCE
    ekf_s: float = limits.EKF_WATCHED_S


class PushWatch:
    """Judges one completed push.

    Args:
        pushed: its journal entry (:meth:`onboard.push.journal.Journal.last_completed`).
        settings: limits.
        in_flight_since: when it was written, if the vehicle was flying.
    """

    def __init__(
        self,
        pushed: Planned,
        settings: WatchSettings | None = None,
        *,
        in_flight_since: float | None = None,
    ) -> None:
        self._pushed = pushed
        self._settings = settings or WatchSettings()
        self._in_flight_since = in_flight_since
        self._flown: Calibration | None = None

    @property
    def plan(self) -> PushPlan:
        """What was written; ``reversed()`` is the way back."""
        return self._pushed.plan

    def vehicle(self, report: VehicleReport, now: float) -> Watched | None:
        """Take a change of armed state or EKF health."""
        since = self._in_flight_since
        if since is None or now - since > self._settings.ekf_s or report.ekf_healthy is not False:
            return None
        return self._say(Verdict.WORSE, f"the EKF became unhealthy {now - since:.0f} s after it")

    def judge(self, flown: Calibration) -> Watched | None:
        """Verdict on the calibration of the flight since the push; None: not enough yet."""
        plan = self._pushed.plan
        if flown.imu != plan.imu or not flown.parameters_known:
            return None
        if flown.trusted_s < self._settings.minimum_s:
            return None
        in_force = np.array(flown.in_force_scale + flown.in_force_offset)
        if np.max(np.abs(in_force - plan.six_wanted().as_vector())) > limits.SAME:
            return self._say(Verdict.SUPERSEDED, "somebody has changed the parameters since")
        self._flown = flown
        worse = self._residual_worse(flown)
        old, new = plan.six_before().as_vector(), plan.six_wanted().as_vector()
        preferred = preference(old, new, flown)
        clear = self._settings.evidence
        if preferred is not None and preferred < -clear:
            sentence = f"the old values fit this flight better (by {-preferred:.3g} in J)"
            return self._say(Verdict.WORSE, sentence)
        if worse is None and preferred is None:
            return None
        if worse and (preferred is None or preferred < clear):
            return self._say(Verdict.WORSE, worse)
        doubt = self._doubt(flown)
        if doubt:
            sentence = f"kept, but this flight does not fit what was written: {doubt}"
            return self._say(Verdict.DOUBTED, sentence)
        if worse:
            sentence = f"{worse}, but the old values would have done worse still on this flight"
            return self._say(Verdict.KEPT, sentence)
        return self._say(Verdict.KEPT, "the residual has not grown")

    def _residual_worse(self, flown: Calibration) -> str | None:
        """A sentence if it is worse, empty if it is not, None if it cannot be said."""
        baseline = self._pushed.plan.baseline
        growth = 1.0 + self._settings.margin
        before, after = baseline.held_out_before, flown.held_out_before
        if before is not None and np.isfinite(after):
            # A whitened residual below one is noise: it cannot get worse there.
            if after > growth * max(before, 1.0):
                return f"the held-out residual grew from {before:.3g} to {after:.3g}"
            return ""
        before, after = baseline.velocity_rms_before, flown.velocity_rms_before
        if before is not None and np.isfinite(after):
            if after > growth * before:
                return f"the velocity residual grew from {before:.3g} to {after:.3g} m/s"
            return ""
        return None

    def _doubt(self, flown: Calibration) -> str:
        """A sentence if the flight is not what the push had promised, else empty."""
        baseline = self._pushed.plan.baseline
        told = (
            ("held-out", baseline.held_out_after, flown.held_out_before, ""),
            ("velocity", baseline.velocity_rms_after, flown.velocity_rms_before, " m/s"),
        )
        off = departure(self._pushed.plan, flown)
        if off is None or off <= CHI_SQUARE_999[6]:
            return ""
        for what, promised, after, unit in told:
            if promised is not None and np.isfinite(after):
                if after <= (1.0 + self._settings.margin) * promised:
                    return ""
                return f"the {what} residual is {after:.3g}{unit}, {promised:.3g} was promised"
        return ""

    def _say(self, verdict: Verdict, sentence: str) -> Watched:
        """The verdict, with the residuals of the flight that gave it, if one did."""
        flown = self._flown
        return Watched(
            self._pushed.transaction,
            verdict,
            sentence,
            held_out=None if flown is None else _finite(flown.held_out_before),
            velocity_rms=None if flown is None else _finite(flown.velocity_rms_before),
        )


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def preference(old: Array, new: Array, flown: Calibration) -> float | None:
    """``J(old) - J(new)`` on a flight, twice a difference of log-likelihoods; None: unknown.

    Args:
        old: (6,) scale and offset.
        new: (6,) others; positive speaks for them.
        flown: what the flight says by itself.
    """
    P, x = flown.with_its_gyroscope, np.array(flown.scale + flown.offset)
    far, near = _distance(old - x, P), _distance(new - x, P)
    return None if far is None or near is None else far - near


def departure(plan: PushPlan, flown: Calibration) -> float | None:
    """How far a flight's own six are off those of a plan: chi-square of six numbers; None: unknown.

    In the units of both uncertainties: the flight's, and by how much another flight like the one
    that taught the plan would want each number otherwise.

    Args:
        plan: what was written.
        flown: what the flight says by itself.
    """
    P = flown.with_its_gyroscope
    if P.shape != (6, 6):
        return None
    sigma = np.array([change.sigma for change in plan.changes])
    x = np.array(flown.scale + flown.offset)
    return _distance(x - plan.six_wanted().as_vector(), P + np.diag(sigma**2))


def _distance(apart: Array, P: Array) -> float | None:
    """``apart^T P^-1 apart``, None where either is not known."""
    if P.shape != (6, 6) or not np.all(np.isfinite(P)) or not np.all(np.isfinite(apart)):
        return None
    unit = np.sqrt(np.maximum(np.diag(P), 1e-30))
    correlation = P / np.outer(unit, unit)
    if np.linalg.eigvalsh(correlation)[0] <= 0.0:
        return None
    return float((apart / unit) @ np.linalg.solve(correlation, apart / unit))
