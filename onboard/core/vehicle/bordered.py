"""Normal equations of unknowns in groups that meet only in what all of them share.

Of several flights each has unknowns of its own, which no other flight's rows speak of, so that the
matrix is block-diagonal with a border (*arrow* form).  Groups are eliminated one by one (Schur
complements; G. H. Golub and C. F. Van Loan, *Matrix Computations*, 2013, section 3.2.11), and what
is left is as large as what is shared, however many flights there are.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array

Places = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Bordered:
    """A system ``N x = b``, and what each group takes of what is shared.

    Attributes:
        N: (f, f).
        b: (f,).
        shared: places of what no group has to itself.
        groups: places of each, by its number.
        told: of each, (s, s) and (s,) that its elimination takes from the shared ones.
    """

    N: Array
    b: Array
    shared: Places
    groups: Mapping[int, Places]
    told: Mapping[int, tuple[Array, Array]]

    @classmethod
    def of(cls, N: Array, b: Array, groups: Mapping[int, Places]) -> Bordered:
        """Eliminate each group, which has no number in N in common with any other."""
        every = np.concatenate([*groups.values(), np.zeros(0, np.intp)])
        shared = np.setdiff1d(np.arange(len(b)), every)
        told = {}
        for number, its in groups.items():
            border = N[np.ix_(its, shared)]
            by = np.linalg.solve(N[np.ix_(its, its)], np.column_stack([border, b[its]]))
            told[number] = border.T @ by[:, :-1], border.T @ by[:, -1]
        return cls(N, b, shared.astype(np.intp), groups, told)

    def keeping(self, numbers: Collection[int]) -> tuple[Places, Array, Array]:
        """The system of the shared ones and of these groups: their places, N and b."""
        kept = [self.shared, *(self.groups[k] for k in sorted(numbers))]
        places, s = np.concatenate(kept), len(self.shared)
        N, b = self.N[np.ix_(places, places)].copy(), self.b[places].copy()
        for k, (its_N, its_b) in self.told.items():
            if k not in numbers:
                N[:s, :s] -= its_N
                b[:s] -= its_b
        return places, N, b
