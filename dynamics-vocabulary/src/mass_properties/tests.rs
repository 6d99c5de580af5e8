use super::*;

fn distance(a: Mat3<f64>, b: Mat3<f64>) -> f64 {
    (a - b).to_array().into_iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()))
}

fn rotation() -> Mat3<f64> {
    Mat3::axis_angle(Vec3::new(1.0, -2.0, 0.5), 1.1).value()
}

#[test]
fn halves_make_the_whole() {
    let half = MassProperties::new(1.0, Inertia::cuboid(1.0, 0.5, 2.0, 3.0).value());
    let (left, right) = (half.moved(Vec3::new(-0.25, 0.0, 0.0)), half.moved(Vec3::new(0.25, 0.0, 0.0)));
    let whole = left + right;
    assert!(distance(whole.inertia, Inertia::cuboid(2.0, 1.0, 2.0, 3.0).value()) < 1e-15);
    let again = whole.without(right);
    assert!(distance(again.inertia, left.inertia) < 1e-15 && (again.center - left.center).norm() < 1e-15);
    let turned = whole.turned(rotation()).moved(Vec3::new(1.0, 2.0, 3.0));
    let by_parts = left.turned(rotation()) + right.turned(rotation());
    assert!(distance(turned.inertia, by_parts.inertia) < 1e-14);
    let about = turned.inertia_about(Vec3::new(1.0, 2.0, 3.0));
    assert!(distance(about, turned.inertia) < 1e-15);
    let points = MassProperties::point(2.0, Vec3::new(1.0, 0.0, 0.0))
        + MassProperties::point(2.0, Vec3::new(-1.0, 0.0, 0.0));
    assert_eq!(points.inertia, Mat3::diagonal(0.0, 4.0, 4.0));
}

#[test]
fn halves_of_solids_make_the_whole() {
    let upside_down = Mat3::rotation_x(core::f64::consts::PI);
    let half = MassProperties::hemisphere(1.5, 0.7);
    let sphere = half + half.turned(upside_down);
    assert!(distance(sphere.inertia, Inertia::sphere(3.0, 0.7).value()) < 1e-15);
    assert!(sphere.center.norm() < 1e-15);

    let half = MassProperties::half_cylinder(1.5, 0.7, 2.0);
    let cylinder = half + half.turned(Mat3::rotation_z(core::f64::consts::PI));
    assert!(distance(cylinder.inertia, Inertia::cylinder(3.0, 0.7, 2.0).value()) < 1e-15);
    assert!(cylinder.center.norm() < 1e-15);

    // Two triangles make a rectangle, wherever and however it is.
    let corner = |x: f64, y: f64| rotation() * Vec3::new(x, y, 0.0) + Vec3::new(1.0, 2.0, 3.0);
    let [a, b, c, d] = [corner(-0.5, -0.8), corner(0.5, -0.8), corner(0.5, 0.8), corner(-0.5, 0.8)];
    let plate = MassProperties::triangle(1.0, [a, b, c]) + MassProperties::triangle(1.0, [c, d, a]);
    let expected = MassProperties::new(2.0, Inertia::plate(2.0, 1.0, 1.6).value()).turned(rotation());
    assert!(distance(plate.inertia, expected.inertia) < 1e-15);
    assert!((plate.center - Vec3::new(1.0, 2.0, 3.0)).norm() < 1e-15);

    let ring = MassProperties::ring(2.0, 0.5);
    assert!(distance(ring.inertia, Inertia::tube(2.0, 0.5, 0.5, 0.0).value()) < 1e-16);
    for body in [half, plate, ring, MassProperties::hemisphere(1.0, 1.0)] {
        body.check().expect("a body has it");
    }
}

#[test]
fn principal_axes_of_turned_bodies() {
    for moments in [
        [1.0, 2.0, 2.5],
        [1.0, 1.0, 2.0],
        [3.0, 3.0, 3.0],
        [1e-8, 1.0, 1.0],
        [2.0, 2.0 + 1e-12, 3.0],
        [0.0, 0.0, 0.0],
    ] {
        let [a, b, c] = moments;
        for r in [Mat3::IDENTITY.value(), rotation(), Mat3::rotation_y(core::f64::consts::FRAC_PI_2)] {
            let inertia = r * Mat3::diagonal(c, a, b) * r.transpose();
            let found = MassProperties::new(1.0, inertia).principal_axes().expect("a body has it");
            for (found, given) in found.moments.iter().zip(moments) {
                assert!((found - given).abs() < 1e-15 * c.max(1.0), "{moments:?}: {found}");
            }
            found.rotation.check_rotation().expect("axes of a body");
            let [x, y, z] = found.moments;
            let again = found.rotation * Mat3::diagonal(x, y, z) * found.rotation.transpose();
            assert!(distance(again, inertia) < 3e-15, "{moments:?}");
        }
    }
}

