"""Adam and L-BFGS on a loss of two parts; the torch functional against the NumPy one."""

from __future__ import annotations

import numpy as np
import pytest

import pikanid as pk
from pikanid.problem.chains import find_chains
from pikanid.problem.problem import Problem
from pikanid.simulation.vectorfield import VectorField

torch = pytest.importorskip("torch")
gradient = pytest.importorskip("pikanid.optimise.gradient")
gradient_functional = pytest.importorskip("pikanid.optimise.gradient_functional")

from pikanid.optimise.dense import levenberg_marquardt  # noqa: E402
from pikanid.optimise.gauss_newton import Point  # noqa: E402
from pikanid.strategies import pinn_networks  # noqa: E402

pytestmark = pytest.mark.kan


def bowl(z):
    return (z[0] - 2.0) ** 2, (z[1] - z[0]) ** 2


def rosenbrock(z):
    return (1.0 - z[0]) ** 2, 100.0 * (z[1] - z[0] ** 2) ** 2


def poisoned(z):
    """NaN once the first entry has come near its optimum."""
    data, physics = bowl(z)
    return data * (torch.nan if float(z[0].detach()) > 1.0 else 1.0), physics


def test_adam_then_lbfgs_finds_the_minimum() -> None:
    start = np.array([-1.0, 1.0])
    first = gradient.adam(rosenbrock, start, steps=300, weight=gradient.Ramp(0.0, 1.0, 300),
                          goal=1.0, rate=0.02)
    second = gradient.lbfgs(rosenbrock, first.z, steps=200, lam=1.0)
    np.testing.assert_allclose(second.z, 1.0, atol=1e-5)
    assert second.finished and second.gradient < 1e-4 and second.loss < 1e-9


def test_bounds_hold() -> None:
    lower, upper = np.array([-5.0, -5.0]), np.array([1.5, 1.0])
    options = {"lower": lower, "upper": upper}
    a = gradient.adam(bowl, np.zeros(2), steps=500, weight=gradient.Ramp(1.0, 1.0, 1), goal=1.0,
                      rate=0.05, **options)
    b = gradient.lbfgs(bowl, np.zeros(2), steps=50, lam=1.0, **options)
    for found in (a, b):
        np.testing.assert_allclose(found.z, [1.5, 1.0], atol=1e-6)
    assert b.gradient < 1e-5  # what is left of it pushes against a bound


def test_nan_costs_the_rest_but_not_the_best() -> None:
    found = gradient.adam(poisoned, np.zeros(2), steps=500, weight=gradient.Ramp(1.0, 1.0, 1),
                          goal=1.0, rate=0.01)
    assert found.diverged and 50 < found.steps < 500
    assert np.isfinite(found.loss) and 0.9 < found.z[0] <= 1.0
    after = gradient.lbfgs(poisoned, np.zeros(2), steps=50, lam=1.0)
    assert np.isfinite(after.loss) and after.z[0] <= 1.0 and not after.finished


def test_gradnorm_makes_both_parts_pull_equally() -> None:
    balance = gradient.GradNorm()
    z = torch.tensor([0.0, 3.0], dtype=torch.float64)
    lam = balance(0, bowl, z)
    pulls = []
    for part in range(2):
        at = z.clone().requires_grad_()
        pulls.append(torch.linalg.vector_norm(torch.autograd.grad(bowl(at)[part], at)[0]))
    assert np.isclose(lam * float(pulls[1]), float(pulls[0]))
    assert balance(1, bowl, z) == lam


def test_gradnorm_looks_again_every_so_often() -> None:
    """Between looks λ stays; a look moves it by a tenth of the way, and never beyond the most."""
    balance = gradient.GradNorm(every=2, momentum=0.9, largest=2.0)
    near, far = (torch.tensor(z, dtype=torch.float64) for z in ([0.0, 3.0], [1.9, 3.0]))
    first = balance(0, bowl, near)
    assert balance(1, bowl, far) == first
    wanted = abs(2 * (1.9 - 2.0)) / (2 * 1.1 * 2**0.5)
    assert np.isclose(balance(2, bowl, far), 0.9 * first + 0.1 * wanted)
    assert gradient.GradNorm(largest=0.1)(0, bowl, near) == 0.1


def test_progress_is_told() -> None:
    told: list[dict[str, float]] = []
    gradient.adam(bowl, np.zeros(2), steps=250, weight=gradient.Ramp(0.0, 0.1, 250), goal=0.1,
                  progress=told.append)
    assert [entry["step"] for entry in told] == [1.0, 100.0, 200.0]
    assert set(told[0]) == {"step", "lam", "data", "physics"}


def test_global_state_is_left_alone() -> None:
    before = (torch.get_num_threads(), torch.get_default_dtype(), torch.random.get_rng_state())
    with gradient.one_thread():
        assert torch.get_num_threads() == 1
    with pytest.raises(KeyError), gradient.one_thread():
        raise KeyError
    after = (torch.get_num_threads(), torch.get_default_dtype(), torch.random.get_rng_state())
    assert before[:2] == after[:2] and torch.equal(before[2], after[2])


