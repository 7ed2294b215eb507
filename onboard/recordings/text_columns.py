"""Columns of text as recordings have them: bytes of one length, of which a zero ends the text."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def until_nul(texts: NDArray[np.bytes_]) -> NDArray[np.bytes_]:
    """(n,) texts (of type S) without what stands behind the first zero byte of each."""
    width = texts.dtype.itemsize
    octets = np.ascontiguousarray(texts).view(np.uint8).reshape(-1, width)
    ended = np.logical_or.accumulate(octets == 0, axis=1)
    cut: NDArray[np.bytes_] = np.where(ended, 0, octets).astype(np.uint8).view(texts.dtype)[:, 0]
    return cut
