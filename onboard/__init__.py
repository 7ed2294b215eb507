"""In-flight calibration of the accelerometers of MAVLink autopilots.

Vocabulary, used in every module and not explained again:

Frames
    ``b``  body, x forward, y right, z down (FRD); what MAVLink messages carry
    ``s``  sensor, the accelerometer's own axes: ``x_b = R_bs x_s`` (AHRS_ORIENTATION)
    ``n``  navigation, local north, east, down (NED)

Symbols
    ``f``    specific force (what an accelerometer measures), m/s^2
    ``w``    angular rate, rad/s
    ``v``    velocity over ground, m/s
    ``R_nb`` rotation that takes body components to NED, ``R = Rz(yaw) Ry(pitch) Rx(roll)``
    ``t``    time on the autopilot's boot clock, s

Calibration
    ArduPilot's convention, in the sensor frame: ``f = scale * (raw - offset)``, offset in
    m/s^2.  Estimates, sums and sigmas are those of this ``scale`` and ``offset``.

Units are SI and radians everywhere inside; temperatures are degrees Celsius; other
units exist only where a message or a person needs them and carry it in their name
(``delay_ms``).  Arrays of three are ordered x, y, z (or north, east, down).
"""

__version__ = "0.1.0"
