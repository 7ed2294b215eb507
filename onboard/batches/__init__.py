"""Many recordings: the processes that replay them, the store of their results, a cluster, a table.

What is said of them is not here (:mod:`onboard.answers.fleet`); a recording gives the same record,
to the last digit, whoever replays it and beside how many others: always a process of its own, with
one thread of linear algebra.
"""
