//! Generalized speeds: equations solved in them against the same equations in coordinates and against closed ones; starts, outputs and motions.

mod against_coordinates;
mod models;

use models::*;

#[test]
fn first() {
    for t in [
        Top::REPORT,
        TopInAngles::REPORT,
        Aircraft::REPORT,
        AircraftInAngles::REPORT,
        Satellite::REPORT,
        SatelliteInParameters::REPORT,
        Sleigh::REPORT,
        SleighInCoordinates::REPORT,
        Disk::REPORT,
        DiskInAngles::REPORT,
        Turntable::REPORT,
        Rods::REPORT,
    ] {
        println!("{t}");
    }
}
