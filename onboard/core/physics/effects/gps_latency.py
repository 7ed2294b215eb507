"""GPS velocities that are late."""

from __future__ import annotations

from typing import ClassVar

from onboard.core.estimate.gps_clock import FixClock
from onboard.core.model.linearisation import Linearisation
from onboard.core.physics.effect import SURE, Bearing, Cure, Effect, NuisanceFit
from onboard.core.physics.finding import Finding, Quantity
from onboard.core.physics.wording import first, measured


class GpsLatency(Effect):
    """The receiver's velocity is that of a moment before its stamp."""

    effect = "gps_latency"
    code = 1
    title = "GPS is late"
    sentence = "GPS is late"
    meaning = "`delay`, s, against the stamp in the recording; past 50 ms beside `GPS1_DELAY_MS`"
    bearing = Bearing.HARMLESS
    source = "v_gps(t) = v(t - delay); GPS_DELAY_MS of ArduPilot"
    cure = "tell the autopilot the receiver's latency"
    apart = "accelerate and brake hard, straight ahead"
    in_every_model: ClassVar[tuple[str, ...]] = ("gps_delay",)
    least: ClassVar[float] = 0.05
    constant = "the latency of GPS"

    @classmethod
    def measured(cls, nuisances: NuisanceFit) -> tuple[dict[str, Quantity], Cure] | None:
        """The whole delay, where it is another one than the autopilot was told."""
        delay = nuisances.timing["gps_delay_s"]
        off = abs(delay.value - nuisances.clock.configured_on_stamp)
        if off <= cls.least or off <= SURE * delay.sigma:
            return None
        size = {"delay": Quantity(delay.value, delay.sigma, "s")}
        return size, cls._cured_by(delay.value, nuisances.clock)

    @classmethod
    def absent(cls, point: Linearisation, told: float) -> dict[str, float]:
        """As late as the autopilot was told."""
        return {"gps_delay": told - point.delay}

    @classmethod
    def size(cls, found: Finding) -> str:
        """``by 259 ± 8 ms``."""
        return f"by {measured(first(found.unknowns), 1e3, 'ms')}"

    @classmethod
    def _cured_by(cls, delay: float, clock: FixClock) -> Cure:
        """What to do about a latency against the recording's stamps, and the parameter to set."""
        taken = " or ".join(f"{1e3 * lag:.0f}" for lag in clock.assumed)
        if clock.off(delay) < cls.least:
            said = f"none: {clock.name} is 0, for which this receiver's driver takes {taken} ms"
            return Cure(said)
        words = cls.cure
        if not clock.configured and clock.assumed:
            words += f" (0 stands for {taken} ms, by its driver)"
        if round(1e3 * clock.late):
            words += (
                f"; the log stamps fixes {1e3 * clock.late:.0f} ms later than the time that the "
                "EKF counts from"
            )
        value = clock.setting(delay)
        if 1e3 * (delay - clock.late) - value > 1e3 * cls.least:
            words += f" ({value:.0f} ms is the most that it takes)"
        return Cure(words, {clock.name: value})
