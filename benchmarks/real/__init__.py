"""The estimator and the diagnosis on real flights: ``python -m benchmarks.real``.

Nobody knows the truth about a real flight, but much can be asked without it: whether the whitened
residuals are white (:mod:`~benchmarks.real.levels`), whether two accelerometers on one board agree
(:mod:`~benchmarks.real.pairs`), whether flights of one vehicle agree
(:mod:`~benchmarks.real.repeats`), and whether an error that was put into a recording comes out
again as the *difference* to what the untouched recording gave (:mod:`~benchmarks.real.conceal`).

Which flights may be looked at for what is decided once, in :mod:`~benchmarks.real.split`.
"""
