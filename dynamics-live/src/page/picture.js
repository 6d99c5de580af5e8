// The picture: figures of the model, the part of its plane or space that is seen, and dragging.
"use strict";
const DIMENSION = MODEL.space ? 3 : 2;
const MOST_TRACED = 6;   // of more points only the last of each function has a trace
const OWN_COLOR = {
  disc: "accent", dot: "accent", trace: "accent", cuboid: "accent", cone: "accent", ground: "faint",
  pivot: "faint",
};

// A figure of the painters from one as the macro prints it: [kind, offsets, style, extra].
//
// `kind` is that of `Figure` in lower case. `offsets` are the places of its numbers in the results of its
// program; [first, count] stands for `count` places one after another. `style` is { color, fill, width,
// dashed }, each where it is not usual. `extra` is { dimension, closed, filled, coils, text, beside, name };
// `seconds: true` where a trace has its length behind its point, and `shown: true` where the last number is
// zero while the figure is not drawn.
function figureOf([kind, offsets, style = {}, extra = {}]) {
  const run = ([first, count]) => Array.from({ length: count }, (_, k) => first + k);
  const at = offsets.flatMap((offset) => (Array.isArray(offset) ? run(offset) : [offset]));
  const k = kind === "circle" && extra.filled ? "disc" : kind === "polyline" ? "line" : kind;
  const { color = "auto", fill, width, dashed } = style, { dimension = DIMENSION } = extra;
  const figure = {
    k, f: fill, w: width, d: dashed, z: extra.closed, b: extra.beside,
    c: color === "auto" ? OWN_COLOR[k] ?? "ink" : color,
  };
  const shown = extra.shown ? at.pop() : null, seconds = extra.seconds ? at.pop() : null;
  if (k === "line") figure.n = at.length / dimension;
  if (k === "spring") figure.n = extra.coils;
  return { figure, at, dimension, shown, seconds, words: extra.text ?? "", name: extra.name };
}

// The picture of a model without one of its own: a chain from the origin through its points, as
// `Drawing::of_helpers` has it; coordinates x and y alone are dots.
function defaultFigures(points) {
  const places = [], extra = ({ name, dimension }) => ({ name, dimension });
  let next = 0;
  for (const { dimension } of points) {
    places.push([[next, dimension]]);
    next += dimension;
  }
  // Numbers that no program writes, and so are zero, stand behind the others.
  const zero = next, inSpace = points.some(({ dimension }) => dimension === 3);
  const dots = points.map((point, k) => ["dot", places[k], {}, extra(point)]);
  const base = ({ name }) => name.replace(/\[\d+\]$/, ""), all = points.length <= MOST_TRACED;
  const ends = (k) => all || !points[k + 1] || base(points[k + 1]) !== base(points[k]);
  const traces = points.map((point, k) => ["trace", places[k], {}, extra(point)]).filter((_, k) => ends(k));
  if (points[0].name.includes(", ")) return [...traces, ...dots];
  // A chain through points of the plane and of space is one of space: (x, y) becomes (x, 0, y).
  const dimension = inSpace ? 3 : 2, origin = [[zero, dimension]];
  const joints = points.flatMap((point, k) => {
    const [[first]] = places[k];
    return point.dimension < dimension ? [first, zero, first + 1] : places[k];
  });
  const chain = ["polyline", [...origin, ...joints], {}, { dimension }];
  return [...traces, chain, ["pivot", origin, {}, { dimension }], ...dots];
}

// A picture without named points is taken hold of by its discs and dots.
function pointsFromDrawing() {
  const { drawing, figures } = PROGRAMS;
  if (PROGRAMS.points || !figures) return;
  const held = figures.map(figureOf).filter(({ figure }) => figure.k === "disc" || figure.k === "dot");
  const at = held.flatMap(({ at, dimension }) => at.slice(0, dimension));
  const numbers = new Float64Array(drawing.results);
  if (!at.length) return;
  MODEL.points = held.map(({ figure, dimension }, k) => ({ name: `${figure.k} ${k + 1}`, dimension }));
  PROGRAMS.points = {
    ...drawing, results: at.length, dimensions: MODEL.points.map(({ dimension }) => dimension),
    run(...given) {
      const out = given.pop();
      drawing.run(...given, numbers);
      at.forEach((place, k) => { out[k] = numbers[place]; });
    },
  };
}
pointsFromDrawing();

