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