def two_outputs() -> tuple[pk.Model, list[pk.Recording]]:
    """Two recordings, an estimated initial state, a parameter of each recording's own, σ known."""
    model = pk.Model.from_dict({
        "name": "two", "states": {"x": {"initial": "x_0"}, "v": {}, "w": {}}, "inputs": {"u": {}},
        "parameters": {"k": {"guess": 4.0, "bounds": [0.1, 50]},
                       "c": {"guess": 0.3, "scope": "recording"}, "x_0": {"guess": 0.4}},
        "equations": {"x": "v", "v": "-k*sin(x) - c*v + u", "w": "x - c*w"},
        "outputs": {"x": {"expression": "x"}, "s": {"expression": "w + 0.1*v**2"}}})
    rng, recordings = np.random.default_rng(0), []
    for n in (30, 41):
        t = np.linspace(0.0, 3.0, n)
        recordings.append(pk.Recording.from_arrays(
            t, {"u": np.where(t < 1.0, 1.0, 0.0), "x": np.sin(2 * t) + 0.1 * rng.normal(size=n),
                "s": rng.normal(size=n)}, sigma={"x": 0.1, "s": 0.5}, hold={"u": "zero"}))
    return model, recordings


@pytest.mark.parametrize("form", ["second_order", "state"])
def test_torch_functional_is_the_functional(form: str) -> None:
    model, recordings = two_outputs()
    problem = Problem(model, recordings)
    field, chains = VectorField(model), find_chains(model, form)
    plan = pinn_networks.Architecture((5, 4), 1.0, True, True, None, "cpu")
    networks = pinn_networks.make_networks(problem, field, chains, plan)
    functional = pinn_networks.functional_of(problem, field, chains, networks, plan, weighted=True)
    functional = functional.with_scale(np.linspace(2.0, 3.0, len(chains.top)))
    loss = gradient_functional.TorchFunctional(functional)
    z = loss.pack(Point(networks.start(0), problem.guess))
    z = z + 0.1 * np.random.default_rng(1).normal(size=z.size)
    lam = 0.7

    # values
    rows, r = loss.data_rows(), loss.residual(z, lam)
    at = torch.tensor(z, requires_grad=True)
    data, physics = loss(at)
    assert loss._adjoints is not None
    sums = [float(part.detach()) * functional.n_data for part in (data, physics)]
    assert np.isclose(sums[0], np.sum(r[rows] ** 2), rtol=1e-10)
    assert np.isclose(lam * sums[1], np.sum(r[~rows] ** 2), rtol=1e-10)
    # gradient and Jacobian, both against finite differences of the NumPy residual
    (slope,) = torch.autograd.grad(data + lam * physics, at)
    # the adjoints that are written out, against the graph of every formula
    traced = loss.traced(at)
    assert [float(part.detach()) for part in traced] == pytest.approx(
        [float(data.detach()), float(physics.detach())], 1e-13)
    for wanted, part in zip(traced, (data, physics), strict=True):
        pulls = [torch.autograd.grad(p, at, retain_graph=True)[0] for p in (part, wanted)]
        np.testing.assert_allclose(*pulls, rtol=1e-10, atol=1e-11 * float(pulls[1].abs().max()))
    assert loss.slope(z, lam)[:2] == (float(data.detach()), float(physics.detach()))
    np.testing.assert_array_equal(loss.slope(z, lam)[2], slope)
    again, jacobian = loss.linearised(z, lam)
    point = loss.unpack(z)
    np.testing.assert_allclose(functional.residual(point.coefficients, point.theta, lam), r,
                               rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(again, r, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(slope * functional.n_data, 2 * jacobian.T @ r,
                               rtol=1e-8, atol=1e-8 * np.abs(jacobian.T @ r).max())
    for column in np.random.default_rng(2).choice(z.size, 12).tolist() + list(range(-5, 0)):
        step = np.zeros(z.size)
        step[column] = 1e-6
        numeric = (loss.residual(z + step, lam) - loss.residual(z - step, lam)) / 2e-6
        np.testing.assert_allclose(jacobian[:, column], numeric, atol=2e-6 * np.abs(jacobian).max())
    # packing, and the start that holds whatever z is
    np.testing.assert_allclose(loss.pack(point), z)
    for k, own in enumerate(point.coefficients):
        x = functional.states(functional.parts[k].data[0], own)[0]
        start = problem.experiments[k].initial(problem.parameters(point.theta, k))
        np.testing.assert_allclose(x, start, atol=1e-12)


def test_dense_levenberg_marquardt_within_bounds() -> None:
    def curve(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        t = np.linspace(0.0, 1.0, 20)
        return (z[0] * np.exp(-z[1] * t) - 2.0 * np.exp(-3.0 * t),
                np.stack([np.exp(-z[1] * t), -z[0] * t * np.exp(-z[1] * t)], axis=1))

    free = levenberg_marquardt(lambda z: curve(z)[0], curve, np.ones(2), lower=np.zeros(2),
                               upper=np.full(2, 9.0), tolerance=1e-12)
    np.testing.assert_allclose(free.z, [2.0, 3.0], rtol=1e-5)
    boxed = levenberg_marquardt(lambda z: curve(z)[0], curve, np.ones(2), lower=np.zeros(2),
                                upper=np.array([9.0, 2.0]))
    assert boxed.converged and boxed.z[1] == 2.0


def test_more_unknowns_than_rows() -> None:
    """The step on the smaller side of J is the same step."""
    rng = np.random.default_rng(0)
    wide, target = rng.normal(size=(4, 9)), rng.normal(size=4)
    none = np.full(9, np.inf)
    found = levenberg_marquardt(lambda z: wide @ z - target, lambda z: (wide @ z - target, wide),
                                np.zeros(9), lower=-none, upper=none)
    assert found.cost < 1e-10


def test_devices_that_torch_has() -> None:
    assert gradient.present("cpu") and not gradient.present("abacus")
    assert gradient.present("cuda") == torch.cuda.is_available()
