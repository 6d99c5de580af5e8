//! The longest step against closed forms.

use dynamics_families::SimulateFamilies;

use crate::common::{Bar, GuitarString, Lattice, state};

/// h/c for lumped masses, h/(√3 c) for consistent ones, whatever the ends.
#[test]
fn uniform_bars_attain_the_bound() {
    for between_walls in [true, false] {
        for elements in [4, 25, 1000] {
            let lumped = Bar::<false> { elements, length: 2.0, ea: 7.0, rho: 3.0, between_walls };
            let step = lumped.longest_step(&state(&lumped, |_| 0.0, |_| 0.0)).expect("a bound");
            assert!((step / (lumped.h() / lumped.c()) - 1.0).abs() < 1e-14, "{elements} {step}");
            let consistent = Bar::<true> { elements, length: 2.0, ea: 7.0, rho: 3.0, between_walls };
            let step = consistent.longest_step(&state(&consistent, |_| 0.0, |_| 0.0)).expect("a bound");
            let exact = consistent.h() / (3f64.sqrt() * consistent.c());
            assert!((step / exact - 1.0).abs() < 1e-14, "{elements} {step}");
        }
    }
}

/// ω = 2 sin(n π/(2 (n + 1))) < 2.
#[test]
fn the_bound_is_above_the_largest_frequency() {
    let lattice = Lattice { masses: 10, alpha: 0.0 };
    let step = lattice.longest_step(&state(&lattice, |_| 0.3, |_| 0.0)).expect("a bound");
    assert_eq!(step, 1.0);
    let string = GuitarString::uniform(40);
    let taut = string.longest_step(&state(&string, |_| 0.0, |_| 0.0)).expect("a bound");
    // Along the string c² = ea/rho.
    assert!((taut - string.pitch / 50f64.sqrt()).abs() < 1e-12 * taut);
}
