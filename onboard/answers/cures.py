"""What of the parameters of a found effect should be set, and why not the rest.

Whoever gives advice asks here: the sentences of what to do, the files of parameters, and the reason
that is given against the six.  So none of them asks for what another one warns of.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from onboard.core.diagnosis.limits import CLEARLY
from onboard.core.diagnosis.records import Diagnosis, Verdict
from onboard.core.estimate.limits import SURE
from onboard.core.estimate.result import Status
from onboard.core.inputs.parameters import receiver_names
from onboard.core.physics.catalogue import bearing_of, phrase_of
from onboard.core.physics.effect import Bearing
from onboard.core.physics.finding import Finding

FORMER_NAMES = {
    now: former for receiver in (1, 2) for now, former in receiver_names(receiver).values()
}
"""Of parameters before ArduPilot 4.6."""


def against(
    effect: Finding,
    diagnosis: Diagnosis,
    parameters: Mapping[str, float] | None = None,
    sure: float = SURE,
) -> str:
    """Why the parameters of a found effect should not be set; empty if they may be.

    The standard is that of the six: what is not the whole truth, could as well be something else,
    is read off from an accelerometer that is not known, or helps next to nothing, is not set.

    Args:
        effect: of the diagnosis.
        diagnosis: with the status that its calibration is given.
        parameters: the autopilot's, as the recording has them; None: nobody has asked.
        sure: probability of an improvement that is needed.
    """
    unknown = [
        n
        for n in effect.parameters
        if parameters is not None and n not in parameters and not former(n, parameters)
    ]
    if unknown:  # before all that another flight may change
        return f"{', '.join(unknown)} in force is not in the recording (old firmware has none)"
    if contradicted := [c.words for c in diagnosis.inconstant if c.effect == effect.name]:
        return contradicted[0]
    if diagnosis.verdict is not Verdict.EXPLAINED:
        return "what was found does not explain all of the residual"
    confounders = {r.name for r in effect.confounders if r.delta_bic < CLEARLY}
    confounders |= {n for a in diagnosis.ambiguous if effect.name in a.names for n in a.names}
    if confounders := confounders - {effect.name}:
        return f"not told apart from {', '.join(sorted(confounders))}"
    beside = bearing_of(effect.name) is Bearing.BESIDE
    if beside and diagnosis.calibration.status is not Status.CALIBRATED:
        return "it is read off from the accelerometer, which this flight does not calibrate"
    before, after = effect.held_out_before, effect.held_out_after
    odds = -2.0 * math.log(1.0 - sure)
    if not (after < before and effect.delta_bic <= -odds):
        return f"the held-out residual falls from {before:.3g} to {after:.3g} only"
    return ""


def former(name: str, parameters: Mapping[str, float]) -> bool:
    """Whether this autopilot has the parameter by its former name."""
    return name not in parameters and FORMER_NAMES.get(name) in parameters


def former_names(parameters: Mapping[str, float]) -> dict[str, str]:
    """Former names of what this autopilot has by them only, by the name of today."""
    return {new: old for new, old in FORMER_NAMES.items() if former(new, parameters)}


def cured(
    effects: Sequence[Finding],
    diagnosis: Diagnosis,
    parameters: Mapping[str, float] | None = None,
) -> str:
    """What is missing and what to do about it: no value of what should not be set.

    Args:
        effects: what is missing.
        diagnosis: that has found them, with the status that its calibration is given.
        parameters: as of :func:`against`.
    """
    names = former_names(parameters or {})
    todo = []
    for e in effects:
        finite = {n: v for n, v in e.parameters.items() if math.isfinite(v)}
        values = [f"{names.get(n, n)} {v:.4g}" for n, v in finite.items()]
        settable = values and not against(e, diagnosis, parameters)
        todo.append(f"set {', '.join(values)}" if settable else e.cure)
    said = "; ".join(dict.fromkeys(c for c in todo if c))
    found = ", ".join(dict.fromkeys(phrase_of(e) for e in effects))
    return f"{found}; first {said}, then fly again" if said else found
