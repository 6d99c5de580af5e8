"""Where does a double pendulum flip? A sweep over both angles with Dask. Needs dask."""

import dask
import numpy as np
from mechanisms import DoublePendulum

model = DoublePendulum(m1=1.0, m2=1.0, l1=1.0, l2=1.0, g=9.81)


@dask.delayed
def turns(model, theta1, theta2):
    motion = model.simulate(model.state(theta1=theta1, theta2=theta2), until=10.0, tolerance=1e-8)
    return np.abs(motion.q).max() > np.pi


angles = np.linspace(-3.0, 3.0, 20)
flipped = dask.compute(*[turns(model, a, b) for a in angles for b in angles])
print(f"{sum(flipped)} of {len(flipped)} pendulums turn over within 10 s; dask {dask.__version__}")
