"""Tests of ``sitl``."""
