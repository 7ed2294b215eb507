"""Linear algebra in one thread, said before anything loads it."""

import subprocess
import sys

from onboard.threads import ONE_THREAD, in_one_thread


def test_who_has_asked_for_a_number_of_threads_gets_it():
    environment = {"OPENBLAS_NUM_THREADS": "4"}
    in_one_thread(environment)
    assert environment == dict.fromkeys(ONE_THREAD, "1") | {"OPENBLAS_NUM_THREADS": "4"}


def test_the_command_has_not_loaded_numpy_when_it_says_so():
    asked = "import sys, onboard.cli.main; print('numpy' in sys.modules)"
    said = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-c", asked], capture_output=True, text=True, check=True
    )
    assert said.stdout.strip() == "False"


COMPUTING = """
import time
import numpy as np
from onboard.threads import Unawaited, leave

def work():
    a = np.random.default_rng(1).normal(size=(1500, 1500))
    print("computes", flush=True)
    while True:
        np.linalg.solve(a, a)

Unawaited(target=work, name="learner").start()
time.sleep(0.5)
print("ends")
leave(3)
"""


def test_a_process_whose_thread_still_computes_ends_in_good_order():
    """The numeric library takes its memory away from under it: the service ended by SIGSEGV."""
    for _ in range(3):
        ended = subprocess.run(  # noqa: S603 - our own program
            [sys.executable, "-c", COMPUTING], capture_output=True, text=True, check=False
        )
        assert (ended.returncode, ended.stderr) == (3, "")
        assert ended.stdout.split() == ["computes", "ends"]


def test_without_such_a_thread_everything_is_ended_as_ever():
    asked = (
        "import atexit; from onboard.threads import leave; "
        "atexit.register(print, 'tidied'); leave(2)"
    )
    ended = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-c", asked], capture_output=True, text=True, check=False
    )
    assert (ended.returncode, ended.stdout.strip()) == (2, "tidied")
