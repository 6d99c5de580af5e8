"""Values, names and programs at the edges: packed records, keywords, pickles, several modules, garbage."""

import ast
import copy
import gc
import importlib.machinery
import importlib.util
import inspect
import multiprocessing
import pickle
import shutil
import sys
import weakref
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from types import MappingProxyType

import mechanisms
import numpy as np
import pytest
from mechanisms import Ball, CartPole, DoublePendulum, RollerCoaster, Spring


def pendulum(**changed):
    return DoublePendulum(**{"m1": 1.0, "m2": 1.0, "l1": 1.0, "l2": 1.0, "g": 9.81, **changed})


def cart_pole():
    return CartPole(cart=1.0, bob=0.2, length=0.5, g=9.81)


def ball():
    return Ball(mass=0.2, g=9.81)


def spring(**changed):
    given = {"mass": 1.0, "stiffness": 4.0, "length": 0.5, "lambda": 1.2, "type": 1.0, **changed}
    return Spring(**given)


def packed(values):
    """The same numbers as columns of records without padding: odd strides and addresses."""
    fields = [("id", "i1"), *((f"f{i}", "f8") for i in range(values.shape[1]))]
    records = np.zeros(len(values), fields)
    for i, column in enumerate(values.T):
        records[f"f{i}"] = column
    return records


def test_columns_of_packed_records_are_read():
    model = ball()
    times = np.array([0.0, 0.25, 0.5, 1.0])
    records = packed(times[:, None])
    motion = model.simulate(model.state(y=20.0, release="floor"), until=1.0, times=records["f0"])
    np.testing.assert_array_equal(motion.t, times)
    np.testing.assert_array_equal(model.evaluate("energy", records["f0"]), model.evaluate("energy", times.copy()))
    padded = np.zeros(4, [("id", "i4"), ("t", "f8")])
    padded["t"] = times
    assert motion.get("y", padded["t"]).tolist() == motion.get("y", times).tolist()
    bytes_ = bytearray(8 * 5)
    shifted = np.frombuffer(bytes_, "f8", 4, offset=1)
    shifted[:] = times
    assert motion.get("y", shifted).tolist() == motion.get("y", times).tolist()
    # The byte order of another machine, negative and zero strides.
    assert motion.get("y", times.astype(">f8")).tolist() == motion.get("y", times).tolist()
    assert motion.get("y", times[::-1]).tolist() == motion.get("y", times).tolist()[::-1]
    assert motion.get("y", np.broadcast_to(0.5, 3)).tolist() == [motion.at(0.5).y] * 3


@pytest.mark.parametrize(
    "wrong",
    [[0.1, None], [1.0 + 2.0j], ["0.5"], np.array(["0.5"]), np.array(["2026-01-01"], "M8[D]"), [object()]],
)
def test_only_real_numbers_are_numbers(wrong):
    model = ball()
    motion = model.simulate(model.state(y=20.0, release="floor"), until=1.0)
    with pytest.raises(TypeError, match="numbers are needed"):
        motion.get("y", wrong)
    with pytest.raises(TypeError, match="numbers are needed"):
        model.accelerations(wrong)


@pytest.mark.parametrize("wrong", [1.0 + 2.0j, np.complex128(1.0 + 2.0j), np.complex64(1.0), None, "1.0"])
def test_only_real_numbers_are_a_number(wrong):
    with pytest.raises(TypeError, match="real number"):
        spring(mass=wrong)
    with pytest.raises(TypeError, match="real number"):
        spring().state(x=wrong)
    with pytest.raises(TypeError, match="number"):
        model = cart_pole()
        model.simulate(model.state(), until=1.0, inputs=lambda t, state: wrong)


@pytest.mark.parametrize("right", [np.float32(2.0), np.int8(2), 2, True + 1, np.array(2.0), np.float64(2.0)])
def test_all_real_numbers_are_taken(right):
    assert spring(mass=right).mass == 2.0 and spring().state(x=right).x == 2.0


