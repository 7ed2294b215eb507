"""The verdict of a diagnosis in words: for the top of the page, and for terminals."""

from __future__ import annotations

import math
import re

from onboard.answers.advice import Advice
from onboard.answers.words import (
    DISTRUST,
    capital,
    fixed,
    number,
    setting,
    signed,
)
from onboard.core.diagnosis.excess import HEADING
from onboard.core.diagnosis.limits import NOISE
from onboard.core.diagnosis.records import REPEATED, Diagnosis, Unused, Verdict
from onboard.core.estimate.result import Calibration
from onboard.core.physics.catalogue import (
    danger_of,
    is_excluded,
    is_named,
    size_of,
    title_of,
    treated_of,
)
from onboard.core.physics.finding import Finding
from onboard.core.physics.wording import listed
from onboard.push import diagnosed
from onboard.push.policy import PHYSICS_MISSING, Objection

LACKING = "something is missing from the model"
"""Why a flight that shows the numbers well may be no calibration all the same."""
COLOURS = {"good": "green", "info": "cyan", "warning": "yellow", "error": "red"}
"""For terminals, by severity."""
NOT_ONE = "These recordings are not one flight"
DEAD = "The accelerometer repeated one reading in flight"
MOST_NAMED = 2
MOST_SPANS = 3
WHERE_BELIEVED = " where GPS was believed"
SAID_ABOVE = (
    "Only",
    "Too little excitation",
    "What was found does not explain",
    "The residual is not noise",
    "A formula of measured signals",
)
"""Sentences of the note that repeat the verdict."""


def headline(diagnosis: Diagnosis) -> str:
    """The verdict as one short sentence, after another one if the accelerometer died."""
    said = _headline(diagnosis)
    return f"{DEAD}. {said}" if _died(diagnosis) else said


def _headline(diagnosis: Diagnosis) -> str:
    if diagnosis.split:
        return NOT_ONE
    if diagnosis.verdict is Verdict.INSUFFICIENT:
        what = "" if diagnosis.silent else " what is missing"
        return f"This flight shows too little to tell{what}"
    if diagnosis.verdict is Verdict.CLEAN:
        where = WHERE_BELIEVED if diagnosis.unused else ""
        but = ", but the heading is wrong" if HEADING in diagnosis.note else ""
        return f"Nothing is missing from the model{where}{but}"
    named = [e for e in diagnosis.effects if is_named(e.name)]
    named.sort(key=lambda e: not danger_of(e))  # what is dangerous is not "one more effect"
    if not named:
        changing = [c.words for c in diagnosis.inconstant if c.contradicts]
        if changing:  # which is more than that nothing explains it
            return capital(changing[0].split(" (")[0])
        return "Something is missing, and no known effect explains it"
    every = list(dict.fromkeys(title_of(e.name) for e in named))  # what comes twice is said once
    titles = every[:MOST_NAMED]
    # A name that begins with capitals keeps them in the middle of a sentence.
    found = [t if t[:2].isupper() or not k else t[:1].lower() + t[1:] for k, t in enumerate(titles)]
    more = len(every) - len(titles)
    if diagnosis.verdict is not Verdict.EXPLAINED:
        found.append("something else is missing" if not more else "more is missing")
    elif more:
        found.append("one more effect" if more == 1 else f"{more} more effects")
    return found[0] if len(found) == 1 else ", ".join(found[:-1]) + f", and {found[-1]}"


def verdict_of(diagnosis: Diagnosis) -> tuple[str, str]:
    """A sentence that needs no sizes, and ``good``, ``info``, ``warning`` or ``error``."""
    if diagnosis.split:
        return f"{NOT_ONE}.", "warning"
    names = [e.name for e in diagnosis.effects]
    dangerous = _died(diagnosis) or any(danger_of(e) for e in diagnosis.effects)
    return diagnosed.headline(diagnosis.verdict.value, names, dangerous=dangerous)


