//! Tables, animations and pictures.

use dynamics_families::{Every, SimulateFamilies};

use crate::common::{Bar, GuitarString, state};

#[test]
fn motions_become_tables_pages_and_pictures() {
    let string = GuitarString::uniform(1000);
    let pi = core::f64::consts::PI;
    let pull = |i: usize| if i < 1000 { 0.0 } else { 0.05 * (pi * (i - 999) as f64 / 1001.0).sin() };
    let start = state(&string, pull, |_| 0.0);
    let motion =
        string.simulate(start).until(0.02).inputs(|_, _| 0.0).tolerance(1e-5).record(Every::frames(5));
    let motion = motion.run().expect("runs");
    let folder = std::env::temp_dir().join(format!("dynamics-families-output-{}", std::process::id()));
    motion.write_csv(folder.join("motion.csv")).expect("written");
    let table = std::fs::read_to_string(folder.join("motion.csv")).expect("readable");
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "t,middle [m],kinetic,potential,energy");
    assert_eq!(lines.len(), 6);
    let last: Vec<f64> = lines[5].split(',').map(|field| field.parse().expect("a number")).collect();
    assert_eq!((last[0], last[1]), (0.02, motion.output("middle", 0.02).expect("the end")));
    assert_eq!(last[4], motion.energies_of(motion.end()).total());
    assert!(motion.write_csv(folder.join("motion.svg")).is_err());
    motion.animate(folder.join("motion.html")).expect("written");
    let page = std::fs::read_to_string(folder.join("motion.html")).expect("readable");
    assert!(page.contains("GuitarString") && page.len() < 20_000_000, "{}", page.len());
    motion.space_time("w").expect("a field").write_svg(folder.join("w.svg")).expect("written");
    let picture = std::fs::read_to_string(folder.join("w.svg")).expect("readable");
    assert!(picture.contains("<image") && picture.contains("GuitarString: w"));
    assert!(motion.space_time("nothing").is_err());
    std::fs::remove_dir_all(&folder).expect("removed");

    let bar = Bar::<false> { elements: 30, length: 1.0, ea: 1.0, rho: 1.0, between_walls: false };
    let motion = bar.simulate(state(&bar, |i| i as f64 / 30.0, |_| 0.0)).until(1.0).to_file(&folder).run();
    let motion = motion.expect("runs");
    let error = motion.animate(folder.join("motion.html")).expect_err("no states");
    assert!(error.to_string().contains("went to a file"), "{error}");
    std::fs::remove_dir_all(folder).expect("removed");
}
