"""What decides something about a fleet: each with its unit and where it comes from."""

from __future__ import annotations

from typing import Final

FALSE_ALARM: Final = 0.01
"""Probability that anything at all is said of a vehicle that has neither drift, step nor odd flight
[probability]."""
CLAIM_DOF: Final = 4.0
"""Degrees of freedom that the claimed sigmas are worth beside the scatter of the flights: the
variance factor of a vehicle is taken to scatter as scaled inverse chi-square with as many, which
has it between 0.36 and 8.3 times in 95 of 100 vehicles [tuned]."""
BESIDE_STEP: Final = 2
"""Flights on either side of a step: one alone is an odd flight [definition]."""
LEAST_WARMTH_K: Final = 5.0
"""K; spread of the flights' temperatures from which a slope on temperature is in the model: across
less, offsets of ordinary sensors change by less than a flight's sigma [data sheet]."""
FEWEST_WARM: Final = 5
"""Flights, from which a slope on temperature leaves something to compare [definition]."""
PLACE_CHI_SQUARE: Final = 3.84
"""0.95 quantile of chi-square with one degree of freedom: places of a step that fit less worse than
that are possible places, too [probability]."""
SHORTEST_SPAN_D: Final = 0.5
"""Days between the first and the last flight, from which a drift per day is asked for
[definition]."""
FEWEST_VEHICLES: Final = 3
"""Of which a scatter between vehicles can be told from the sigmas at all [definition]."""
SHARED_FALSE_ALARM: Final = 0.01
"""Probability that a type is said to share something though none of what was looked at is shared
[probability]."""
WIDE: Final = 100.0
"""Times the prior's sigma: as wide as nothing known, and narrow enough to be solved [cost]."""