def severity(diagnosis: Diagnosis) -> str:
    """``good``, ``info``, ``warning`` or ``error``."""
    return verdict_of(diagnosis)[1]


def lacks(diagnosis: Diagnosis) -> bool:
    """Whether what there is to say is of something missing; else it is only worth knowing."""
    return severity(diagnosis) != "info" and diagnosis.verdict is not Verdict.CLEAN


def dangers(diagnosis: Diagnosis) -> list[str]:
    """Why one should not fly before something is cured: one sentence for each effect."""
    said = [(title_of(e.name), danger_of(e)) for e in diagnosis.effects]
    if _died(diagnosis):
        said.insert(0, (DEAD, "it measures nothing meanwhile, or for good"))
    return [f"{title}: {why}. Do not fly before it is cured." for title, why in said if why]


def _died(diagnosis: Diagnosis) -> bool:
    """Whether the accelerometer repeated one reading in flight."""
    return any(u.reason == REPEATED for u in diagnosis.unused)


def missing(diagnosis: Diagnosis) -> list[str]:
    """What is missing, with sizes: one sentence for each effect."""
    if diagnosis.split:
        return [f"{diagnosis.split}."]
    if diagnosis.verdict is Verdict.INSUFFICIENT:
        m = diagnosis.mismatch
        if not m.fit:
            fit = f"Only {m.fixes} of {m.believed} GPS fixes agree with one model of this flight."
            return [f"{fit} Where fewer than half agree, it cannot be told which are false."]
        if m.leaping:
            leaps = f"The recorded attitude leaps against the gyroscope at {m.leaps} of {m.fixes}"
            return [
                f"{leaps} fixes. At more than half it cannot be told which of the two is false."
            ]
        return ["There is too little motion with trusted GPS to say what is missing."]
    said = [sized(e) + "." for e in diagnosis.effects]
    said += [f"{capital(c.words)}." for c in diagnosis.inconstant]
    if diagnosis.verdict is Verdict.PARTLY_EXPLAINED:
        more = "what is left is more than noise"
        if diagnosis.mismatch.held_out_after <= NOISE:
            more = "parts of this flight still contradict each other"
        said.append(f"These effects do not explain everything: {more}.")
    if said:
        return said
    if diagnosis.verdict is Verdict.CLEAN:
        where = WHERE_BELIEVED if diagnosis.unused else ""
        return [f"Scale, offset and timing explain this flight down to the noise{where}."]
    return ["The residual is not noise, but no effect of the catalogue fits it."]


def sized(effect: Finding) -> str:
    """An effect with its size: ``GPS is late by 259 ± 8 ms``."""
    if not is_named(effect.name):
        return f"{title_of(effect.name)}: {effect.formula}"
    size = size_of(effect)
    if not size:
        return title_of(effect.name)
    joint = " " if size.startswith(("by ", "at ", "over ", "of ")) else ": "
    return f"{title_of(effect.name)}{joint}{size}"


def proof(diagnosis: Diagnosis) -> str:
    """How sure: the residual on data that were not fitted, before and after."""
    m = diagnosis.mismatch
    if diagnosis.split:
        return "What each recording says by itself was compared; nothing else is said of both."
    if diagnosis.verdict is Verdict.INSUFFICIENT:
        return "Nothing could be tested: no effect was accepted or ruled out."
    before, after = m.held_out_velocity_before, m.held_out_velocity_after
    noise = m.held_out_after
    if not (math.isfinite(before) and math.isfinite(after) and math.isfinite(noise)):
        return "The residual could not be judged on data not used in the fit."
    rests = f" ({m.fixes} of {m.believed} fixes)" if m.believed else ""
    where = f"On parts of the flight that the fit did not use{rests}"
    said = f"{where}, the predicted velocity differs from GPS by {number(after, 2)} m/s"
    if noise > NOISE:
        said += f", {noise:.1f} times what noise would leave"
    elif diagnosis.verdict in (Verdict.CLEAN, Verdict.EXPLAINED):
        said += ", which is no more than noise"
    if diagnosis.verdict is not Verdict.CLEAN:
        said += f"; it was {number(before, 2)} m/s with scale and offset only"
        said += f" ({fall(before, after)})"
    said += "."
    if diagnosis.ambiguous:
        said += " Some effects could not be told apart, see below."
    return f"{said} {at_rest(diagnosis.calibration)}".rstrip()


