// The pictures of the guide are compared with the files in `docs/guide/pictures/`, those of the book (named
// `book/..`) with the files in `docs/book/src/pictures/`. The comments behind the examples call these
// functions (`tests/pages/lib.rs`). `UPDATE_CHARTS=1` writes the pictures instead.
//
// Charts are SVG files that the library writes. A `Drawing` is shown by the pages that the library writes for
// browsers; for the printed page it is painted here, as those pages paint it.

#[allow(dead_code)] // no example needs all of it
mod pictures {
    use std::collections::{BTreeMap, BTreeSet};
    use std::fmt::Write;
    use std::path::{Path, PathBuf};

    use dynamics::output::{Color, Drawing, Figure, Film, Point, Shape};

    /// Machines differ in the last digits. That moves no curve by more than this many pixels.
    const PIXELS: f64 = 2.0;

    fn docs() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs")
    }

    /// The file of a picture.
    fn picture(name: &str) -> PathBuf {
        match name.strip_prefix("book/") {
            Some(name) => docs().join(format!("book/src/pictures/{name}.svg")),
            None => docs().join(format!("guide/pictures/{name}.svg")),
        }
    }

    /// Compares the chart that the example has written, `target/guide/<name>.svg`, or of the book
    /// `target/book/<name>.svg`, with the picture of that name.
    pub fn check(name: &str) {
        let path = match name.starts_with("book/") {
            true => Path::new("target").join(format!("{name}.svg")),
            false => Path::new("target/guide").join(format!("{name}.svg")),
        };
        let now =
            std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        is_current(name, &now);
    }

    fn is_current(name: &str, now: &str) {
        let path = picture(name);
        if std::env::var_os("UPDATE_CHARTS").is_some() {
            return std::fs::write(&path, now).unwrap();
        }
        let file = std::fs::read_to_string(&path)
            .unwrap_or_else(|error| panic!("{}: {error}; set UPDATE_CHARTS=1", path.display()));
        if let Err(difference) = same(now, &file) {
            panic!(
                "{} is not what is drawn now: {difference}; look at it and set UPDATE_CHARTS=1",
                path.display()
            );
        }
    }

    /// Whether two pictures are the same but for some pixels.
    fn same(now: &str, file: &str) -> Result<(), String> {
        let (now, file) = (pieces(now), pieces(file));
        if now.len() != file.len() {
            return Err(format!("{} pieces instead of {}", now.len(), file.len()));
        }
        let differ = |(a, b): &(&&str, &&str)| match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(a), Ok(b)) => (a - b).abs() > PIXELS,
            _ => a != b,
        };
        match now.iter().zip(&file).find(differ) {
            Some((a, b)) => Err(format!("`{a}` instead of `{b}`")),
            None => Ok(()),
        }
    }

    /// Numbers and what is between them.
    fn pieces(text: &str) -> Vec<&str> {
        let is_number = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
        let (mut pieces, mut rest) = (Vec::new(), text);
        while let Some(first) = rest.chars().next() {
            let end = rest.find(|c| is_number(c) != is_number(first)).unwrap_or(rest.len());
            let (piece, after) = rest.split_at(end);
            pieces.push(piece);
            rest = after;
        }
        pieces
    }

    /// Every picture is shown on a page, and every picture that a page shows is there and is written by an
    /// example of that page.
    pub fn all_are_shown() {
        let guide = pages(&docs().join("guide")).into_iter().chain([docs().join("../README.md")]);
        assert_eq!(shown(guide, ""), files(&docs().join("guide/pictures")), "pictures of docs/guide");
        let book = pages(&docs().join("book/src"));
        assert_eq!(shown(book, "book/"), files(&docs().join("book/src/pictures")), "pictures of docs/book");
    }

    fn pages(folder: &Path) -> Vec<PathBuf> {
        let pages = std::fs::read_dir(folder).unwrap().map(|page| page.unwrap().path());
        pages.filter(|page| page.extension().is_some_and(|extension| extension == "md")).collect()
    }

    fn files(folder: &Path) -> BTreeSet<String> {
        let files = std::fs::read_dir(folder).unwrap();
        files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect()
    }

    /// The pictures that pages show; their examples draw them by these names behind the prefix.
    fn shown(pages: impl IntoIterator<Item = PathBuf>, prefix: &str) -> BTreeSet<String> {
        let mut shown = BTreeSet::new();
        for page in pages {
            let text = std::fs::read_to_string(&page).unwrap();
            for rest in text.split("pictures/").skip(1).filter(|rest| rest.contains(".svg)")) {
                let Some(name) = rest.split(".svg)").next().filter(|name| !name.contains(['\n', ' '])) else {
                    continue;
                };
                let drawn = text.contains(&format!("\"{prefix}{name}\");"));
                assert!(drawn, "{}: no example draws {name}", page.display());
                shown.insert(format!("{name}.svg"));
            }
        }
        shown
    }

    // ---- printed text

    /// A block of text on this page of the book is what the example prints. A line `...` stands for any
    /// lines.
    pub fn prints(page: &str, text: &str) {
        let path = docs().join(format!("book/src/{page}.md"));
        let markdown = std::fs::read_to_string(&path).unwrap();
        let blocks: Vec<&str> =
            markdown.split("```text\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
        let is_there = |block: &&str| {
            let mut rest = format!("\n{}\n", text.trim_end());
            block.split("...\n").all(|piece| match rest.find(&format!("\n{piece}")) {
                Some(at) => {
                    rest = rest[at + piece.len()..].to_string();
                    true
                }
                None => false,
            })
        };
        if !blocks.iter().any(is_there) {
            panic!("no block of {} is part of what is printed now:\n{text}", path.display());
        }
    }

    // ---- drawings

    /// Width and height of the picture of a drawing in pixels.
    const SIZE: [f64; 2] = [560.0, 340.0];
    /// Free space at its edges.
    const EDGE: f64 = 34.0;
    /// Instants that a trace is made of.
    const INSTANTS: usize = 240;
    /// Where things of space are seen from: azimuth and elevation in degrees, as the pages have them.
    const EYE: [f64; 2] = [-60.0, 25.0];

    /// Compares the picture of a motion at time `t`, with the traces up to there, with the guide's picture.
    pub fn at(film: &impl Film, t: f64, name: &str) {
        let start = film.span()[0];
        let times: Vec<f64> =
            (0..=INSTANTS).map(|k| start + (t - start) * k as f64 / INSTANTS as f64).collect();
        let mut frames = Vec::new();
        film.play(&times, &mut |drawing, _| frames.push(drawing.clone()));
        is_current(name, &painted(&frames));
    }

    /// Compares the picture of a single drawing with the guide's picture.
    pub fn of(drawing: &Drawing, name: &str) {
        is_current(name, &painted(&[drawing.clone()]));
    }

    /// How places become pixels.
    struct View {
        spatial: bool,
        /// To the right, up and toward the viewer.
        axes: [[f64; 3]; 3],
        middle: [f64; 3],
        distance: f64,
        scale: f64,
        shift: [f64; 2],
    }

    fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }
    fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }
    fn plus(a: [f64; 3], s: f64, b: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| a[i] + s * b[i])
    }
    fn unit(a: [f64; 3]) -> [f64; 3] {
        plus([0.0; 3], 1.0 / dot(a, a).sqrt().max(1e-300), a)
    }
    fn place(point: &Point) -> [f64; 3] {
        match *point {
            Point::Planar([x, y]) => [x, 0.0, y],
            Point::Spatial(at) => at,
        }
    }

    /// The points of a figure, each with the radius of what is around it.
    fn reach(figure: &Figure) -> Vec<([f64; 3], f64)> {
        let all = |points: &[&Point]| points.iter().map(|point| (place(point), 0.0)).collect::<Vec<_>>();
        match figure {
            Figure::Polyline { points, .. } => points.iter().map(|point| (place(point), 0.0)).collect(),
            Figure::Circle { center, radius, .. } | Figure::Arc { center, radius, .. } => {
                vec![(place(center), radius.abs())]
            }
            Figure::Dot { center } => all(&[center]),
            Figure::Spring { from, to, .. } | Figure::Arrow { from, to } | Figure::Ground { from, to } => {
                all(&[from, to])
            }
            Figure::Text { at, .. } | Figure::Trace { at, .. } | Figure::Pivot { at } => all(&[at]),
            Figure::Cuboid { center, faces } => {
                corners(place(center), faces.each_ref().map(place)).into_iter().map(|at| (at, 0.0)).collect()
            }
            Figure::Cone { from, to, radii } => vec![(place(from), radii[0]), (place(to), radii[1])],
            _ => Vec::new(),
        }
    }

    /// The corners of a box, by the signs along its axes.
    fn corners(center: [f64; 3], faces: [[f64; 3]; 3]) -> [[f64; 3]; 8] {
        core::array::from_fn(|k| {
            (0..3).fold(center, |at, axis| {
                let sign = if k >> axis & 1 == 1 { 1.0 } else { -1.0 };
                plus(at, sign, plus(faces[axis], -1.0, center))
            })
        })
    }

    impl View {
        fn of(frames: &[Drawing]) -> Self {
            let figures = || frames.iter().flat_map(Drawing::shapes).map(|shape| &shape.figure);
            let solid = |figure: &Figure| matches!(figure, Figure::Cuboid { .. } | Figure::Cone { .. });
            let in_space = |figure: &Figure| match figure {
                Figure::Polyline { points, .. } => points.iter().any(|p| matches!(p, Point::Spatial(_))),
                Figure::Circle { center, .. } | Figure::Dot { center } => matches!(center, Point::Spatial(_)),
                Figure::Arrow { from, .. } | Figure::Spring { from, .. } => matches!(from, Point::Spatial(_)),
                _ => false,
            };
            let spatial = figures().any(|figure| solid(figure) || in_space(figure));
            let points: Vec<_> =
                figures().flat_map(reach).filter(|(at, _)| at.iter().all(|x| x.is_finite())).collect();
            let bound = |axis: usize, sign: f64| {
                sign * points.iter().map(|(at, r)| sign * at[axis] + r).fold(f64::NEG_INFINITY, f64::max)
            };
            let (lo, hi) = ([0, 1, 2].map(|axis| bound(axis, -1.0)), [0, 1, 2].map(|axis| bound(axis, 1.0)));
            let middle = [0, 1, 2].map(|axis| 0.5 * (lo[axis] + hi[axis]));
            let half = plus([0.0; 3], 0.5, plus(hi, -1.0, lo));
            let [azimuth, elevation] = EYE.map(f64::to_radians);
            let (sa, ca, se, ce) = (azimuth.sin(), azimuth.cos(), elevation.sin(), elevation.cos());
            let axes = match spatial {
                true => [[-sa, ca, 0.0], [-ca * se, -sa * se, ce], [ca * ce, sa * ce, se]],
                false => [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
            };
            let distance = if spatial { 4.0 * dot(half, half).sqrt() } else { f64::INFINITY };
            let mut view = Self { spatial, axes, middle, distance, scale: 1.0, shift: [0.0; 2] };
            let seen: Vec<_> = points.iter().map(|(at, r)| (view.pixel(*at), r * view.nearer(*at))).collect();
            let edge = |axis: usize, sign: f64| {
                sign * seen.iter().map(|(at, r)| sign * at[axis] + r).fold(f64::NEG_INFINITY, f64::max)
            };
            let (left, right, top, bottom) = (edge(0, -1.0), edge(0, 1.0), edge(1, -1.0), edge(1, 1.0));
            let room = SIZE.map(|size| size - 2.0 * EDGE);
            view.scale = (room[0] / (right - left).max(1e-9)).min(room[1] / (bottom - top).max(1e-9));
            view.shift = [0.5 * (left + right), 0.5 * (top + bottom)].map(|x| -x * view.scale);
            view.shift = [view.shift[0] + 0.5 * SIZE[0], view.shift[1] + 0.5 * SIZE[1]];
            view
        }
        fn turned(&self, at: [f64; 3]) -> [f64; 3] {
            let from = plus(at, -1.0, self.middle);
            self.axes.map(|axis| dot(from, axis))
        }
        fn depth(&self, at: [f64; 3]) -> f64 {
            self.turned(at)[2]
        }
        /// How much larger things are there, being nearer.
        fn nearer(&self, at: [f64; 3]) -> f64 {
            if self.spatial { self.distance / (self.distance - self.depth(at)) } else { 1.0 }
        }
        fn pixel(&self, at: [f64; 3]) -> [f64; 2] {
            let ([x, y, _], f) = (self.turned(at), self.nearer(at));
            [self.shift[0] + self.scale * f * x, self.shift[1] - self.scale * f * y]
        }
        fn path(&self, points: &[[f64; 3]]) -> String {
            path(&points.iter().map(|at| self.pixel(*at)).collect::<Vec<_>>())
        }
    }

    fn path(points: &[[f64; 2]]) -> String {
        let mut out = String::new();
        for (k, [x, y]) in points.iter().enumerate() {
            let _ = write!(out, "{}{x:.1},{y:.1}", if k == 0 { "M" } else { "L" });
        }
        out
    }

    /// A piece of the picture: how near it is, and what is written.
    type Piece = (f64, String);

    fn painted(frames: &[Drawing]) -> String {
        let view = View::of(frames);
        let [width, height] = SIZE;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 \
             {width} {height}\" role=\"img\" font-family=\"system-ui, 'Segoe UI', 'DejaVu Sans', Arial, \
             sans-serif\" font-size=\"14\" fill=\"none\" stroke-linejoin=\"round\" \
             stroke-linecap=\"round\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#f7f9fb\"/>\n"
        );
        grid(&view, &mut out);
        traces(&view, frames, &mut out);
        let shapes = frames.last().expect("there is an instant").shapes();
        let mut pieces: Vec<Piece> = shapes.iter().flat_map(|shape| pieces_of(&view, shape)).collect();
        if view.spatial {
            pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        pieces.into_iter().for_each(|(_, piece)| out += &piece);
        out + "</svg>\n"
    }

    fn grid(view: &View, out: &mut String) {
        if view.spatial {
            return;
        }
        let least = 64.0 / view.scale;
        let power = 10f64.powf(least.log10().floor());
        let spacing = [1.0, 2.0, 5.0, 10.0].map(|d| d * power).into_iter().find(|s| *s >= least).unwrap();
        let place = |pixel: f64, axis: usize| {
            let sign = if axis == 0 { 1.0 } else { -1.0 };
            view.middle[2 * axis] + sign * (pixel - view.shift[axis]) / view.scale
        };
        let mut lines = String::new();
        for axis in [0, 1] {
            let (a, b) = (place(0.0, axis), place(SIZE[axis], axis));
            let (mut k, last) = ((a.min(b) / spacing).ceil(), (a.max(b) / spacing).floor());
            while k <= last {
                let mut at = [0.0; 3];
                at[2 * axis] = k * spacing;
                let p = view.pixel(at)[axis];
                let _ = match axis {
                    0 => write!(lines, "M{p:.1},0V{}", SIZE[1]),
                    _ => write!(lines, "M0,{p:.1}H{}", SIZE[0]),
                };
                k += 1.0;
            }
        }
        let _ = writeln!(out, "<path d=\"{lines}\" stroke=\"#e3e8ed\"/>");
    }

    fn traces(view: &View, frames: &[Drawing], out: &mut String) {
        let mut tracks: BTreeMap<&str, (Vec<[f64; 3]>, String)> = BTreeMap::new();
        for shape in frames.iter().flat_map(Drawing::shapes) {
            let Figure::Trace { name, at, .. } = &shape.figure else { continue };
            let track = tracks.entry(name).or_default();
            track.0.push(place(at));
            track.1 = stroke(shape, Color::Accent, 0.75 * shape.width);
        }
        for (points, stroke) in tracks.values().filter(|(points, _)| points.len() > 1) {
            let _ = writeln!(out, "<path d=\"{}\" opacity=\"0.55\"{stroke}/>", view.path(points));
        }
    }

    fn hex(color: Color, own: Color) -> String {
        let color = if color == Color::Auto { own } else { color };
        match color {
            Color::Faint => "#97a1ad".into(),
            Color::Accent | Color::Blue => "#1f6fb4".into(),
            Color::Red => "#cf3f4f".into(),
            Color::Green => "#23895e".into(),
            Color::Amber => "#bd7e00".into(),
            Color::Purple => "#7d4fb3".into(),
            Color::Teal => "#128a99".into(),
            Color::Brown => "#8a5738".into(),
            Color::Pink => "#c24e98".into(),
            Color::Rgb(r, g, b) => format!("#{r:02x}{g:02x}{b:02x}"),
            _ => "#1d2530".into(),
        }
    }

    fn stroke(shape: &Shape, own: Color, width: f64) -> String {
        let dashes = if shape.dashed { " stroke-dasharray=\"6 5\"" } else { "" };
        format!(" stroke=\"{}\" stroke-width=\"{width}\"{dashes}", hex(shape.color, own))
    }

    fn pieces_of(view: &View, shape: &Shape) -> Vec<Piece> {
        let ink = |width: f64| stroke(shape, Color::Ink, width);
        let near =
            |points: &[[f64; 3]]| points.iter().map(|at| view.depth(*at)).sum::<f64>() / points.len() as f64;
        let fill = shape.fill.map_or(String::new(), |fill| format!(" fill=\"{}\"", hex(fill, Color::Ink)));
        let one = |at: &[[f64; 3]], text: String| vec![(near(at), text)];
        match &shape.figure {
            Figure::Polyline { points, closed } => {
                let points: Vec<_> = points.iter().map(place).collect();
                let (end, fill) = if *closed { ("Z", fill.as_str()) } else { ("", "") };
                one(&points, format!("<path d=\"{}{end}\"{fill}{}/>\n", view.path(&points), ink(shape.width)))
            }
            Figure::Circle { center, radius, filled } => {
                let at = place(center);
                let ([x, y], r) = (view.pixel(at), radius.abs() * view.scale * view.nearer(at));
                let look = match filled {
                    true => format!(" fill=\"{}\"", hex(shape.color, Color::Accent)),
                    false => fill + &ink(shape.width),
                };
                one(&[at], format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\"{look}/>\n", r.max(1.5)))
            }
            Figure::Arc { center, radius, from, to } => {
                let c = place(center);
                let at = |k: i32| from + (to - from) * f64::from(k) / 48.0;
                let points: Vec<_> =
                    (0..=48).map(|k| plus(c, *radius, [at(k).cos(), 0.0, at(k).sin()])).collect();
                one(&points, format!("<path d=\"{}\"{}/>\n", view.path(&points), ink(shape.width)))
            }
            Figure::Dot { center } => {
                let [x, y] = view.pixel(place(center));
                let fill = hex(shape.color, Color::Accent);
                one(
                    &[place(center)],
                    format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6\" fill=\"{fill}\"/>\n"),
                )
            }
            Figure::Spring { from, to, coils } => {
                let ends = [place(from), place(to)];
                one(
                    &ends,
                    format!(
                        "<path d=\"{}\"{}/>\n",
                        spring(ends.map(|at| view.pixel(at)), *coils),
                        ink(shape.width)
                    ),
                )
            }
            Figure::Arrow { from, to } => {
                let ends = [place(from), place(to)];
                one(
                    &ends,
                    arrow(ends.map(|at| view.pixel(at)), &ink(shape.width), &hex(shape.color, Color::Ink)),
                )
            }
            Figure::Text { at, text, beside } => {
                let ([x, y], shift) = (view.pixel(place(at)), if *beside { 11.0 } else { 0.0 });
                let anchor = if *beside { "start" } else { "middle" };
                let text = text.replace('&', "&amp;").replace('<', "&lt;");
                let fill = hex(shape.color, Color::Ink);
                let (x, y) = (x + shift, y - shift + 5.0);
                vec![(
                    f64::INFINITY,
                    format!(
                        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" \
                         fill=\"{fill}\">{text}</text>\n"
                    ),
                )]
            }
            Figure::Ground { from, to } => {
                let ends = [place(from), place(to)];
                one(&ends, ground(ends.map(|at| view.pixel(at)), shape))
            }
            Figure::Pivot { at } => {
                let [x, y] = view.pixel(place(at));
                let pen = stroke(shape, Color::Faint, shape.width);
                one(
                    &[place(at)],
                    format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"#f7f9fb\"{pen}/>\n"),
                )
            }
            Figure::Cuboid { center, faces } => {
                cuboid(view, place(center), faces.each_ref().map(place), shape)
            }
            Figure::Cone { from, to, radii } => cone(view, place(from), place(to), *radii, shape),
            _ => Vec::new(),
        }
    }

    fn along([a, b]: [[f64; 2]; 2]) -> (f64, [f64; 2]) {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]).max(1e-9);
        (length, [(b[0] - a[0]) / length, (b[1] - a[1]) / length])
    }

    fn spring([a, b]: [[f64; 2]; 2], coils: u32) -> String {
        let (length, [ex, ey]) = along([a, b]);
        let (straight, turns) = (0.1 * length, 2 * coils);
        let at = |s: f64, side: f64| [a[0] + s * ex - side * ey, a[1] + s * ey + side * ex];
        let zigzag = (0..turns).map(|k| {
            let s = straight + (length - 2.0 * straight) * (f64::from(k) + 0.5) / f64::from(turns);
            at(s, if k % 2 == 1 { -7.0 } else { 7.0 })
        });
        let points: Vec<_> =
            [a, at(straight, 0.0)].into_iter().chain(zigzag).chain([at(length - straight, 0.0), b]).collect();
        path(&points)
    }

    fn arrow([a, b]: [[f64; 2]; 2], pen: &str, fill: &str) -> String {
        let (length, [ex, ey]) = along([a, b]);
        let head = f64::min(11.0, 0.6 * length);
        let at = |s: f64, side: f64| [b[0] - s * ex - side * ey, b[1] - s * ey + side * ex];
        let (shaft, tip) = ([a, at(0.8 * head, 0.0)], [b, at(head, 0.45 * head), at(head, -0.45 * head)]);
        format!("<path d=\"{}\"{pen}/>\n<path d=\"{}Z\" fill=\"{fill}\"/>\n", path(&shaft), path(&tip))
    }

    fn ground([a, b]: [[f64; 2]; 2], shape: &Shape) -> String {
        let (length, [ex, ey]) = along([a, b]);
        let (size, mut hatch, mut s) = (9.0, String::new(), 4.5);
        while s <= length {
            let top = [a[0] + s * ex, a[1] + s * ey];
            let foot = [a[0] + (s - size) * ex - size * ey, a[1] + (s - size) * ey + size * ex];
            hatch += &path(&[top, foot]);
            s += size;
        }
        let pen = |width| stroke(shape, Color::Faint, width);
        format!("<path d=\"{}\"{}/>\n<path d=\"{hatch}\"{}/>\n", path(&[a, b]), pen(shape.width), pen(1.0))
    }

    /// The faces of a solid that are seen.
    fn visible(
        view: &View,
        faces: Vec<(Vec<[f64; 3]>, bool)>,
        middle: [f64; 3],
        shape: &Shape,
    ) -> Vec<Piece> {
        let color = hex(shape.fill.unwrap_or(shape.color), Color::Accent);
        let lit = |bright: f64| {
            let part = |k: usize| f64::from(u8::from_str_radix(&color[k..k + 2], 16).unwrap());
            let glare = (bright - 1.0).max(0.0);
            let shade =
                |value: f64| (value * bright.min(1.0) + glare * (255.0 - value * bright.min(1.0))) as u8;
            format!("#{:02x}{:02x}{:02x}", shade(part(1)), shade(part(3)), shade(part(5)))
        };
        let mut seen = Vec::new();
        for (corners, edges) in faces {
            let at = corners.iter().fold([0.0; 3], |sum, c| plus(sum, 1.0 / corners.len() as f64, *c));
            let sides = [corners[1], corners[corners.len() - 1]].map(|c| plus(c, -1.0, corners[0]));
            let mut normal = unit(cross(sides[0], sides[1]));
            if dot(normal, plus(at, -1.0, middle)) < 0.0 {
                normal = plus([0.0; 3], -1.0, normal);
            }
            let (n, p) = (view.axes.map(|axis| dot(normal, axis)), view.turned(at));
            if -n[0] * p[0] - n[1] * p[1] + n[2] * (view.distance - p[2]) <= 0.0 {
                continue;
            }
            let bright = 0.72 + 0.4 * dot(n, [-0.42, 0.7, 0.58]).max(0.0);
            let (fill, edge) = (lit(bright), if edges { lit(0.5) } else { lit(bright) });
            let face = view.path(&corners);
            seen.push((
                p[2],
                format!("<path d=\"{face}Z\" fill=\"{fill}\" stroke=\"{edge}\" stroke-width=\"0.8\"/>\n"),
            ));
        }
        seen
    }

    fn cuboid(view: &View, center: [f64; 3], faces: [[f64; 3]; 3], shape: &Shape) -> Vec<Piece> {
        let all = corners(center, faces);
        let face = |axis: usize, side: usize| {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let corner = |i: usize, j: usize| all[side << axis | i << a | j << b];
            (vec![corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)], true)
        };
        let faces = (0..3).flat_map(|axis| [face(axis, 0), face(axis, 1)]).collect();
        visible(view, faces, center, shape)
    }

    fn cone(view: &View, from: [f64; 3], to: [f64; 3], radii: [f64; 2], shape: &Shape) -> Vec<Piece> {
        let axis = unit(plus(to, -1.0, from));
        let side = if axis[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
        let e1 = unit(cross(axis, side));
        let e2 = cross(axis, e1);
        let ring = |center: [f64; 3], radius: f64| -> Vec<[f64; 3]> {
            let angle = |k: u32| std::f64::consts::TAU * f64::from(k) / 40.0;
            (0..40)
                .map(|k| plus(plus(center, radius * angle(k).cos(), e1), radius * angle(k).sin(), e2))
                .collect()
        };
        let (a, b) = (ring(from, radii[0]), ring(to, radii[1]));
        let mut faces: Vec<_> = (0..40)
            .map(|k| (k, (k + 1) % 40))
            .map(|(k, next)| match radii[1] > 0.0 {
                true => (vec![a[k], a[next], b[next], b[k]], false),
                false => (vec![a[k], a[next], to], false),
            })
            .collect();
        faces.push((a.clone(), true));
        if radii[1] > 0.0 {
            faces.push((b.clone(), true));
        }
        visible(view, faces, plus(plus([0.0; 3], 0.5, from), 0.5, to), shape)
    }
}
