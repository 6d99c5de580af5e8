"""The module `mechanisms` as its users meet it: `pytest` after `maturin develop` or `pip install`."""

import multiprocessing
import pickle
import threading
import _thread
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import mechanisms
import numpy as np
import pytest
from mechanisms import (
    Ball,
    Block,
    Book,
    CartPole,
    Chain,
    Coin,
    DoublePendulum,
    Engine,
    Gyroscope,
    Particle,
    RollerCoaster,
    Satellite,
)


def pendulum(**changed):
    return DoublePendulum(**{"m1": 1.0, "m2": 1.0, "l1": 1.0, "l2": 1.0, "g": 9.81, **changed})


def chain():
    return Chain(cart=1.0, mass=np.full(10, 0.1), length=[0.15] * 10, g=9.81)


def coaster():
    s = np.linspace(0.0, 40.0, 21)
    y = {"knots": s, "values": 3.0 * np.cos(s / 6.0), "ends": "not-a-knot"}
    return RollerCoaster(mass=500.0, g=9.81, end=40.0, x=(s, 0.95 * s), y=y)


def engine():
    return Engine(
        crank=0.04, rod=0.14, bore=0.08, flywheel=0.3, rod_mass=0.5, rod_inertia=1.5e-3, piston=0.4, load=0.1
    )


def test_a_double_pendulum_keeps_its_energy():
    model = pendulum()
    motion = model.simulate(model.state(theta1=2.0, theta2_rate=0.5), until=10.0, tolerance=1e-10)
    assert motion.t[0] == 0.0 and motion.t[-1] == 10.0
    assert motion.theta1.shape == motion.t.shape and motion.q.shape == (len(motion.t), 2)
    theta1, theta2, u1, u2 = (motion[name] for name in ["theta1", "theta2", "theta1_rate", "theta2_rate"])
    kinetic = u1**2 + 0.5 * u2**2 + u1 * u2 * np.cos(theta1 - theta2)
    energy = kinetic - 9.81 * (2.0 * np.cos(theta1) + np.cos(theta2))
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)
    np.testing.assert_allclose(motion.energy, energy, rtol=1e-12, atol=1e-12)
    assert motion.summary.energy_drift < 1e-9 and motion.summary.steps > 10
    assert "energy" in str(motion.summary)
    assert motion.verify().verified


def test_arrays_come_in_every_form():
    model = chain()
    motion = model.simulate(model.state(theta=np.full(10, 1.6)), until=1.0, every=0.25)
    np.testing.assert_array_equal(motion.t, [0.0, 0.25, 0.5, 0.75, 1.0])
    assert motion.theta.shape == (5, 10)
    columns = motion.to_numpy()
    assert columns["theta_rate"].shape == (5, 10) and columns["centre_of_mass"].shape == (5,)
    table = motion.to_numpy(form="structured")
    assert table.dtype["theta"].shape == (10,) and table["theta"][4, 9] == motion.theta[4, 9]
    matrix = motion.to_numpy(form="matrix")
    assert matrix.shape == (5, len(motion.columns))
    assert matrix[2, motion.columns.index("theta[3]")] == motion.theta[2, 3]
    more = motion.to_numpy([0.1, 0.2], accelerations=True)
    at = motion.at(0.2)
    accelerations = model.accelerations(at)
    assert more["x_acceleration"][1] == accelerations[0]
    np.testing.assert_array_equal(more["theta"][1], at.theta)
    # The centre of mass keeps its place: nothing pushes horizontally.
    np.testing.assert_allclose(motion.get("centre_of_mass", np.linspace(0, 1, 20)), motion.centre_of_mass[0])
    pandas = pytest.importorskip("pandas")
    frame = motion.to_pandas()
    assert isinstance(frame, pandas.DataFrame) and frame["theta[9]"].iloc[-1] == motion.end.theta[9]


