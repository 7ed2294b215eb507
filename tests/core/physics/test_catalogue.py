"""The catalogue, walked: every effect states everything, and everything that is stated holds."""

import string
from pathlib import Path

import numpy as np
import pytest

from onboard.core.diagnosis.nuisance_effects import nuisance_kinds
from onboard.core.inputs.segments import SLOW_SIGNALS
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.regressors import Family, Model
from onboard.core.physics import catalogue as found
from onboard.core.physics import effects
from onboard.core.physics.catalogue import catalogue, kinds, phrase_of, size_of, title_of
from onboard.core.physics.effect import STATEMENTS, Bearing, Effect, Origin
from onboard.core.physics.effects.bias_step import BiasStep
from onboard.core.physics.effects.empirical import Empirical
from onboard.core.physics.effects.offset_wander import OffsetWander
from onboard.core.physics.effects.scale_step import ScaleStep
from onboard.core.physics.finding import Finding, Quantity
from onboard.errors import OnboardError
from sitl.builtin.effects import ALL

ORIGIN = Origin(t0=10.0)
WAYS = ("acceleration", "rate", "velocity", "position", "attitude")
every = pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.effect)


def placed(kind):
    """The effect as a candidate: a jump has its moment, a formula its signal, a wander a flight."""
    effect = kind(ORIGIN)
    if isinstance(effect, BiasStep | ScaleStep):
        return effect.at(40.0, sigma=0.5)
    if isinstance(effect, Empirical):
        return effect.of("one", "1", lambda nodes: np.ones(nodes.t.shape))
    if isinstance(effect, OffsetWander):
        return effect.along(0.0, 100.0, np.full(3, 0.1), 4)
    return effect


def finding(kind, value, unit="m/s^2"):
    keys = placed(kind).keys or ("x",)
    size = {key: Quantity(value, 0.01 * abs(value), unit) for key in keys}
    if kind in {BiasStep, ScaleStep}:
        size["time"] = Quantity(40.0, 0.5, "s")
    return Finding(kind.effect, size, 0.5, -100.0, 2.0, 1.0, {}, kind.cure)


def test_a_file_holds_one_effect_of_its_own_name():
    folder = Path(effects.__path__[0])
    files = sorted(path.stem for path in folder.glob("*.py") if path.stem != "__init__")
    assert files == sorted(kind.effect for kind in kinds())
    assert all(kind.__module__.endswith(f".{kind.effect}") for kind in kinds())


@every
def test_it_states_everything_in_its_own_words(kind):
    for statement in STATEMENTS:
        assert statement in vars(kind), statement
        assert vars(kind)[statement], statement
    assert isinstance(kind.bearing, Bearing)
    assert isinstance(kind.code, int)
    assert 0 < kind.code < 90, "0 and those from 90 on say something else in OBC_FINDING"
    assert not kind.title.endswith(".")
    fields = {name for _, name, _, _ in string.Formatter().parse(kind.sentence) if name}
    assert fields <= {"size", "degrees"}


def test_no_two_are_alike():
    for statement in ("effect", "code", "title"):
        stated = [getattr(kind, statement) for kind in kinds()]
        assert len(set(stated)) == len(stated), statement
    unknowns = [u.name for kind in kinds() for u in placed(kind).unknowns]
    assert len(set(unknowns)) == len(unknowns)


@every
def test_it_is_looked_for_in_some_way_or_says_why_not(kind):
    effect = placed(kind)
    ways = [bool(effect.unknowns), bool(kind.in_every_model), kind.excluded, bool(kind.untestable)]
    assert any(ways)
    acts = [way for way in WAYS if getattr(kind, way) is not getattr(Family, way)]
    assert bool(acts) == bool(effect.unknowns), "unknowns that do nothing, or the other way round"


@every
def test_its_unknowns_have_names_units_bounds_and_priors(kind):
    effect = placed(kind)
    assert len(effect.keys) == len(effect.plausible) <= len(effect.unknowns)
    for unknown in effect.unknowns:
        assert unknown.unit
        assert unknown.prior == 0.0, "an effect that nobody has seen is nothing"
        assert 0.0 < unknown.prior_sigma < np.inf
    for unknown, bound in zip(effect.unknowns, effect.plausible, strict=False):
        assert unknown.prior_sigma <= bound * 1.5
    assert set(kind.needs) <= set(SLOW_SIGNALS)


@pytest.mark.parametrize("kind", [BiasStep, ScaleStep, Empirical, OffsetWander])
def test_what_has_no_moment_and_no_formula_yet_is_in_no_model(kind):
    with pytest.raises(OnboardError, match=kind.effect):
        Model([kind(ORIGIN)])
    assert Model([placed(kind)]).size == len(placed(kind).unknowns) > 0


def test_those_of_every_model_know_what_nothing_is():
    point = Linearisation(delay=0.1, window=0.2, attitude_delay=0.03, heading=0.04)
    for kind in nuisance_kinds().values():
        absent = kind.absent(point, told=0.1)
        assert set(absent) == set(kind.in_every_model)
    attitude = {u for kind in nuisance_kinds().values() for u in kind.in_every_model}
    assert attitude >= {"attitude_delay", "tilt_roll", "tilt_pitch", "heading"}


@every
@pytest.mark.parametrize("value", [0.3, -0.02, float("nan")])
def test_it_can_be_said(kind, value):
    made = finding(kind, value)
    said = phrase_of(made)
    assert said.endswith(f"({kind.effect})")
    assert "{" not in said
    assert "nan" not in size_of(made)
    assert title_of(kind.effect) == kind.title


@every
def test_what_spoils_every_number_says_when_each_holds_or_leaves_the_flight_out(kind):
    conditional = kind.condition(finding(kind, 0.1), 0.2, 0.1)
    if kind.bearing is Bearing.NO_ONE_NUMBER and not kind.excluded:
        assert "0.2000" in conditional
    else:
        assert conditional == ""


@every
def test_its_cure_names_parameters_by_name(kind):
    cure = placed(kind).cured(dict.fromkeys(placed(kind).keys, 0.1))
    assert cure.words
    assert all(name.isupper() and np.isfinite(value) for name, value in cure.parameters.items())


def test_everything_but_a_formula_can_be_concealed():
    concealed = {kind.name for kind in ALL}
    assert {kind.effect for kind in kinds() if kind.named} <= concealed


@pytest.mark.parametrize("left_out", STATEMENTS)
def test_one_that_leaves_a_statement_out_cannot_be_defined(left_out):
    stated = {name: getattr(BiasStep, name) for name in STATEMENTS if name != left_out}
    with pytest.raises(TypeError, match=left_out):
        type("Forgetful", (Effect,), stated)


def test_two_of_one_name_are_noticed(monkeypatch):
    class Again(BiasStep):
        effect, code, title, sentence, meaning = "bias_step", 95, "x", "x", "x"
        bearing, source, cure, apart = Bearing.WITHIN, "x", "x", "x"

    Again.__module__ = BiasStep.__module__
    module = __import__(BiasStep.__module__, fromlist=["BiasStep"])
    monkeypatch.setattr(module, "Again", Again, raising=False)
    with pytest.raises(TypeError, match="bias_step"):
        found.kinds.__wrapped__()


def test_an_effect_of_another_version_forbids_and_is_read_as_words():
    assert found.bearing_of("flux_capacitor") is Bearing.NO_ONE_NUMBER
    assert title_of("flux_capacitor") == "flux capacitor"
    assert len(catalogue(ORIGIN)) == len(kinds())
