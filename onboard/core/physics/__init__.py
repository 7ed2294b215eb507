"""The catalogue of physics that a model may lack: one module per family of effects.

To add an effect: write a module with a subclass of
:class:`onboard.core.physics.effect.EffectColumns` and name it in
:mod:`onboard.core.physics.catalogue`.
"""
