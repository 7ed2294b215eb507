from __future__ import annotations

import gc
from dataclasses import MISSING, fields
from typing import get_args

import pytest

from onboard.core.inputs.samples import AttitudeSample, Sample
from onboard.recordings.bulk import no_collection, samples_of


@pytest.mark.parametrize("kind", get_args(Sample))
def test_many_at_once_are_what_the_constructor_makes(kind):
    needed = sum(field.default is MISSING for field in fields(kind))
    for width in range(needed, len(fields(kind)) + 1):
        columns = [[float(row + 10 * k) for row in range(5)] for k in range(width)]
        assert samples_of(kind, *columns) == [kind(*row) for row in zip(*columns, strict=True)]
    assert not hasattr(kind, "__post_init__")


def test_columns_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match="one length"):
        samples_of(AttitudeSample, [1.0], [1.0], [1.0], [1.0, 2.0])
    with pytest.raises(ValueError, match="not those of"):
        samples_of(AttitudeSample, [1.0], [1.0], [1.0])
    with pytest.raises(ValueError, match="not those of"):
        samples_of(AttitudeSample, *[[1.0]] * 6)


def test_the_collector_is_left_as_it_was():
    with no_collection():
        assert not gc.isenabled()
        with no_collection():
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()
