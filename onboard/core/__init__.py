"""The pure core: numpy only, no clock, no asyncio, no sockets, no MAVLink.

Where numba is installed and wanted it compiles the filter's innermost loops: that is a compiler, no
input or output, and nothing depends on it (:mod:`onboard.core.filter.kernel`).

Samples enter through :class:`onboard.core.estimate.calibrator.Calibrator`, whether they come
from a live link or from a recording; results leave it as frozen records.

Glossary.  A suffix names the frame: ``n`` north-east-down (NED), ``b`` body (forward-right-down),
``s`` sensor (the board's axes).  ``R_ab`` takes components in b to components in a.  Everything
is SI and radians; times are seconds on the autopilot's boot clock.  "Source" is the module that
owns the symbol.

==============  ============================================  =============  =====  ================
symbol          meaning                                       unit           frame  source
==============  ============================================  =============  =====  ================
raw_s           specific force before any calibration         m/s^2          s      inputs.segments
scale, offset   calibration parameters:                       1, m/s^2       s      maths.accelero-
                f_s = scale (raw_s - offset)                                        meter
beta            -scale offset: f_s = scale raw_s + beta       m/s^2          s      the same
"six"           (scale, beta) or (scale, offset), x y z each  1, m/s^2       s      the same
f_b             specific force R_bs f_s                       m/s^2          b      model.quadrature
w_b             angular rate of the gyroscope less its bias   rad/s          b      model.quadrature
R_bs            board orientation (AHRS_ORIENTATION)          -              s->b   maths.board_ori-
                                                                                    entation
R_nb            attitude                                      -              b->n   maths.frames
v_n             velocity over ground                          m/s            n      inputs.segments
g               gravity, 9.80665 m/s^2 down                   m/s^2          n      maths.earth
w_ie, w_en      rotation of the earth, and of NED with it     rad/s          n      maths.earth
lever arm       accelerometer to GPS antenna                  m              b      inputs.segments
delay           GPS latency: fix at stamp t is of t - delay   s              -      model.linearisa-
                                                                                    tion
window          averaging span of the receiver's velocity     s              -      the same
attitude_delay  lateness of the recorded attitude             s              -      the same
heading         how much too large the recorded yaw is        rad            n      the same
theta           (m,) unknowns of a model about its            of each        -      model.regressors
                linearisation
regressor       change of a measurement per unit of an        measured unit  -      model.regressors
                unknown (called column in arrays)             / unknown's
P(tau)          body axes at tau to those of the step's       -              b      model.quadrature
                start (elsewhere P is a covariance)
X               state's mean at theta = 0, and regressors;    of the state   n      filter.kernel
                the mean at theta is X (1, -theta)
P               covariance of the state                       squared        n      filter.whitening
psi             attitude error, rotation vector               rad            n      filter.state
E               innovation at theta = 0, and regressors       m/s, m, rad    n      filter.kernel
S, L            covariance of an innovation, L L^T = S        squared        n      filter.kernel
y, h            whitened innovation y - h theta: L^-1 E       1, 1/unknown   -      filter.kernel
NIS             normalised innovation squared, r^T S^-1 r     1              -      filter.innova-
                                                                                    tion_gates
N, b, s         sums of h^T h, h^T y, y^2 over a block        of theta       -      maths.sums
G               expected part of N that is noise in the       as N           -      filter.regres-
                regressors (errors in variables)                                    sor_noise
rows            number of whitened innovations in a sum       1              -      maths.sums
variance        factor by which residuals of blocks scatter   1              -      estimate.solu-
inflation       more than the sums say (cluster-robust)                             tion
==============  ============================================  =============  =====  ================

Words: a *segment* is samples of one accelerometer between two moments; a *batch* a segment with
its fixes, processed at once; a *block* the sums of a batch, or of some; a *family* some unknowns of
one piece of physics; a *nuisance* one that is estimated so that it spoils nothing; a *filter bank*
filters with other noise levels side by side; *dead reckoning* velocity without fixes.
"""