def at_rest(calibration: Calibration) -> str:
    """What the accelerometer reads where its vehicle stands; empty if nobody saw it standing."""
    r = calibration.at_rest
    if r is None:
        return ""
    now = f"{signed(r.estimate, 3)} ± {fixed(r.sigma, 3)} with the estimate"
    off = f"{signed(r.in_force, 3)} m/s² as it is and {now}"
    return f"At rest, which the fit did not use, the accelerometer is off gravity by {off}."


def fall(before: float, after: float) -> str:
    """By how much something has become less: ``−47 %``."""
    if not (math.isfinite(before) and math.isfinite(after)) or before <= 0.0:
        return "not known"
    change = 100.0 * (after / before - 1.0)
    return f"{signed(change, 0) if abs(change) >= 0.5 else '0'}\u00a0%"


def cures(diagnosis: Diagnosis, advice: Advice | None = None) -> list[str]:
    """What to do, one sentence for each effect, then what the calibration is good for.

    ``advice`` says which parameters may be set; without it none is named.
    """
    if diagnosis.split:
        return ["Explain each recording by itself; onboard replay merges what they say of the six."]
    if diagnosis.verdict is Verdict.INSUFFICIENT:
        fly = to_fly(diagnosis) or ["Fly again, with accelerations, turns and climbs."]
        return fly if diagnosis.silent or advice is None else [about_six(advice), *fly]
    out = []
    for e in diagnosis.effects:
        settings = "" if advice is None else _named(e, advice)
        why = "" if advice is None or not settings else advice.against.get(e.name, "")
        if why:
            out.append(_sentence(e.cure, ""))
            out.append(f"Do not set {settings} yet: {why}.")
        elif e.cure or settings:
            out.append(_sentence(e.cure, settings))
    if not out:
        out = _without_cure(diagnosis)
    if advice is not None:
        out.append(about_six(advice))
    return list(dict.fromkeys(s for s in out if s))


def about_six(advice: Advice) -> str:
    """Whether to set the six, in a sentence."""
    if advice.plan is not None and advice.settable:
        shown = [c.name for c in advice.plan.changes if not c.kept]
        if len(shown) < len(advice.plan.changes):
            return f"Set {listed(shown)}; the rest stays as it is."
        return "Set the calibration parameters."
    # One reason is enough where the other only follows from it.
    lacking = any(r.objection is Objection.PHYSICS_MISSING for r in advice.refusals)
    follows = {r.sentence for r in advice.refusals if r.objection is Objection.NOT_CALIBRATED}
    told = [
        sentence.removeprefix(PHYSICS_MISSING)
        for sentence in advice.reasons
        if not (lacking and sentence in follows)
    ]
    return f"Leave the calibration parameters as they are: {'; '.join(told)}."


def _without_cure(diagnosis: Diagnosis) -> list[str]:
    if diagnosis.effects:
        return ["No parameter can correct what was found."]
    if diagnosis.verdict is Verdict.CLEAN:
        return ["Nothing has to be changed beyond the calibration itself."]
    return ["Look for a cause where the residual is largest."]


def _named(effect: Finding, advice: Advice) -> str:
    return ", ".join(
        f"{advice.names.get(n, n)} = {setting(v)}"
        for n, v in effect.parameters.items()
        if math.isfinite(v)
    )


