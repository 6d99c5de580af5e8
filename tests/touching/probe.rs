use super::*;

#[test]
fn probe() {
    let k: usize = std::env::var("K").map_or(1, |s| s.parse().unwrap());
    let digits: i32 = std::env::var("DIGITS").map_or(10, |s| s.parse().unwrap());
    let scene = Scene { along: [1.0, 0.0], place: if std::env::var("ZERO").is_ok() { [0.0, 0.0] } else { [0.3, 0.7] }, ..scene(k, if k % 3 == 0 { 0.0 } else { 0.4 }) };
    let rose = std::env::var("ROSE").is_ok();
    let (span, rate) = ((-0.9, -0.4), 1.0);
    let part = (k as f64 * 0.618).fract();
    let at = (span.0 + (span.1 - span.0) * part, rate * (0.8 + 0.4 * (k as f64 * 0.37).fract()));
    let _ = rose;
    macro_rules! go { ($m:ident) => {{
        let model = <$m::At as Curve>::bead(&scene);
        let start = <$m::At as Curve>::start(&model, &scene, at);
        let truth = <$m::At as Curve>::truth(&scene, at, 2.0);
        let run = model.simulate(start).until(2.0).method(methods::Dop853).tolerance(10f64.powi(-digits)).run();
        match run {
            Ok(motion) => {
                for s in motion.steps() {
                    let (x, y) = (s.x() - scene.place[0], s.y() - scene.place[1]);
                    println!("t {:.6} x {:+.6e} y {:+.6e} u {:+.6e} v {:+.6e}", s.t(), x, y, s.x_rate(), s.y_rate());
                }
                println!("truth {truth:?} {}", motion.summary());
            }
            Err(e) => println!("{e}"),
        }
    }}}
    match std::env::var("CURVE").as_deref() { Ok("tacnode") => go!(tacnode), Ok("rose") => go!(rose), Ok("inside") => go!(inside), Ok("cusp") => go!(cusp), _ => go!(osculating) }
}