def test_a_released_state_is_evaluated_as_one():
    model = ball()
    falling, resting = model.state(y=0.0, release="floor"), model.state(y=0.0)
    assert model.accelerations(falling).tolist() == [-9.81]
    assert model.accelerations(resting).tolist() == [0.0]
    assert model.evaluate("multipliers", falling).tolist() == [0.0]
    assert model.evaluate("multipliers", resting)[0] == pytest.approx(0.2 * 9.81)
    q = np.zeros((6, 1))
    assert model.accelerations(q).tolist() == [[0.0]] * 6
    assert model.accelerations(q, release="floor").tolist() == [[-9.81]] * 6
    assert model.accelerations(q, release={"floor": 1.0}).tolist() == [[-9.81]] * 6
    assert model.evaluate("multipliers", q, release=["floor"]).tolist() == [[0.0]] * 6
    assert model.mass_matrix([0.0], release="floor").tolist() == [[0.2]]
    with pytest.raises(ValueError, match="`roof` is not a switched constraint of Ball; these are floor"):
        model.accelerations(q, release="roof")
    with pytest.raises(TypeError, match="alone, or with inputs"):
        model.accelerations(falling, release="floor")


def test_inputs_beside_a_state_count():
    model = cart_pole()
    state, pushed = model.state(theta=0.1, force=0.0), model.state(theta=0.1, force=5.0)
    expected = model.accelerations(pushed)
    assert (model.accelerations(state) != expected).all()
    for inputs in [[5.0], {"force": 5.0}, np.array([5.0]), MappingProxyType({"force": 5.0})]:
        np.testing.assert_array_equal(model.accelerations(state, inputs=inputs), expected)
    rows = model.accelerations(state, inputs=[[0.0], [5.0]])
    np.testing.assert_array_equal(rows, [model.accelerations(state), expected])
    np.testing.assert_array_equal(
        model.accelerations([state.q], [state.u], inputs={"force": 5.0}), [expected]
    )
    with pytest.raises(TypeError, match="no inputs"):
        ball().accelerations(ball().state(), inputs=[5.0])


def test_attributes_are_not_the_arrays_that_were_given():
    s = np.linspace(0.0, 40.0, 21)
    y = {"knots": s, "values": 3.0 * np.cos(s / 6.0), "ends": "not-a-knot"}
    slopes = (s, np.sin(s), [1.0, 0.5])
    track = RollerCoaster(mass=500.0, g=9.81, end=40.0, x=slopes, y=y)
    before = track.accelerations([3.0], [1.0])
    kept = s.copy()
    s[:] = 0.0
    y["values"][:] = 0.0
    y["ends"] = "natural"
    slopes[2][0] = 7.0
    np.testing.assert_array_equal(track.y[0], kept)
    assert track.y[2] == "not-a-knot" and track.x[2] == (1.0, 0.5)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(track)).accelerations([3.0], [1.0]), before)
    np.testing.assert_array_equal(track.replace().accelerations([3.0], [1.0]), before)
    with pytest.raises(ValueError, match="read-only"):
        track.x[0][0] = 1.0
    with pytest.raises(TypeError, match="give a spline as"):
        track.replace(x=1.0)
    with pytest.raises(ValueError, match="give a spline as"):
        track.replace(x=(kept, kept, "free"))


def test_names_that_are_words_of_pythons_grammar():
    model = spring(**{"lambda": 1.5})
    assert getattr(model, "lambda") == 1.5 and model.type == 1.0
    assert model.replace(**{"lambda": 2.0}) == spring(**{"lambda": 2.0})
    assert pickle.loads(pickle.dumps(model)) == model
    assert Spring.PARAMETERS == ("mass", "stiffness", "length", "lambda", "type")
    assert "type" in inspect.signature(Spring).parameters
    assert "lambda" not in inspect.signature(Spring).parameters
    state = model.state(x=1.0, **{"from": 2.0})
    assert state["from"] == 2.0
    assert model.accelerations(state).tolist() == [2.0 - 4.0 * (1.0 - 1.5 * 0.5)]
    ast.parse(mechanisms.stub())