def _sentence(cure: str, settings: str) -> str:
    text = capital(cure.rstrip(".")).replace("None:", "Nothing:")
    if not settings:
        return f"{text}." if text else ""
    return f"{text}: {settings}." if text else f"Set {settings}."


def to_fly(diagnosis: Diagnosis) -> list[str]:
    """What this flight did not show, each with what to fly: sentences."""
    if diagnosis.split:  # which is the note
        return []
    if _unasked(diagnosis):
        return [f"{capital(diagnosis.calibration.coverage.advice)}."]
    return [s for s in _sentences(diagnosis.note) if ":" in s]


def _unasked(diagnosis: Diagnosis) -> bool:
    """Whether there was no flight to ask: the note says what there was, the coverage what to do."""
    return not len(diagnosis.series.t) and bool(diagnosis.calibration.coverage.advice)


def remarks(diagnosis: Diagnosis) -> list[str]:
    """What else there is to say: the other sentences of the note, and what was not used."""
    if diagnosis.split:  # which is the note
        return []
    above = (*SAID_ABOVE, *(capital(c.words) for c in diagnosis.inconstant))
    every = [s for s in _sentences(diagnosis.note) if ":" not in s or _unasked(diagnosis)]
    out = [s for s in every if not s.startswith(above)]
    return out + unused_in_words(diagnosis)


def unused_in_words(diagnosis: Diagnosis) -> list[str]:
    """Flight that was not used, one sentence for each reason: how long, when, why, what it was."""
    out = []
    for reason in dict.fromkeys(u.reason for u in diagnosis.unused):
        mine = [u for u in diagnosis.unused if u.reason == reason]
        whole = sum(u.end_s - u.start_s for u in mine)
        when = list(dict.fromkeys(map(_when, mine)))
        many = len(when) - MOST_SPANS
        more = f" and {many} more time{'s' if many > 1 else ''}" if many > 0 else ""
        why = DISTRUST.get(reason, reason.replace("_", " "))
        long = f"{whole:.0f} s of flight were" if whole >= 1.5 else "About a second of flight was"
        said = f"{long} not used ({', '.join(when[:MOST_SPANS])}{more}; {why})"
        if any(u.contradicted for u in mine):
            said += ": inertia contradicts GPS there"
        elif any(u.contradicted is False for u in mine):
            said += ": nothing there contradicts GPS"
        out.append(f"{said}.")
    return out


def _when(unused: Unused) -> str:
    start, end = f"{unused.start_s:.0f}", f"{unused.end_s:.0f}"
    return f"at {start} s" if start == end else f"{start} to {end} s"


def _sentences(note: str) -> list[str]:
    parts = (p.strip() for p in re.split(r"(?<=\.)\s+", note))
    # A calibration that points here is no news here.
    return [capital(p) for p in parts if p and "see onboard explain" not in p]


def strength(delta_bic: float) -> str:
    """Words for a difference of BIC, after Kass and Raftery (1995)."""
    if not math.isfinite(delta_bic):
        return "evidence not known"
    gain = -delta_bic
    if gain > 10.0:
        return "very strong evidence"
    if gain > 6.0:
        return "strong evidence"
    if gain > 2.0:
        return "some evidence"
    return "weak evidence"


def surely(effect: Finding, *, ambiguous: bool) -> str:
    """How sure one effect is, as a sentence."""
    if is_excluded(effect.name):
        return f"It is visible in the measurements; {treated_of(effect.name)}."
    text = strength(effect.delta_bic).capitalize()
    before, after = effect.held_out_velocity_before, effect.held_out_velocity_after
    if math.isfinite(before) and math.isfinite(after) and before > 0.0:
        change = "lowers" if after <= before else "raises"
        text += f"; it {change} the velocity error on flight not used in the fit by "
        text += f"{fixed(abs(100.0 * (1.0 - after / before)), 0)} %"
    if ambiguous:
        text += "; but this flight cannot tell it from another effect"
    return text + "."
