"""The whitening filter: the paper's criterion as its special case, and rows that are white."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.filter.innovations import Epoch, steps
from onboard.core.filter.limits import ATTITUDE_TIME_S, COLOUR_TIME_S
from onboard.core.filter.noise import ESTIMATED, NoiseLevels
from onboard.core.filter.passes import Pass
from onboard.core.filter.uncertainty import Covariance
from onboard.core.filter.whitening import Uses, WhiteningFilter
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.maths.compiling import prefer_compiled
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import rotation_from_vector
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.nuisances import Six
from onboard.core.model.regressors import Model
from tests.core.criterion import InitialVelocity, IntegralCriterion, Weighting


@pytest.fixture(scope="module", params=["numpy", "compiled"], autouse=True)
def arithmetic(request):
    """Every statement holds whoever does the arithmetic."""
    compiled = request.param == "compiled"
    if compiled:
        pytest.importorskip("numba")
    prefer_compiled(yes=compiled)
    yield
    prefer_compiled()


PAPER = Uses(height=False, attitude=False, recorded_attitude=True, earth=False, gates=False)
SCALE = np.array([1.02, 0.97, 1.01])
BETA = np.array([0.2, -0.1, 0.3])
GRAVITY = np.array([0.0, 0.0, STANDARD_GRAVITY])


def quiet(velocity):
    """Noise of GPS velocity alone."""
    none = dict.fromkeys(ESTIMATED, 1e-12)
    return NoiseLevels(**none | {"velocity": velocity, "vertical": 1.0, "height": 1.0})


def manoeuvres(t):
    """Roll, pitch, yaw and specific force (n, 3) of a flight that turns, climbs and brakes."""
    euler = np.stack([0.7 * np.sin(0.9 * t), 0.3 * np.sin(0.5 * t + 1.0), 0.4 * t], axis=1)
    force = np.stack(
        [1.5 * np.sin(1.3 * t), np.cos(0.7 * t), -9.8 - 9.0 * np.sin(1.1 * t) ** 2], axis=1
    )
    return euler, force


def matrices(euler):
    roll, pitch, yaw = euler.T
    zero = np.zeros_like(roll)
    x, y, z = (
        rotation_from_vector(np.stack(v, axis=1))
        for v in ((roll, zero, zero), (zero, pitch, zero), (zero, zero, yaw))
    )
    return z @ y @ x


def literal_and_whitened(noise, gaps=()):
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 21.0, 1e-3)
    euler, raw = manoeuvres(t)
    R = matrices(euler)
    a = np.einsum("nij,nj->ni", R, SCALE * raw + BETA) + GRAVITY
    gained = np.cumsum(0.5e-3 * (a[1:] + a[:-1]), axis=0)
    v = np.vstack([np.zeros(3), gained]) + np.array([12.0, -3.0, 1.0])
    at = np.arange(400, len(t) - 400, 200)
    v_gps = v[at] + noise * rng.normal(size=(len(at), 3))

    literal = IntegralCriterion(InitialVelocity.ELIMINATED, Weighting.EPOCHS)
    ways = Pass(
        Model([Six(scale_sigma=1e6, beta_sigma=1e6)]),
        Linearisation(delay=0.0),
        (quiet(noise),),
        uses=PAPER,
    )
    segment = Segment(t, np.zeros_like(raw), raw, t, R, np.eye(3))
    pieces = np.split(np.arange(len(at)), gaps)
    for piece in pieces:
        literal.restart()
        fixes = iter(zip(t[at[piece]], v_gps[piece], strict=True))
        fix = next(fixes)
        for i in range(at[piece[0]], at[piece[-1]] + 1):
            literal.specific_force(t[i], raw[i], R[i])
            if fix is not None and t[i] == fix[0]:
                literal.velocity(*fix)
                fix = next(fixes, None)
        n = len(piece)
        ways.restart()
        ways.process(
            segment,
            Fixes(t[at[piece]], v_gps[piece], np.zeros(n), np.zeros(n)),
            np.ones(n, dtype=bool),
        )
    solution = literal.sums.solve()
    return (
        np.array(solution.alpha + solution.beta),
        np.linalg.solve(ways.sums.N[0], ways.sums.b[0]),
        literal.sums.N / noise**2,
        ways.sums.N[0],
    )


@pytest.mark.slow
def test_without_process_noise_windows_add_up_as_in_the_criterion_of_the_paper():
    literal, whitened, N_literal, N_whitened = literal_and_whitened(0.1, gaps=(40, 70))
    truth = np.concatenate([SCALE, BETA])
    assert np.abs(literal - truth).max() > 1e-3  # the noise is felt: agreement is not the truth's
    # What is left is quadrature: 1e-6 of the specific force.
    np.testing.assert_allclose(whitened[:3], literal[:3], rtol=0.0, atol=2e-6)
    np.testing.assert_allclose(whitened[3:], literal[3:], rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(N_whitened, N_literal, rtol=0.0, atol=1e-6 * np.abs(N_literal).max())


@pytest.mark.slow
def test_what_a_fit_leaves_is_chi_square():
    noise, rng = 0.1, np.random.default_rng(5)
    t = np.arange(0.0, 101.0, 5e-3)
    euler, raw = manoeuvres(t)
    R = matrices(euler)
    a = np.einsum("nij,nj->ni", R, SCALE * raw + BETA) + GRAVITY
    v = np.vstack([np.zeros(3), np.cumsum(2.5e-3 * (a[1:] + a[:-1]), axis=0)])
    at = np.arange(200, len(t) - 200, 40)
    n = len(at)
    made = Pass(
        Model([Six(scale_sigma=1e5, beta_sigma=1e5)]),
        Linearisation(delay=0.0),
        (
            NoiseLevels(
                velocity=noise,
                velocity_colour=1e-6,
                force_walk=1e-6,
                lift_walk=1e-6,
                tilt_walk=1e-9,
                jitter=1e-9,
            ),
        ),
        uses=PAPER,
    )
    fixes = Fixes(t[at], v[at] + noise * rng.normal(size=(n, 3)), np.zeros(n), np.zeros(n))
    segment = Segment(t, np.zeros_like(raw), raw, t, R, np.eye(3))
    sums = made.process(segment, fixes, np.ones(n, dtype=bool)).block.sums
    theta = np.linalg.solve(sums.N, sums.b)
    np.testing.assert_allclose(theta[:3], SCALE, atol=0.02)
    # n - 6 degrees of freedom: five sigma either way.
    free = sums.rows - 6
    assert abs(sums.residual(theta) - free) < 5.0 * np.sqrt(2.0 * free)


LEVELS = NoiseLevels(
    velocity=0.05,
    velocity_colour=0.04,
    height=0.3,
    height_walk=0.1,
    force_walk=0.05,
    lift_walk=0.12,
    shaken_walk=0.8,
    shaken_lift=0.5,
    tilt_walk=1e-3,
    bias_walk=1e-4,
    attitude=0.01,
    heading=0.03,
    attitude_white=4e-3,
    jitter=0.02,
    stated=0.6,
    stated_colour=1.1,
)
STATED = (0.2, 12.0)
"""Square of the accuracy that the receiver states, by turns for so many fixes."""
STATED_EPOCHS = 15
ACCELERATION = np.array([0.0, 4.0, 0.0])
"""That the moment's jitter is multiplied by; one axis, for the filter takes axes one by one."""
DT, SUB = 0.01, 10
BLOW_EVERY, BLOW_SIGMA = 7, np.array([0.2, 0.1, 0.3, 0.02, 0.01, 0.03])
"""Steps; and what their samples miss: m/s and rad, body axes."""
GUST_STEPS, GUST = 20, np.array([0.01, 0.03, 0.2])
"""Steps that it lasts, by turns with as many without; (m/s^2)^2 s, body axes."""
START_SIGMA = 0.02