def test_two_modules_in_one_process_keep_their_exceptions(tmp_path):
    path = Path(mechanisms.__file__)
    candidates = [path, *path.parent.glob("mechanisms*.so"), *path.parent.glob("mechanisms*.pyd")]
    library = next(path for path in candidates if path.suffix in (".so", ".pyd"))
    again = shutil.copy(library, tmp_path)
    loader = importlib.machinery.ExtensionFileLoader("again.mechanisms", str(again))
    spec = importlib.util.spec_from_file_location("again.mechanisms", again, loader=loader)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.SimulationError is not mechanisms.SimulationError
    assert "dynamics_errors" not in sys.modules
    for one in [mechanisms, module]:
        model = one.DoublePendulum(m1=1.0, m2=1.0, l1=1.0, l2=1.0, g=9.81)
        with pytest.raises(one.SimulationError):
            model.simulate(model.state(theta1=2.0), until=100.0, max_steps=10)
        with pytest.raises(one.StateError):
            model.state(theta1=float("nan"))


def fails_in_a_law(model):
    def law(t, state):
        return 1.0 / (0.0 if t > 0.2 else 1.0)

    return model.simulate(model.state(theta=0.1), until=1.0, inputs=law, method="rk4", fixed_step=0.01).end


def test_exceptions_with_a_motion_cross_processes():
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        with pytest.raises(ZeroDivisionError) as caught:
            pool.submit(fails_in_a_law, cart_pole()).result()
    assert caught.value.partial is None
    with pytest.raises(ZeroDivisionError) as caught:
        fails_in_a_law(cart_pole())
    partial = caught.value.partial
    assert isinstance(partial, mechanisms.Motion) and partial.interval[1] > 0.1
    assert copy.deepcopy(caught.value).partial is partial
    # The motion of a run that went well is still refused, in words.
    with pytest.raises(TypeError, match="not pickled"):
        pickle.dumps(ball().simulate(ball().state(), until=0.1))


def test_an_exception_without_room_arrives_as_it_is():
    class Frozen(Exception):
        def __setattr__(self, name, value):
            raise AttributeError("this exception does not change")

    def law(t, state):
        if t > 0.2:
            raise Frozen("the law")
        return 0.0

    model = cart_pole()
    with pytest.raises(Frozen, match="the law"):
        model.simulate(model.state(theta=0.1), until=1.0, inputs=law)


def test_a_motion_in_its_own_law_is_collected():
    class Law:
        def __call__(self, t, state):
            return 0.0

    model, law = cart_pole(), Law()
    law.motion = model.simulate(model.state(theta=0.1), until=0.1, inputs=law)
    alive = weakref.ref(law)
    del law
    gc.collect()
    assert alive() is None


def test_a_parameter_that_is_set_in_between_stays():
    model = pendulum()

    class Sets:
        def __float__(self):
            model.m2 = 7.0
            return 3.0

    model.m1 = Sets()
    assert (model.m1, model.m2) == (3.0, 7.0)
    same = pendulum(m1=3.0, m2=7.0)
    np.testing.assert_array_equal(model.accelerations([1.0, 2.0]), same.accelerations([1.0, 2.0]))


def test_a_guess_beside_a_value_is_refused():
    with pytest.raises(TypeError, match="theta1_guess is a guess .* theta1 is given"):
        pendulum().state(theta1=0.5, theta1_guess=1.0, assemble=True)
    with pytest.raises(TypeError, match="theta1_guess is a guess .* theta1 is given"):
        pendulum().state(theta1_guess=1.0, theta1=0.5, assemble=True)


def test_a_live_page_of_a_motion_with_events_of_its_run():
    model = ball()
    motion = model.simulate(
        model.state(y=1.0, release="floor"),
        until=1.0,
        contact={"floor": 0.7},
        events={"half": lambda state: state.y - 0.5},
        stop_at={"half": "falling"},
    )
    assert motion.summary.stopped_by == "half"
    assert "<html" in motion.live().html


class Named(Mapping):
    """A mapping that is not a dictionary."""

    def __init__(self, **entries):
        self.entries = entries

    def __getitem__(self, key):
        return self.entries[key]

    def __iter__(self):
        return iter(self.entries)

    def __len__(self):
        return len(self.entries)


