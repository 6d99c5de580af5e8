"""T, V and the constraints of `benches/evaluation`, with the sin and cos of `lib`."""

from problems import G

CHAINS = (5, 10, 20)


def chain(links, q, u, lib):
    """T and V of a cart with links in absolute angles; the numbers of `by_hand.rs`."""
    x, rise, fall = u[0], 0, 0
    kinetic, potential = 0.5 * 2.0 * u[0] ** 2, 0
    for i in range(links):
        m, length = 1.0 + 0.1 * ((i + 1) % 7), 1.0 - 0.02 * ((i + 1) % 9)
        s, c = lib.sin(q[i + 1]), lib.cos(q[i + 1])
        x, rise, fall = x + length * c * u[i + 1], rise + length * s * u[i + 1], fall - length * c
        kinetic, potential = kinetic + 0.5 * m * (x**2 + rise**2), potential + m * G * fall
    return kinetic, potential, []


def double_pendulum(q, u, lib):
    x, rise, fall, kinetic, potential = 0, 0, 0, 0, 0
    for m, length, angle, rate in zip((1.0, 1.3), (1.0, 0.8), q, u):
        s, c = lib.sin(angle), lib.cos(angle)
        x, rise, fall = x + length * c * rate, rise + length * s * rate, fall - length * c
        kinetic, potential = kinetic + 0.5 * m * (x**2 + rise**2), potential + m * G * fall
    return kinetic, potential, []


def slider_crank(q, u, lib):
    (theta, phi, _), (crank, rod) = q, (0.5, 1.2)
    x = -crank * lib.sin(theta) * u[0] - 0.5 * rod * lib.sin(phi) * u[1]
    y = crank * lib.cos(theta) * u[0] + 0.5 * rod * lib.cos(phi) * u[1]
    kinetic = 0.5 * (crank**2 / 3) * u[0] ** 2 + 0.5 * 2.0 * u[2] ** 2
    kinetic = kinetic + 0.5 * 1.5 * (x**2 + y**2) + 0.5 * (1.5 * rod**2 / 12) * u[1] ** 2
    rows = [crank * lib.cos(theta) + rod * lib.cos(phi) - q[2], crank * lib.sin(theta) + rod * lib.sin(phi)]
    height = crank * lib.sin(theta) + 0.5 * rod * lib.sin(phi)
    potential = 1.0 * G * 0.5 * crank * lib.sin(theta) + 1.5 * G * height
    return kinetic, potential, rows
