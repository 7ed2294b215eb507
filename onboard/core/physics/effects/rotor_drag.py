"""The drag of a multicopter's rotors."""

from __future__ import annotations

from onboard.core.physics.effect import Bearing, Effect


class RotorDrag(Effect):
    """Force along the rotor disc in proportion to the speed through the air."""

    effect = "rotor_drag"
    code = 20
    title = "The rotors drag in the wind"
    sentence = "the rotors drag in the wind"
    meaning = "never tested: it needs a model of the vehicle"
    bearing = Bearing.WITHIN
    source = "induced drag of a rotor in translation, linear in the air-relative velocity"
    cure = "model the vehicle's drag; its sensors are not the cause"
    apart = "fly fast with and against the wind"
    untestable = "needs a model of the vehicle; sensors alone do not show it"