def test_mappings_are_taken_where_dictionaries_are():
    model = ball()
    start = model.state(y=1.0, release=Named(floor=1.0))
    motion = model.simulate(
        start,
        until=1.0,
        contact=Named(floor=0.7),
        events=Named(half=lambda state: state.y - 0.5),
        on_event=Named(half=("falling", lambda state: None)),
        stop_at=Named(half="falling"),
    )
    assert motion.end.y == pytest.approx(0.5)
    assert model.live(start, contact=Named(floor=0.7), ranges=Named(g=(0.0, 25.0)))
    cart = cart_pole()
    held = cart.simulate(cart.state(theta=0.1), until=0.1, inputs=Named(force=2.0))
    law = cart.simulate(cart.state(theta=0.1), until=0.1, inputs=lambda t, state: Named(force=2.0))
    np.testing.assert_allclose(held.end.q, law.end.q, rtol=1e-8)
    s = np.linspace(0.0, 40.0, 21)
    RollerCoaster(mass=1.0, g=9.81, end=40.0, x=(s, s), y=Named(knots=s, values=s))


def test_no_times_give_columns_without_rows():
    model = cart_pole()
    motion = model.simulate(model.state(theta=0.1, force=0.0), until=1.0)
    full, empty = motion.to_numpy(accelerations=True), motion.to_numpy([], accelerations=True)
    assert list(empty) == list(full) and all(column.shape == (0,) for column in empty.values())
    assert motion.to_numpy([], form="matrix").shape == (0, len(motion.columns))
    assert motion.to_numpy([], form="structured").dtype == motion.to_numpy(form="structured").dtype
    assert motion.get("theta", []).shape == (0,)
    assert motion.at([])["theta_rate"].shape == (0,)


def test_pickled_states_have_names():
    model = cart_pole()
    state = model.state(x=1.0, theta=0.1, theta_rate=2.0, t=3.0, force=4.0)
    assert pickle.loads(pickle.dumps(state)) == state
    assert pickle.loads(pickle.dumps(model.state(x=1.0))) == model.state(x=1.0)
    rebuild, parts = state.__reduce__()
    t, values, release = parts
    backwards = dict(reversed(values.items()))
    assert rebuild(t, backwards, release) == state
    renamed = {("angle" if name == "theta" else name): value for name, value in values.items()}
    with pytest.raises(ValueError, match="not pickled from a state of this CartPole: .*angle"):
        rebuild(t, renamed, release)
    missing = {name: value for name, value in values.items() if name != "theta_rate"}
    with pytest.raises(ValueError, match="not pickled from a state"):
        rebuild(t, missing, release)


def test_a_released_state_is_made_again_from_its_dictionary():
    model = ball()
    state = model.state(y=1.0, release="floor", t=2.0)
    assert state.to_dict()["release"] == {"floor": 1.0}
    assert model.state(**state.to_dict()) == state
    assert "release" not in model.state().to_dict()


def test_one_coordinate_takes_its_values_without_a_second_dimension():
    model, y = ball(), np.array([0.0, 1.0, 2.0])
    np.testing.assert_array_equal(model.evaluate("energy", y), model.evaluate("energy", y[:, None]))
    assert model.accelerations(y).shape == (3, 1) and model.accelerations([1.0]).shape == (1,)


def test_a_start_beside_the_constraints_is_a_state_error():
    model = ball()
    with pytest.raises(mechanisms.StateError, match="floor"):
        model.simulate(model.state(y=0.0).replace(y=0.3), until=1.0)


@pytest.mark.parametrize(
    ("both", "text"),
    [
        ({"times": [0.1], "every": 0.1}, "give times or every, not both"),
        ({"tolerance": 1e-9, "tolerances": (1e-9, 1e-9)}, "give tolerance or tolerances, not both"),
    ],
)
def test_options_that_exclude_each_other(both, text):
    with pytest.raises(ValueError, match=text):
        pendulum().simulate(pendulum().state(), until=1.0, **both)