class Picture {
  constructor(canvas, player) {
    this.canvas = canvas;
    this.player = player;
    // The eye of recorded pages.
    const eye = [-60, 25].map((degrees) => degrees * Math.PI / 180);
    this.space = MODEL.space ? makeSpace({ half: [1, 1, 1], eye }) : null;
    this.sight = this.space ?? makePlane();
    this.painter = makePaint(this.sight);
    const { drawing, figures, points } = PROGRAMS, program = figures ? drawing : points;
    this.program = program ?? null;
    this.dynamic = /\b[al]\[/.test(program?.run);   // whether it reads q̈ or λ
    this.k = new Float64Array(program?.constants ?? 0);
    this.figures = (figures ?? (points ? defaultFigures(MODEL.points) : [])).map(figureOf);
    this.traces = this.figures.flatMap(({ figure }, k) => (figure.k === "trace" ? [k] : []));
    this.seen = new Float64Array(MODEL.parameters.length).fill(NaN);   // parameters of the constants
    // The origin of a default picture stands behind the results.
    this.numbers = new Float64Array(program ? program.results + DIMENSION : 0);
    this.a = new Float64Array(N);
    this.l = new Float64Array(MODEL.rows.length);
    this.middle = [0, 0, 0].slice(0, DIMENSION);
    this.half = null;
    this.box = null;
    this.grip = 0;           // the handle that arrow keys move
    this.held = null;
    this.look = null;        // what the viewer chooses to see
    this.numbered = true;    // whether the grid has numbers
    player.onRecord = (instant) => this.record(instant);
  }

  // The numbers of every figure at a state, as its painter takes them; null for one that is not drawn.
  sample(t, y, motion = this.player.motion) {
    const q = y.subarray(0, N), u = y.subarray(N), { program, k, a, l, numbers } = this, { system } = motion;
    if (this.dynamic) {
      const count = system.evaluations;
      if (!system.accelerate(t, q, u, a, l)) { a.fill(NaN); l.fill(NaN); }
      system.evaluations = count;
    }
    // Constants are computed anew where parameters have changed.
    if (system.p.some((value, i) => value !== this.seen[i])) {
      this.seen.set(system.p);
      program.hoist?.(system.p, system.f, k);
    }
    program.run(system.p, k, system.f, t, q, u, system.w, system.m, a, l, numbers);
    return this.figures.map((item) => {
      if (item.shown !== null && numbers[item.shown] === 0) return null;
      const v = this.numbersOf(item);
      return v.every(Number.isFinite) ? v : null;
    });
  }
  // In space, a point of the plane stands in the plane of x and z.
  numbersOf({ figure, at, dimension }) {
    const v = [], count = pointsOf(figure), rest = numbersAfterPoints[figure.k] ?? 0;
    const of = (k) => this.numbers[at[k]];
    for (let k = 0; k < count * dimension; k += dimension) {
      if (this.space && dimension === 2) v.push(of(k), 0, of(k + 1));
      else for (let axis = 0; axis < dimension; axis++) v.push(of(k + axis));
    }
    for (let k = 0; k < rest; k++) v.push(of(count * dimension + k));
    // The painters count angles in 1/10,000 rad.
    if (figure.k === "arc") for (const k of [1, 2]) v[v.length - k] *= 1e4;
    return v;
  }
  // The same from the middle of the view.
  shift(figure, v) {
    const count = DIMENSION * pointsOf(figure);
    return v.map((x, k) => (k < count ? x - this.middle[k % DIMENSION] : x));
  }

  // ---- what is seen

  record(instant) {
    if (!this.program) return;
    const sample = this.sample(instant.t, instant.y);
    this.include(sample);
    instant.trace = this.traces.map((k) => sample[k]);
  }
  // Widens the box of what has to be seen by a picture.
  include(sample) {
    const fill = (value) => new Array(DIMENSION).fill(value);
    const box = (this.box ??= { lo: fill(Infinity), hi: fill(-Infinity) });
    const visit = (point, radius) => {
      if (!point.every((x) => Math.abs(x) < 1e150)) return;
      point.forEach((x, axis) => {
        box.lo[axis] = Math.min(box.lo[axis], x - radius);
        box.hi[axis] = Math.max(box.hi[axis], x + radius);
      });
    };
    this.figures.forEach(({ figure }, i) => {
      const v = sample[i], count = pointsOf(figure);
      if (!v) return;
      if (this.space) { this.space.places(figure, v, count, visit); return; }
      const radius = ["disc", "circle", "arc"].includes(figure.k) ? Math.abs(v[2]) : 0;
      for (let k = 0; k < count; k++) visit(v.slice(2 * k, 2 * k + 2), radius);
    });
  }
  // Forgets what was seen, so that the view closes in on a new start.
  forget() { this.box = null; }

  // Brings the view nearer to the box: at once where nothing was seen before or nothing may glide.
  settle() {
    const { box } = this;
    if (!box || !(box.lo[0] <= box.hi[0])) return;
    // What the viewer has chosen to see of the plane stays.
    this.gliding = false;
    if (this.half && !this.space && !this.sight.whole) return;
    const middle = box.lo.map((lo, axis) => (lo + box.hi[axis]) / 2);
    const sides = box.lo.map((lo, axis) => (box.hi[axis] - lo) / 2);
    const most = Math.max(...sides), least = 1e-9 * Math.max(...middle.map(Math.abs));
    const half = sides.map((side) => (most > least ? Math.max(side, 0.02 * most) : 1));
    const part = this.half && !reducedMotion() ? 0.12 : 1, toward = (a, b) => a + part * (b - a);
    const before = this.half ?? half;
    this.middle = this.middle.map((x, axis) => toward(x, middle[axis]));
    this.half = before.map((x, axis) => toward(x, half[axis]));
    this.gliding = part < 1 && this.half.some((x, axis) =>
      Math.abs(x - half[axis]) + Math.abs(this.middle[axis] - middle[axis]) > 1e-3 * most);
    if (!this.gliding) { this.middle = middle; this.half = half; }
    this.space?.resize(this.half);
  }
  // Scale and place of the middle that leave room at the edges for signs of fixed size.
  fit(width, height) {
    const words = this.figures.some(({ figure }) => figure.k === "text");
    const edge = Math.min(34, 0.09 * Math.min(width, height));
    let [left, right, down, up] = [-this.half[0], this.half[0], -this.half[1], this.half[1]];
    if (this.space) {
      const corners = (visit) => {
        for (let k = 0; k < 8; k++) visit(this.half.map((x, axis) => (k >> axis & 1 ? x : -x)), 0);
      };
      [left, right, down, up] = this.space.extent(corners);
    }
    // In the plane the choice of what to follow stands above, and may not lie on a point.
    const above = this.space || !this.numbered ? edge : Math.max(edge, 50);
    const across = width - 2 * edge - (words ? 60 : 0), upright = height - edge - above;
    const scale = Math.min(across / Math.max(right - left, 1e-300), upright / Math.max(up - down, 1e-300));
    const middle = (height + above - edge) / 2;
    return { scale, x: width / 2 - scale * (left + right) / 2, y: middle + scale * (up + down) / 2 };
  }

  // ---- painting

  draw() {
    const { pen, width, height } = prepare(this.canvas), { painter, space, player } = this;
    if (!(width > 1) || !this.program) return;
    if (!this.held) this.settle();
    if (!this.half) return;
    const sample = this.sample(player.time(), player.now);
    // Under a finger the view stands.
    if (!this.held) this.look?.follow(() => this.followable(sample));
    painter.aim(this.fit(width, height), width, height);
    this.spacing = space ? painter.drawFloor(pen, this.middle, 1)
      : painter.drawGrid(pen, width, height, this.middle, 1, this.numbered ? MODEL.length_unit ?? "" : null);
    this.drawTraces(pen, sample);
    painter.paint(pen, this.figures.flatMap(({ figure, words }, k) =>
      (sample[k] ? painter.piecesOf(figure, this.shift(figure, sample[k]), "blue", words) : [])));
    this.drawGrip(pen);
  }
  // What can stay in the middle: points of traces that have names, or the model's points.
  get followed() {
    const named = this.traces.filter((k) => this.figures[k].name);
    return named.length ? named.map((k) => ({ name: this.figures[k].name, k })) : this.handles();
  }
  followable(sample) {
    return this.followed.map(({ k, place }) => {
      const point = place ? place() : sample[k];
      return point && point.map((x, axis) => x - this.middle[axis]);
    });
  }
  drawTraces(pen, sample) {
    const { player } = this, nowhere = new Array(DIMENSION).fill(NaN);
    this.traces.forEach((k, index) => {
      const { figure, seconds } = this.figures[k], place = (v) => (v ? this.shift(figure, v) : nowhere);
      const reach = seconds === null ? null : Math.ceil(this.numbers[seconds] / player.dt);
      this.painter.drawTrace(pen, figure, "blue", {
        at: (instant) => place(player.instant(instant).trace[index]), head: place(sample[k]),
        first: player.first, end: Math.min(Math.floor(player.head), player.last),
        reach, perSecond: RATE * player.speed,
      });
    });
  }
  drawGrip(pen) {
    const keys = document.activeElement === this.canvas && this.canvas.matches(":focus-visible");
    const handle = this.held ? this.held.handle : keys ? this.handles()[this.grip] : null;
    if (!handle) return;
    const [x, y] = this.onCanvas(handle.place());
    pen.strokeStyle = palette.blue;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(x, y, 19, 0, 2 * Math.PI);
    pen.stroke();
  }
  onCanvas(point) {
    const at = point.map((x, axis) => x - this.middle[axis]);
    const [x, y] = this.space ? this.space.project(at) : at;
    return [this.painter.px(x), this.painter.py(y)];
  }

  // ---- dragging

  // What can be taken hold of: the points of the model, but no vector that depends on velocities.
  handles() {
    const { player } = this, fixed = (this.fixed ??= this.placesAlone());
    let next = 0;
    const all = (PROGRAMS.points ? MODEL.points : []).map(({ name, dimension }, index) => {
      const first = next;
      next += dimension;
      const place = () => {
        const y = player.show(), { motion } = player;
        const out = motion.system.value("points", player.time(), y.subarray(0, N), y.subarray(N));
        const at = Array.from(out.slice(first, first + dimension));
        return this.space && dimension === 2 ? [at[0], 0, at[1]] : at;
      };
      return { name, dimension, index, first, place };
    });
    return all.filter(({ index }) => fixed[index]);
  }
  // Which points are places: those that other velocities leave where they are.
  placesAlone() {
    if (!PROGRAMS.points) return [];
    const { system, t, q, u } = this.player.motion, at = (u) => system.value("points", t, q, u).slice();
    const [here, there] = [at(u), at(u.map((x) => x + 1))];
    let next = 0;
    return MODEL.points.map(({ dimension }) => {
      const first = next;
      next += dimension;
      return here.subarray(first, next).every((x, k) => x === there[first + k]);
    });
  }
  // The handle under a finger, or null.
  handleAt(x, y, fingers) {
    if (this.player.refused) return null;
    let best = fingers ? 46 : 30, found = null;
    for (const handle of this.handles()) {
      const [px, py] = this.onCanvas(handle.place()), distance = Math.hypot(px - x, py - y);
      if (distance <= best) { best = distance; found = handle; }
    }
    return found;
  }
  // The place at a point of the canvas; in space, as far from the eye as the handle is.
  placeAt(x, y, near) {
    const { view } = this.painter, at = [(x - view.x) / view.scale, (view.y - y) / view.scale];
    if (!this.space) return at.map((value, axis) => value + this.middle[axis]);
    return this.space.unproject(at, near.map((value, axis) => value - this.middle[axis]))
      .map((value, axis) => value + this.middle[axis]);
  }
  // Moves the handle so that it is seen as near to a point of the canvas as the model can have it; the text
  // of a refusal, or null.
  pull(handle, x, y) {
    const { motion } = this.player, { view } = this.painter;
    const along = this.space?.along([(x - view.x) / view.scale, (view.y - y) / view.scale]);
    const target = this.placeAt(x, y, handle.place());
    if (this.space && handle.dimension === 2) {
      // It stays in its plane, unless that is seen from its edge.
      const way = Math.abs(along[1]) > 0.05 ? target[1] / along[1] : 0;
      motion.drag(handle.index, this.ofModel(handle, target.map((x, axis) => x - way * along[axis])));
    } else {
      motion.drag(handle.index, target, along);
    }
    return this.player.begin(motion);
  }
  // A place or a velocity in the numbers that a point has in the model.
  ofModel({ dimension }, [x, y, z]) { return dimension === 3 ? [x, y, z] : [x, this.space ? z : y]; }
  // Takes hold: the model rests at the instant that is shown, which is its new start. It keeps the time, at
  // which a driven model is where it is seen.
  hold() {
    const { player } = this, y = player.show(), t = player.time(), { m } = player.shown, free = m.slice();
    for (const { row } of MODEL.contacts ?? []) free[MODEL.rows[row].switched] = 1;
    // What lies on something can be lifted.
    const begin = (modes) => player.begin({ t, q: y.slice(0, N), u: new Float64Array(N), m: modes });
    return begin(free) && begin(m);
  }
  take(event, handle) {
    this.hold();
    this.player.held = true;
    this.held = { handle, trail: [], pointer: event.pointerId };
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.classList.add("held");
  }
  move(event) {
    const { held } = this, box = this.canvas.getBoundingClientRect();
    const x = event.clientX - box.left, y = event.clientY - box.top;
    const refusal = this.pull(held.handle, x, y);
    held.trail.push({ at: event.timeStamp, target: this.placeAt(x, y, held.handle.place()) });
    while (held.trail.length > 2 && event.timeStamp - held.trail[0].at > 80) held.trail.shift();
    return refusal;
  }
  // Lets go: what moved under the finger at the end flies on as it moved, unless a gesture of two fingers
  // begins. True where it was moved at all.
  release(event = null) {
    const { held, player } = this, { motion } = player, { trail } = held;
    const [from] = trail, to = trail[trail.length - 1];
    this.held = null;
    player.held = false;
    this.canvas.classList.remove("held");
    if (!from) return false;
    const seconds = (to.at - from.at) / 1000 * player.pace * player.speed;
    // A finger that rests before it lets go does not throw.
    if (event && seconds > 0 && event.timeStamp - to.at < 60 && trail.length > 2) {
      const velocity = to.target.map((x, axis) => (x - from.target[axis]) / seconds);
      motion.throw_point(held.handle.index, this.ofModel(held.handle, velocity));
    }
    this.forget();
    player.begin(motion);
    return true;
  }
  // Moves the chosen handle by a part of the view, to the right and up as it is seen.
  nudge(right, up) {
    const handle = this.handles()[this.grip];
    if (!handle || this.player.refused) return null;
    const place = handle.place(), [x, y] = this.onCanvas(place), { canvas } = this;
    const by = 0.02 * Math.min(canvas.clientWidth, canvas.clientHeight);
    this.hold();
    return this.pull(handle, x + by * right, y - by * up) ?? handle.name;
  }
}