#[test]
fn what_no_body_has_is_refused() {
    let check = |inertia| MassProperties::new(1.0, inertia).check();
    assert!(
        matches!(check(Mat3::diagonal(1.0, 1.0, 2.0001)), Err(UnphysicalInertia::Triangle { .. }))
            && check(Mat3::diagonal(0.333_333, 0.333_333, 0.666_667)).is_ok()
    );
    let flat = check(Mat3::diagonal(1.0, 1.0, 2.1));
    assert!(matches!(flat, Err(UnphysicalInertia::Triangle { moments: [_, _, c] }) if c == 2.1));
    let negative = check(Mat3::diagonal(1.0, -1.0, 1.0));
    assert!(matches!(negative, Err(UnphysicalInertia::NegativeMoment { moments: [a, ..] }) if a == -1.0));
    let product = Mat3::from([[1.0, 0.2, 0.0], [-0.2, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let refused = UnphysicalInertia::NotSymmetric { i: 0, j: 1, elements: [0.2, -0.2] };
    assert_eq!(check(product), Err(refused));
    assert_eq!(check(Mat3::diagonal(1.0, f64::NAN, 1.0)), Err(UnphysicalInertia::NotFinite));
    assert_eq!(MassProperties::new(-1.0, Mat3::default()).check(), Err(UnphysicalInertia::Mass(-1.0)));
    let body = MassProperties::new(1.0, Mat3::diagonal(1.0, 1.0, 1.0));
    let nowhere = body.moved(Vec3::new(f64::NAN, 0.0, 0.0));
    assert!(matches!(nowhere.check(), Err(UnphysicalInertia::Center([x, ..])) if x.is_nan()));
    let massless = MassProperties { mass: 0.0, ..body };
    assert_eq!(massless.check(), Err(UnphysicalInertia::WithoutMass { inertia: 1.0 }));
    MassProperties::new(0.0, Mat3::default()).check().expect("nothing is a body");
    // Plates and rods are on the boundary, to rounding.
    for thin in [Inertia::plate(0.7, 0.3, 1.1), Inertia::rod(1.3, 0.7)] {
        let r = rotation();
        check(r * thin.value() * r.transpose()).expect("it is thin, and a body");
    }
    let text = std::format!("{refused}");
    assert!(text.contains("(0, 1)") && text.contains("; "), "{text}");
}

/// A box of twelve triangles, anywhere.
#[cfg(feature = "alloc")]
fn cuboid(size: [f64; 3], r: Mat3<f64>, place: Vec3<f64>) -> (std::vec::Vec<Vec3<f64>>, [[usize; 3]; 12]) {
    let corner = |k: usize| {
        let [x, y, z] = [0, 1, 2].map(|i| size[i] * (f64::from(u8::from(k >> i & 1 == 1)) - 0.5));
        place + r * Vec3::new(x, y, z)
    };
    let faces = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    ((0..8).map(corner).collect(), faces)
}

#[cfg(feature = "alloc")]
#[test]
fn meshes() {
    let (size, place) = ([1.0, 2.0, 3.0], Vec3::new(100.0, -50.0, 30.0));
    let (vertices, triangles) = cuboid(size, rotation(), place);
    let body = MassProperties::mesh(0.5, &vertices, &triangles).expect("a closed box");
    let expected =
        MassProperties::new(3.0, Inertia::cuboid(3.0, 1.0, 2.0, 3.0).value()).turned(rotation()).moved(place);
    assert!((body.mass - 3.0).abs() < 1e-13 && (body.center - place).norm() < 1e-13);
    assert!(distance(body.inertia, expected.inertia) < 1e-12, "{:?}", body.inertia);

    let mut open = triangles;
    open[3] = open[2];
    assert!(matches!(MassProperties::mesh(0.5, &vertices, &open), Err(MeshError::Open { .. })));
    assert!(matches!(MassProperties::mesh(0.5, &vertices, &triangles[1..]), Err(MeshError::Open { .. })));
    let inverted = triangles.map(|[a, b, c]| [a, c, b]);
    let inverted = MassProperties::mesh(0.5, &vertices, &inverted);
    let Err(MeshError::Inverted { volume }) = inverted else { panic!("{inverted:?}") };
    assert!((volume + 6.0).abs() < 1e-12);
    let mut beyond = triangles;
    beyond[0][1] = 8;
    assert_eq!(
        MassProperties::mesh(0.5, &vertices, &beyond),
        Err(MeshError::NoVertex { triangle: 0, vertex: 8 })
    );
    assert_eq!(MassProperties::mesh(f64::NAN, &vertices, &triangles), Err(MeshError::NotFinite));
}

/// Rounding gives a flat surface a volume of either sign; what is thin has one.
#[cfg(feature = "alloc")]
#[test]
fn flat_meshes_are_refused_in_every_attitude() {
    for k in 0..200 {
        let k = f64::from(k);
        let axis = Vec3::new(1.0 + k, -2.0 + 0.3 * k, 0.5 - 0.7 * k);
        let r = Mat3::axis_angle(axis, 0.37 * k).value();
        for size in [1e-30, 1.0, 1e30] {
            let place = r * Vec3::new(0.3 * k, 1.0, -k) * size;
            let (vertices, triangles) = cuboid([size, 2.0 * size, 0.0], r, place);
            let found = MassProperties::mesh(1.0, &vertices, &triangles);
            assert!(matches!(found, Err(MeshError::Flat { .. })), "{k}, {size:e}: {found:?}");
        }
        let (vertices, triangles) = cuboid([1.0, 2.0, 1e-9], r, Vec3::new(0.0, 0.0, 0.0));
        let thin = MassProperties::mesh(1.0, &vertices, &triangles).expect("a foil is a body");
        assert!((thin.mass - 2e-9).abs() < 1e-6 * 2e-9, "{k}: {}", thin.mass);
    }
    let (vertices, triangles) = cuboid([1.0, 2.0, 3.0], rotation(), Vec3::new(0.0, 0.0, 0.0));
    for density in [-6.0, 0.0] {
        assert_eq!(MassProperties::mesh(density, &vertices, &triangles), Err(MeshError::Density(density)));
    }
    assert!(matches!(MassProperties::mesh(1.0, &[], &[]), Err(MeshError::Flat { .. })));
}
