#[path = "models/arm7.rs"]
mod arm7;
use arm7::{Arm, arm};
#[test]
fn cost() {
    println!("{}", Arm::REPORT);
    for l in Arm::LISTING.lines().filter(|l| l.contains("operations")) { println!("{l}"); }
    let _ = arm();
}
