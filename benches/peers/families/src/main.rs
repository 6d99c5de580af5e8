//! Models with families beside what one writes by hand in C: times in one process and in turn, and how far
//! the accelerations are apart. Prints a line of JSON for every measurement, and ratios to standard error.

mod models;
mod rivals;
mod rows;
mod timing;

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    for (name, row) in rows::ALL {
        if wanted.is_empty() || wanted.iter().any(|wanted| wanted == name) {
            for n in [1_000, 100_000, 1_000_000] {
                row(n);
            }
        }
    }
}