def test_parameters_are_attributes_and_motions_keep_theirs():
    model = pendulum()
    start = model.state(theta1=1.0)
    before = model.simulate(start, until=1.0)
    model.m1 = 3
    assert model.m1 == 3.0 and before.model.m1 == 1.0 and "kg" in DoublePendulum.m1.__doc__
    assert model.simulate(start, until=1.0).end != before.end
    assert before.model.simulate(start, until=1.0).end == before.end
    assert model.replace(m1=1.0) == before.model
    masses = chain()
    with pytest.raises(ValueError, match="read-only"):
        masses.mass[0] = 2.0
    masses.mass = np.arange(1.0, 11.0)
    assert masses.mass[9] == 10.0
    assert repr(eval(repr(masses))) == repr(masses)


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda m: DoublePendulum(m1=1.0), TypeError, r"needs m2 \(kg\), l1 \(m\)"),
        (lambda m: DoublePendulum(mass=1.0), TypeError, "no parameter `mass`; its parameters are m1"),
        (lambda m: DoublePendulum(1.0), TypeError, "by name"),
        (lambda m: pendulum(m1="heavy"), TypeError, r"parameter m1 \(kg\): must be real number"),
        (lambda m: setattr(m, "mass", 1.0), AttributeError, "no parameter `mass`"),
        (lambda m: m.state(theta=1.0), TypeError, r"no `theta`; give .* theta1 \(rad\)"),
        (lambda m: m.state(theta1=float("nan")), mechanisms.StateError, "finite"),
        (lambda m: m.state(theta1_guess=1.0), TypeError, "assemble=True"),
        (lambda m: m.state(release="floor"), ValueError, "not a switched constraint"),
        (lambda m: m.simulate(m.state()), TypeError, "until"),
        (lambda m: m.simulate(m.state(), until=1.0, tolerance=-1.0), ValueError, "above 0"),
        (lambda m: m.simulate(m.state(), until=1.0, method="ode45"), ValueError, "methods are rk4"),
        (lambda m: m.simulate(m.state(), until=1.0, method=("dop853", 1.0)), ValueError, "no option"),
        (lambda m: m.simulate(m.state(), until=1.0, inputs=1.0), TypeError, "no inputs"),
        (lambda m: m.simulate(m.state(), until=1.0, inputs=lambda t, s: 1.0), TypeError, "no inputs"),
        (lambda m: m.simulate(m.state(), until=1.0, stop_at="landing"), ValueError, "landing"),
        (lambda m: m.simulate(chain().state(), until=1.0), TypeError, "state of Chain"),
        (lambda m: m.accelerations([1.0, 2.0, 3.0]), ValueError, r"\(2,\) for one state"),
        (lambda m: m.accelerations(np.ones((3, 2)), np.ones((2, 2))), ValueError, "q has 3 rows, u has 2"),
        (lambda m: m.accelerations("what"), TypeError, "numbers are needed"),
        (lambda m: m.evaluate("forces", [0.0, 0.0]), ValueError, "give one of accelerations"),
        (lambda m: m.simulate(m.state(), until=1.0).at(2.0), ValueError, "outside the motion"),
        (lambda m: m.simulate(m.state(), until=1.0).at([0.5, 2.0]), ValueError, "outside the motion"),
        (lambda m: m.simulate(m.state(), until=1.0).theta, AttributeError, "no `theta`; it has t, q, u"),
        (lambda m: m.simulate(m.state(), until=1.0).reaction("rod"), KeyError, "constraints are none"),
        (lambda m: pickle.dumps(m.simulate(m.state(), until=1.0)), TypeError, "not pickled"),
        (lambda m: Chain(cart=1.0, mass=[1.0], length=[0.1] * 10, g=9.81), ValueError, r"\(10,\) is needed"),
        (lambda m: coaster().replace(x=([0.0, 0.0], [1.0, 2.0])), ValueError, "parameter x"),
        (lambda m: mechanisms.Model(), TypeError, "make one of those"),
    ],
)
def test_mistakes_are_named(call, error, text):
    with pytest.raises(error, match=text):
        call(pendulum())


def test_a_failed_run_keeps_what_it_computed():
    model = pendulum()
    with pytest.raises(mechanisms.SimulationError, match="more than 10 steps") as caught:
        model.simulate(model.state(theta1=2.0), until=100.0, max_steps=10)
    error = caught.value
    assert error.kind == "TooManySteps" and error.partial.interval == (0.0, error.time)
    assert error.partial.end == error.state
    crossed = pickle.loads(pickle.dumps(error))
    assert str(crossed) == str(error) and crossed.time == error.time and crossed.partial is None


