//! Pages that are tested in a browser: one for every kind of structure that a page shows.

use dynamics::live::{Gallery, OpenLive};
use dynamics::prelude::*;

use crate::double_pendulum::DoublePendulum;
use crate::models::*;
use crate::motions::{BouncingBall, andrews};
use crate::rust::Reserved;
// The prelude has one, too.
use crate::models::RigidBody;

/// The text of each page, and its name as a file.
pub(crate) fn pages() -> Vec<(&'static str, String)> {
    let mut pages = plain();
    pages.extend(constrained());
    pages.extend(unusual());
    pages.extend(crate::families::pages());
    pages
}

/// An index with two pictures.
pub(crate) fn gallery() -> Gallery {
    let pendulum = Pendulum { m: 0.7, l: 1.3, g: 9.81, c: 0.2 };
    let double = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let one = pendulum.live(pendulum.state().theta(1.0).build().unwrap()).finish().unwrap();
    let two = double.live(double.state().theta1(1.0).build().unwrap()).finish().unwrap();
    Gallery::new("Pendulums").chapter("With bobs").page("one", one).page("two", two)
}

/// Minimal coordinates: a damper, several starts, arrays, a spline, an input, a drive, space.
fn plain() -> Vec<(&'static str, String)> {
    let pendulum = Pendulum { m: 0.7, l: 1.3, g: 9.81, c: 0.2 };
    let double = DoublePendulum { m1: 1.1, m2: 1.3, l1: 1.0, l2: 0.8, g: 9.81 };
    let folded = double.state().theta1(2.0).theta2(-2.0).build().unwrap();
    let chain = Chain { cart: 2.0, mass: [0.5, 0.4, 0.3, 0.2], length: [0.8, 0.7, 0.6, 0.5], g: 9.81 };
    let track = CubicSpline::natural(&[-4.0, -1.0, 0.5, 2.0, 4.0], &[3.0, 0.4, 0.1, 0.9, 3.4]).unwrap();
    let bead = Bead { m: 0.3, g: 9.81, track };
    let cart = CartPole { cart: 2.0, bob: 0.6, l: 0.9, g: 9.81 };
    let pivot = DrivenPivot { m: 0.2, l: 0.5, g: 9.81, amplitude: 0.03, omega: 40.0 };
    let bob = SphericalPendulum { m: 0.4, l: 1.2, g: 9.81 };
    vec![
        ("pendulum", {
            let page = pendulum.live(pendulum.state().theta(1.0).build().unwrap());
            page.range("g", 9.7805, 9.8325).to_html().unwrap()
        }),
        ("double_pendulum", {
            let page = double.live(double.state().theta1(1.0).build().unwrap()).start("folded", folded);
            page.method(methods::Dop853).tolerance(1e-10).phase("theta2").to_html().unwrap()
        }),
        ("chain", chain.live(chain.state().theta([1.0, 0.6, 0.3, 0.1]).build().unwrap()).to_html().unwrap()),
        ("bead", bead.live(bead.state().x(-2.0).build().unwrap()).plot(["x", "energy"]).to_html().unwrap()),
        ("cart_pole", {
            let start = cart.state().theta(0.5).push(0.3).build().unwrap();
            cart.live(start).range("push", -4.0, 4.0).hold(["g"]).to_html().unwrap()
        }),
        ("driven_pivot", pivot.live(pivot.state().theta(3.0).build().unwrap()).to_html().unwrap()),
        ("spherical_pendulum", {
            bob.live(bob.state().theta(1.0).phi_rate(1.0).build().unwrap()).to_html().unwrap()
        }),
    ]
}

/// Loops, a knife edge, friction, a contact.
fn constrained() -> Vec<(&'static str, String)> {
    let crank = SliderCrank { m: [1.0, 2.0, 3.0], r: 0.5, l: 1.5, g: 9.81 };
    let angle: f64 = 0.6;
    let rod = (crank.r * angle.sin() / crank.l).asin();
    let slide = crank.r * angle.cos() + crank.l * rod.cos();
    let sleigh = Sleigh { m: 2.0, inertia: 0.3, ahead: 0.4 };
    let block = Block { m: 2.0, g: 9.81, slope: 0.4, friction: 0.3 };
    let ball = BouncingBall { g: 10.0 };
    let [beta, theta, gamma, phi, delta, omega, epsilon] = andrews::START;
    let andrews = andrews::PUBLISHED;
    let start = andrews.state().beta(beta).theta(theta).gamma(gamma).phi(phi);
    let start = start.delta(delta).omega(omega).epsilon(epsilon).build().unwrap();
    vec![
        ("slider_crank", {
            let start = crank.state().crank(angle).rod(rod).slide(slide).build().unwrap();
            crank.live(start).to_html().unwrap()
        }),
        (
            "sleigh",
            sleigh.live(sleigh.state().x_rate(1.0).heading_rate(0.7).build().unwrap()).to_html().unwrap(),
        ),
        ("block", {
            let page = block.live(block.state().x_rate(0.0).build().unwrap());
            page.stick_slip("stick", "breakaway").to_html().unwrap()
        }),
        ("bouncing_ball", {
            let start = ball.state().y(5.0).x_rate(1.0).release("ground").build().unwrap();
            ball.live(start).contact("ground", 0.5).until(6.0).to_html().unwrap()
        }),
        ("andrews", andrews.live(start).to_html().unwrap()),
    ]
}

/// Nothing to draw, no energies apart, an end at an event, tiny numbers, and a title with markup in it.
fn unusual() -> Vec<(&'static str, String)> {
    let masses = Masses { m: [1.0, 2.0, 0.5], k: 30.0, c: 0.4 };
    let (magnetic, electric) = ([0.1, 0.7, -0.4].into(), [0.3, 0.0, 0.2].into());
    let particle = Particle { mass: 1.7, charge: 0.8, magnetic, electric };
    let body = RigidBody { inertia: Mat3::diagonal(1.0, 2.0, 2.5) };
    let ball = Ball { mass: 0.145, k: 8.8e-4, g: 9.81 };
    let reserved = Reserved { method: 1.0, accuracy: 0.5, only: 2.0, r#type: 3.0 };
    let tiny = Pendulum { m: 1e-27, l: 1e-9, g: 9.81, c: 0.0 };
    vec![
        ("masses", masses.live(masses.state().gap(0.3).y(0.2).build().unwrap()).to_html().unwrap()),
        ("particle", particle.live(particle.state().x_rate(1.0).build().unwrap()).to_html().unwrap()),
        ("rigid_body", {
            let start = body.state().tilt(1.0).yaw_rate(2.0).spin_rate(1.0).build().unwrap();
            body.live(start).to_html().unwrap()
        }),
        ("ball", {
            let start = ball.state().y(1.0).x_rate(20.0).y_rate(15.0).build().unwrap();
            ball.live(start).plot(["speed"]).stop_at("ground", Direction::Falling).to_html().unwrap()
        }),
        ("reserved", reserved.live(reserved.state().x(1.0).build().unwrap()).to_html().unwrap()),
        ("tiny", {
            let title = "A <b>tiny</b> \"pendulum\" & its </script> 'bob' of 10⁻²⁷ kg";
            tiny.live(tiny.state().theta(1.0).build().unwrap()).title(title).to_html().unwrap()
        }),
    ]
}
