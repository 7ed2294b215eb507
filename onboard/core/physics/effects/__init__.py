"""The effects: one class in one file each, found here by :mod:`onboard.core.physics.catalogue`."""