def rows_of_its_own_model(seed, epochs, levels=LEVELS):
    """Whitened rows (epochs, 7) on data that are drawn from the filter's model."""
    rng = np.random.default_rng(seed)
    normal = rng.normal
    T = DT * SUB
    R = np.eye(3)
    v, h = np.array([5.0, 2.0, 0.0]), 100.0
    bias = 0.01 * normal(size=3)
    slow = np.array([levels.attitude, levels.attitude, levels.heading])
    time = levels.heading_time

    def stated(k):
        return STATED[k // STATED_EPOCHS % 2]

    error, wander = slow * normal(size=3), 0.0
    colour = stated(0) ** (levels.stated_colour / 2) * levels.velocity_colour * normal(size=3)
    turning = slow[2] / time * normal()  # rad/s, of the error of the heading
    # One unknown, which is one: the specific force itself.
    filter_ = WhiteningFilter(1, (levels,), Uses(earth=False, gates=False))
    theta = np.ones(1)

    def epoch(k):
        read = rotation_from_vector(error + levels.attitude_white * normal(size=3)) @ R
        ned = np.zeros((7, 2))
        late = levels.jitter * normal()
        white = stated(k) ** (levels.stated / 2) * levels.velocity * normal(size=3)
        ned[:3, 0] = v + colour + white + late * ACCELERATION
        ned[3, 0] = h + wander + levels.height * normal()
        return Epoch(
            k * T,
            velocity=ned[:3, 0],
            height=ned[3, 0],
            latitude=0.0,
            R_attitude=read,
            body=np.zeros((9, 2)),
            ned=ned,
            along_velocity=np.zeros(1),
            trusted=True,
            moving=np.append(ACCELERATION**2, np.zeros(4)),
            stated=stated(k),
        )

    filter_.start(
        epoch(0), rotation_from_vector(START_SIGMA * normal(size=3)), START_SIGMA, START_SIGMA
    )
    out = []
    for k in range(epochs):
        P, force, to_end, mean = np.eye(3), np.zeros(3), np.zeros(3), np.zeros((3, 3))
        gust = GUST * (k // GUST_STEPS % 2)
        for i in range(SUB):
            t = k * T + (i + 0.5) * DT
            w = np.array([0.5 * np.sin(t), 0.3 * np.cos(0.7 * t), 0.4])
            f = np.array([2.0 * np.sin(0.9 * t), np.cos(1.3 * t), -9.8 - 2.0 * np.sin(0.6 * t)])
            # Truth, and what gyroscope and accelerometer make of it: the same quadrature.
            a = R @ rotation_from_vector(w * DT / 2) @ f + GRAVITY
            h -= v[2] * DT + 0.5 * a[2] * DT**2
            v = v + a * DT
            R = R @ rotation_from_vector(w * DT)
            w_read = w + bias + levels.tilt_walk * normal(size=3) / np.sqrt(DT)
            f_read = f + np.sqrt(levels.walk_shaken(gust) / DT) * normal(size=3)
            middle = P @ rotation_from_vector(w_read * DT / 2)
            force, mean = force + middle @ f_read * DT, mean + middle * DT
            to_end = to_end + (T - (i + 0.5) * DT) * (middle @ f_read) * DT
            P = P @ rotation_from_vector(w_read * DT)
            bias = bias + levels.bias_walk * np.sqrt(DT) * normal(size=3)
        keep = np.exp(-T / ATTITUDE_TIME_S)
        error[:2] = keep * error[:2] + np.sqrt(1 - keep**2) * slow[:2] * normal(size=2)
        for _ in range(SUB):
            # Critically damped, and driven: in steps so small that Euler's are good enough.
            driven = 2.0 * (1.0 / time) ** 1.5 * slow[2] * normal() * np.sqrt(DT)
            turning += driven - (2.0 * turning / time + error[2] / time**2) * DT
            error[2] += turning * DT
        keep = np.exp(-T / COLOUR_TIME_S)
        size = stated(k + 1) ** (levels.stated_colour / 2) * levels.velocity_colour
        driven = size * normal(size=3)
        colour = keep * colour + np.sqrt(1 - keep**2) * driven
        wander += levels.height_walk * np.sqrt(T) * normal()
        missed = BLOW_SIGMA if k % BLOW_EVERY == 0 else np.zeros(6)
        v = v + R @ P.T @ (missed[:3] * normal(size=3))
        R = R @ P.T @ rotation_from_vector(missed[3:] * normal(size=3)) @ P
        both = np.stack([force, to_end])
        stack = np.stack([np.zeros(9), np.concatenate([*both, np.zeros(3)])], axis=1)
        integrals = (P, both, mean, stack, missed**2, T * gust)
        leads_to = np.array([stated(k + 1)])
        step = steps(np.array([T]), *(x[None] for x in integrals), leads_to)[0]
        filter_.predict(step, theta, 0.0)
        made = filter_.update(epoch(k + 1), theta, Covariance(np.zeros((1, 1))))
        out.append(made.y[0] - made.h[0] @ theta)
    return np.array(out)


@pytest.fixture(scope="module")
def white(arithmetic):
    return [rows_of_its_own_model(seed, 500) for seed in range(4)]


@pytest.mark.slow
def test_rows_have_unit_variance(white):
    y = np.vstack(white)
    n = len(y)
    assert np.abs(np.mean(y**2, axis=0) - 1.0).max() < 4.5 * np.sqrt(2.0 / n)
    assert abs(np.mean(y**2) - 1.0) < 4.5 * np.sqrt(2.0 / y.size)


@pytest.mark.slow
def test_rows_are_independent(white):
    n = sum(map(len, white))
    for lag in (0, 1, 2, 5, 20):
        product = sum(y[: len(y) - lag].T @ y[lag:] for y in white) / n
        if lag == 0:
            product = product - np.diag(np.diag(product))
        # 49 numbers at a time, each with a standard deviation of 1 / sqrt(n).
        assert np.abs(product).max() < 5.0 / np.sqrt(n), lag


@pytest.mark.slow
def test_the_likelihood_prefers_the_levels_that_made_the_data():
    """``chi^2 + log det`` of the right levels is the lowest of its neighbours'."""
    rng = np.random.default_rng(1)
    n = 300
    walks = np.array([0.1, 0.1, 0.2])
    v = np.cumsum(walks * np.sqrt(0.2) * rng.normal(size=(n, 3)), axis=0)
    reads = v + 0.1 * rng.normal(size=(n, 3))
    t = np.arange(0.0, 61.0, 0.02)
    still = np.tile([0.0, 0.0, -STANDARD_GRAVITY], (len(t), 1))
    R = np.broadcast_to(np.eye(3), (len(t), 3, 3))
    segment = Segment(t, np.zeros((len(t), 3)), still, t, R, np.eye(3))
    fixes = Fixes(0.5 + 0.2 * np.arange(n), reads, np.zeros(n), np.zeros(n))
    bank = tuple(
        replace(quiet(velocity), force_walk=walk, lift_walk=lift)
        for velocity, walk, lift in (
            (0.1, 0.1, 0.2),
            (0.05, 0.1, 0.2),
            (0.2, 0.1, 0.2),
            (0.1, 0.05, 0.2),
            (0.1, 0.2, 0.2),
            (0.1, 0.1, 0.1),
            (0.1, 0.1, 0.4),
        )
    )
    made = Pass(
        Model([Six(scale_sigma=1e-6, beta_sigma=1e-6)]), Linearisation(delay=0.0), bank, uses=PAPER
    )
    made.process(segment, fixes, np.ones(n, dtype=bool))
    likelihoods = made.log_likelihoods()
    assert np.argmax(likelihoods) == 0
