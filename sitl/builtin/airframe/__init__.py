"""Airframes with physics of their own: drag, wind, motors, battery, lift.

Attitude and thrust are solved for from the motion (inverse dynamics), so that forces balance
exactly; nothing here knows the estimator, and the estimator nothing of this.
"""