def test_values_at_many_states():
    model = pendulum()
    rng = np.random.default_rng(1)
    q, u = rng.normal(size=(50, 2)), rng.normal(size=(50, 2))
    alone = [model.accelerations(q[i], u[i]) for i in range(50)]
    np.testing.assert_array_equal(model.accelerations(q, u), alone)
    np.testing.assert_array_equal(model.accelerations(q.tolist(), u[:, :]), alone)
    # Transposed views are read by their strides.
    np.testing.assert_array_equal(model.accelerations(q.T.copy().T, u), alone)
    mass, force = model.mass_matrix(q), model.evaluate("generalized_force", q, u)
    np.testing.assert_allclose(np.linalg.solve(mass, force[..., None])[..., 0], alone, rtol=1e-12, atol=1e-12)
    energy = model.evaluate("energy", q, u)
    assert energy.shape == (50,) and isinstance(model.evaluate("energy", q[0], u[0]), float)
    by_q, by_u = np.moveaxis(model.evaluate("derivatives", q, u), 1, 0)
    h = 1e-6
    step = np.array([h, 0.0])
    difference = (model.accelerations(q + step, u) - model.accelerations(q - step, u)) / (2 * h)
    np.testing.assert_allclose(by_q[:, :, 0], difference, rtol=1e-5, atol=1e-5)
    difference = (model.accelerations(q, u + step) - model.accelerations(q, u - step)) / (2 * h)
    np.testing.assert_allclose(by_u[:, :, 0], difference, rtol=1e-5, atol=1e-5)


def test_a_law_of_inputs_is_called_and_its_exceptions_arrive():
    model = CartPole(cart=1.0, bob=0.2, length=0.5, g=9.81)
    start = model.state(theta=0.1)

    def law(t, state):
        return 40.0 * state.theta + 8.0 * state.theta_rate + 1.0 * state.x + 2.0 * state.x_rate

    motion = model.simulate(start, until=5.0, inputs=law, tolerance=1e-8)
    assert abs(motion.end.theta) < 0.01
    np.testing.assert_allclose(motion.force, [law(s.t, s) for s in map(motion.at, motion.t)], atol=1e-12)
    held = model.simulate(start, until=1.0, inputs={"force": 2.0})
    assert (held.force == 2.0).all()
    assert held.end == model.simulate(model.state(theta=0.1, force=2.0), until=1.0).end

    def fails(t, state):
        return 1.0 / (0.5 - t if t < 0.4 else 0.0)

    with pytest.raises(ZeroDivisionError) as caught:
        model.simulate(start, until=5.0, inputs=fails, tolerance=1e-8)
    assert 0.0 < caught.value.partial.interval[1] <= 0.5
    with pytest.raises(TypeError, match="numbers are needed for force"):
        model.simulate(start, until=1.0, inputs=lambda t, s: "full")
    with pytest.raises(mechanisms.SimulationError, match="force"):
        model.simulate(start, until=1.0, inputs=lambda t, s: float("inf"))


def test_events_and_contacts():
    ball = Ball(mass=0.2, g=9.81)
    start = ball.state(y=1.0, release="floor")
    assert start.released == ["floor"]
    motion = ball.simulate(start, until=4.0, contact={"floor": 0.7})
    assert motion.end.y == 0.0 and motion.end.released == []
    assert motion.reaction("floor", [4.0])[0] == pytest.approx(0.2 * 9.81)
    first = motion.events[0]
    assert first.t == pytest.approx(np.sqrt(2.0 / 9.81)) and first.direction == "falling"
    assert first.after.y_rate == pytest.approx(-0.7 * first.before.y_rate)
    assert motion.summary.energy_lost == pytest.approx(0.2 * 9.81, abs=1e-3)

    # The same rebounds by hand: an event of the run, and an action that returns a changed state.
    def bounce(state):
        return state.replace(y_rate=-0.7 * state.y_rate)

    by_hand = ball.simulate(
        start, until=1.0, events={"floor_is_hit": lambda s: s.y}, on_event={"floor_is_hit": ("falling", bounce)}
    )
    assert by_hand.end.y == pytest.approx(motion.at(1.0).y, abs=1e-8)
    stopped = ball.simulate(start, until=1.0, events={"half": lambda s: s.y - 0.5}, stop_at={"half": "falling"})
    assert stopped.end.y == pytest.approx(0.5) and stopped.summary.stopped_by == "half"

    block = Block(mass=2.0, stiffness=50.0, g=9.81, belt=0.1, static_mu=0.6, kinetic_mu=0.35)
    riding = block.simulate(block.state(x_rate=0.1), until=20.0, stick_slip={"grip": "breakaway"})
    assert any("grip" in event.name for event in riding.events) and len(riding.events) > 4
    assert np.abs(riding.friction).max() <= 0.6 * 2.0 * 9.81 * (1 + 1e-9)


