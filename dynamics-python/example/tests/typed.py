"""What type checkers know of the module: `mypy --strict` finds every mistake here, and nothing else."""

from typing import Any

import numpy as np
from mechanisms import Ball, CartPole, Chain, DoublePendulum, Motion, RollerCoaster, Spring
from numpy.typing import NDArray

model = DoublePendulum(m1=1.0, m2=1.0, l1=1.0, l2=1.0, g=9.81)
start = model.state(theta1=2.0, theta2_rate=0.5)
motion = model.simulate(start, until=10.0, method="dop853", events={"down": lambda s: s.theta1}, stop_at="down")
angles: NDArray[np.float64] = motion.theta1
rate: float = motion.end.theta1_rate
model.m1 = 2.0
chain = Chain(cart=1.0, mass=np.ones(10), length=[0.1] * 10, g=9.81)
lengths: NDArray[np.float64] = chain.length
cart = CartPole(cart=1.0, bob=0.1, length=0.5, g=9.81)
cart.simulate(cart.state(theta=0.1), until=1.0, inputs=lambda t, state: [40.0 * state.theta])
cart.accelerations(cart.state(), inputs={"force": 1.0})
ball = Ball(mass=0.2, g=9.81)
ball.accelerations(np.zeros((4, 1)), release="floor")
knots, values = [0.0, 1.0, 2.0], [0.0, 1.0, 0.0]
track = RollerCoaster(mass=1.0, g=9.81, end=2.0, x=(knots, values, "natural"), y=(knots, values))
track.x = (knots, values)
spring = Spring(mass=1.0, stiffness=1.0, length=1.0, type=1.0, **{"lambda": 1.0})
pushed: dict[str, Any] = {"from": 2.0}
spring.state(x=1.0, **pushed)


def energies(of: Motion) -> NDArray[Any]:
    return of.energy


# Mistakes: each comment is needed, or mypy says that it is not.
DoublePendulum(m1=1.0, m2=1.0, l1=1.0, l2=1.0)  # type: ignore[call-arg]
DoublePendulum(m1="1", m2=1.0, l1=1.0, l2=1.0, g=9.81)  # type: ignore[arg-type]
model.state(theta=1.0)  # type: ignore[call-arg]
model.simulate(start, until=1.0, method="ode45")  # type: ignore[arg-type]
model.simulate(cart.state(), until=1.0)  # type: ignore[arg-type]
motion.theta3  # type: ignore[attr-defined]
model.mass = 1.0  # type: ignore[attr-defined]
