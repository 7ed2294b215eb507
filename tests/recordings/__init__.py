"""Tests of ``recordings``."""