def test_constraints_and_reactions():
    model = engine()
    start = model.state(theta=0.5, theta_rate=100.0, pressure=1e6, phi_guess=0.1, x_guess=0.17, assemble=True)
    with pytest.raises(mechanisms.StateError, match="closure"):
        model.state(theta=0.5, pressure=0.0)
    motion = model.simulate(start, until=0.1, inputs=lambda t, s: 1e6 * (np.sin(s.theta) > 0), max_step=1e-3)
    residual = model.evaluate("residual", motion.q, motion.u, motion.t, np.zeros((len(motion.t), 1)))
    assert np.abs(residual).max() < 1e-12
    reaction = motion.reaction("closure")
    assert reaction.shape == (len(motion.t), 2)
    np.testing.assert_allclose(reaction[:, 1], motion["pin_force.y"], rtol=1e-9, atol=1e-6)
    np.testing.assert_array_equal(motion.pin_force[:, 1], motion["pin_force.y"])


def test_models_in_space_on_splines_and_rolling():
    book = Book(mass=0.8, size=[0.24, 0.17, 0.03])
    motion = book.simulate(book.state(e=[1, 0, 0, 0], e_rate=[0, 0.03, 3.0, 0.03]), until=10.0)
    np.testing.assert_allclose(np.linalg.norm(motion.e, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(motion.momentum, motion.momentum[:1].repeat(len(motion.t), 0), atol=1e-8)
    assert motion.summary.events["turning_over"] >= 2

    top = Gyroscope(mass=0.3, radius=0.04, thickness=0.01, arm=0.05, g=9.81)
    motion = top.simulate(top.state(angles=[0, 1.2, 0], angles_rate=[0, 0, 120.0]), until=1.0)
    assert motion.angles[:, 1].max() > 1.2 and motion.summary.energy_drift < 1e-6

    cart = coaster()
    motion = cart.simulate(cart.state(s=1.0, s_rate=1.0), until=2.0)
    assert motion.summary.energy_drift < 1e-7 and motion.s[-1] > 1.0
    assert cart == pickle.loads(pickle.dumps(cart)) and cart != cart.replace(x=cart.y)

    coin = Coin(mass=5e-3, radius=0.012, g=9.81)
    motion = coin.simulate(coin.state(lean=0.3, spin_rate=20.0, assemble=True), until=1.0)
    slip = coin.evaluate("velocity_residual", motion.q, motion.u)
    assert np.abs(slip).max() < 1e-10

    satellite = Satellite(mass=50.0, size=[0.5, 0.5, 0.8], wheel=1.0, radius=0.1)
    at_rest = satellite.state(e=[1, 0, 0, 0], motors=[0.0, 0.0, 0.01])
    motion = satellite.simulate(at_rest, until=10.0)
    assert motion.wheels.shape[1] == 3 and abs(motion.end.wheels_rate[2]) > 1.0
    np.testing.assert_allclose(motion.momentum, 0.0, atol=1e-9)

    # E × B drift: the mean velocity of a proton.
    proton = Particle(mass=1.6726219e-27, charge=1.6021766e-19, magnetic=[0, 0, 0.5], electric=[0, 1e4, 0])
    period = 2 * np.pi * proton.mass / (proton.charge * 0.5)
    motion = proton.simulate(proton.state(x_rate=1e5), until=10 * period, tolerances=(1e-12, 1e-10))
    assert motion.end.x / (10 * period) == pytest.approx(1e4 / 0.5, rel=1e-6)


def test_equilibrium_and_linearization():
    model = pendulum()
    found = model.equilibrium(model.state(theta1=0.2, theta2=-0.1))
    assert found.stability.startswith("stable") and abs(found.state.theta1) < 1e-9
    linear = model.linearize(found.state)
    exact = np.sqrt(9.81 * (2.0 + np.array([-1, 1]) * np.sqrt(2.0)))
    np.testing.assert_allclose(np.sort(linear.frequencies), exact, rtol=1e-9)
    assert linear.mass.shape == linear.stiffness.shape == (2, 2) and linear.coordinates == ["theta1", "theta2"]
    with pytest.raises(mechanisms.EvaluationError):
        coaster().equilibrium(coaster().state(s=1e6))


def test_the_lock_is_free_and_ctrl_c_ends_a_run():
    """Another thread sets a flag while the run goes on, and interrupts it. The run would take minutes."""
    model = pendulum()
    ran = []

    def other():
        ran.append(True)
        _thread.interrupt_main()

    thread = threading.Timer(0.2, other)
    thread.start()
    with pytest.raises(KeyboardInterrupt) as caught:
        model.simulate(model.state(theta1=2.0), until=1e6, tolerance=1e-12, max_steps=10**9)
    thread.join()
    assert ran == [True]
    partial = caught.value.partial
    assert 0.0 < partial.interval[1] < 1e6 and partial.summary.energy_drift < 1e-6


def end_of(model, angle):
    return model.simulate(model.state(theta1=angle), until=5.0, tolerance=1e-9).end


def test_threads_and_processes_give_the_same():
    model, angles = pendulum(), np.linspace(0.5, 3.0, 12)
    alone = [end_of(model, angle) for angle in angles]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(end_of, [model] * 12, angles)) == alone
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert list(pool.map(end_of, [model] * 12, angles)) == alone


def test_pickles():
    for model in [pendulum(), chain(), engine()]:
        assert pickle.loads(pickle.dumps(model)) == model
    start = Ball(mass=0.2, g=9.81).state(y=1.0, t=3.0, release="floor")
    assert pickle.loads(pickle.dumps(start)) == start
    again = pickle.loads(pickle.dumps(coaster()))
    state = again.state(s=1.0)
    assert again.accelerations(state) == coaster().accelerations(coaster().state(s=1.0))


def test_notebooks_and_files(tmp_path: Path):
    model = pendulum()
    assert model._repr_latex_().startswith("\\begin{align")
    start = model.state(theta1=2.0)
    page = model.live(start, title="Two bobs", ranges={"g": (0.0, 25.0)}, hold=["m1"], plot=["theta1"])
    assert page._repr_html_().startswith("<iframe") and "<title>Two bobs" in page.html
    page.write(tmp_path / "pages" / "live.html")
    assert (tmp_path / "pages" / "live.html").read_text(encoding="utf-8") == page.html
    motion = model.simulate(start, until=2.0)
    assert motion._repr_html_().startswith("<iframe")
    assert "<html" in motion.live().html
    motion.animate(tmp_path / "run.html")
    motion.write_csv(tmp_path / "run.csv")
    motion.plot(tmp_path / "run.svg")
    motion.plot(tmp_path / "energy.svg", what="energy")
    assert (tmp_path / "run.csv").read_text().startswith("t [s],theta1 [rad]")
    with pytest.raises(ValueError, match="run.txt|html"):
        motion.animate(tmp_path / "run.txt")
    with pytest.raises(ValueError, match="nothing"):
        model.live(start, plot=["nothing"])
    assert "theta1''" in DoublePendulum.EQUATIONS and "operations" in DoublePendulum.REPORT
    assert DoublePendulum.UNITS["g"] == "m/s^2" and DoublePendulum.COORDINATES == ("theta1", "theta2")


def test_the_stub_is_that_of_the_module(request):
    """The wheel contains `mechanisms.pyi`. `pytest --update-stub` writes it again."""
    path = Path(__file__).parent.parent / "mechanisms.pyi"
    if request.config.getoption("--update-stub"):
        path.write_text(mechanisms.stub(), encoding="utf-8")
    assert path.read_text(encoding="utf-8") == mechanisms.stub()
