// The eye of pages that show something of space: where points are seen, and what hides what. What the
// viewer does with it has the names of `makePlane`.
//
// Points are counted from the middle of everything that is shown, x and y level, z up. The eye looks at that
// middle from an azimuth about z, an elevation above the level and a distance of some sizes of the whole, so
// that near things are a little larger. Faces, lines and balls are painted from the farthest to the nearest.
"use strict";
const makeSpace = (data) => {
  let half, size, distance, farthest;
  const light = [-0.42, 0.7, 0.58];   // to the right, up, toward the viewer
  let azimuth, elevation, zoom, turnedAway;
  let right, up, toward;

  // How far what is shown reaches from its middle along x, y and z.
  function resize(sides) {
    half = sides;
    size = Math.hypot(...half) || 1;
    distance = 4 * size;
    farthest = null;
  }
  resize(data.half);

  function aimEye() {
    const [sa, ca, se, ce] = [Math.sin(azimuth), Math.cos(azimuth), Math.sin(elevation), Math.cos(elevation)];
    right = [-sa, ca, 0];
    up = [-ca * se, -sa * se, ce];
    toward = [ca * ce, sa * ce, se];
  }
  function reset() {
    [azimuth, elevation] = data.eye;
    [zoom, turnedAway] = [1, false];
    aimEye();
  }
  reset();

  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const length = Math.hypot(...a) || 1; return a.map((x) => x / length); };
  const mean = (points) =>
    [0, 1, 2].map((axis) => points.reduce((sum, p) => sum + p[axis], 0) / points.length);

  // To the right, up, toward the viewer: where a point lies as the eye sees it, without perspective.
  const turned = (p) => [dot(p, right), dot(p, up), dot(p, toward)];
  const factor = (depth) => distance / Math.max(distance - depth, 1e-3 * distance);
  // In the plane of the picture, its nearness, and how much larger things are there.
  const project = (p) => {
    const [x, y, depth] = turned(p), f = factor(depth);
    return [f * x, f * y, depth, f];
  };

  // The place that is seen there, as near as `p`.
  const unproject = ([x, y], p) => {
    const depth = dot(p, toward), f = factor(depth);
    return [0, 1, 2].map((axis) => x / f * right[axis] + y / f * up[axis] + depth * toward[axis]);
  };

  // The direction, toward the eye, in which all lies that is seen at a place of the picture.
  const along = ([x, y]) =>
    unit([0, 1, 2].map((axis) => toward[axis] - (x * right[axis] + y * up[axis]) / distance));

  const points = (v, count, first = 0) =>
    Array.from({ length: count }, (_, k) => v.slice(first + 3 * k, first + 3 * k + 3));
  const flat = (list) => list.flatMap((p) => project(p).slice(0, 2));
  const nearness = (list) => list.reduce((sum, p) => sum + dot(p, toward), 0) / list.length;

  // A circle about an axis.
  function ring(center, axis, radius, count) {
    const e1 = unit(cross(axis, Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), e2 = cross(axis, e1);
    return Array.from({ length: count }, (_, k) => {
      const [c, s] = [radius * Math.cos(2 * Math.PI * k / count), radius * Math.sin(2 * Math.PI * k / count)];
      return center.map((x, i) => x + c * e1[i] + s * e2[i]);
    });
  }

  // The faces of a convex solid that the eye sees: corners in the plane, nearness, and how bright they are.
  function visible(faces, middle) {
    const seen = [];
    for (const { corners, edges } of faces) {
      const at = mean(corners);
      let normal = unit(cross(minus(corners[1], corners[0]), minus(corners[corners.length - 1], corners[0])));
      if (dot(normal, minus(at, middle)) < 0) normal = normal.map((x) => -x);
      const n = turned(normal), p = turned(at);
      if (n[0] * -p[0] + n[1] * -p[1] + n[2] * (distance - p[2]) <= 0) continue;
      const bright = 0.72 + 0.4 * Math.max(0, dot(n, light));
      seen.push({ flat: flat(corners), depth: p[2], bright, edges });
    }
    return seen;
  }

  const solids = {
    cuboid(v) {
      const [center, ...faces] = points(v, 4);
      const half = faces.map((face) => minus(face, center));
      const corner = (signs) =>
        center.map((x, i) => x + half.reduce((sum, h, k) => sum + signs[k] * h[i], 0));
      const all = [];
      for (let axis = 0; axis < 3; axis++) {
        for (const side of [-1, 1]) {
          const signs = (a, b) => {
            const s = [0, 0, 0];
            s[axis] = side; s[(axis + 1) % 3] = a; s[(axis + 2) % 3] = b;
            return s;
          };
          const square = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
          all.push({ corners: square.map(([a, b]) => corner(signs(a, b))), edges: true });
        }
      }
      return visible(all, center);
    },
    cone(v) {
      const [from, to] = points(v, 2), [first, last] = [Math.abs(v[6]), Math.abs(v[7])];
      const axis = unit(minus(to, from)), count = 40;
      if (!(Math.hypot(...minus(to, from)) > 0)) return [];
      const [a, b] = [ring(from, axis, first, count), ring(to, axis, last, count)], all = [];
      for (let k = 0; k < count; k++) {
        const next = (k + 1) % count;
        // A tip is one corner; the normal is taken at the wider end.
        const corners = first >= last ? [a[k], a[next], ...(last > 0 ? [b[next]] : []), b[k]]
          : [b[k], b[next], ...(first > 0 ? [a[next]] : []), a[k]];
        all.push({ corners, edges: false });
      }
      if (first > 0) all.push({ corners: a, edges: true });
      if (last > 0) all.push({ corners: b, edges: true });
      return visible(all, mean([from, to]));
    },
  };

  // A figure as pieces of the plane: `v` as figures of the plane have it, or `faces`; with their nearness.
  function pieces(figure, v) {
    const one = (list, rest = []) => [{ figure, v: [...flat(list), ...rest], depth: nearness(list) }];
    const scaled = (list, radius) => one(list, [radius * factor(nearness(list))]);
    switch (figure.k) {
      case "cuboid": case "cone":
        return solids[figure.k](v).map((face) => ({ figure, face, depth: face.depth }));
      case "line": {
        const list = points(v, figure.n);
        if (figure.z || figure.d || list.length < 3) return one(list);
        // Of a long line each piece is as near as it is.
        const piece = { ...figure, n: 2 };
        return list.slice(1).map((p, k) =>
          ({ figure: piece, v: flat([list[k], p]), depth: nearness([list[k], p]) }));
      }
      case "disc": case "circle":
        return scaled(points(v, 1), v[3]);
      case "arc": {
        // Upright in the plane of x and z; angles count in 1/10,000 rad.
        const [x, y, z, radius, from, to] = v, count = 48;
        const at = (k) => {
          const s = (from + (to - from) * k / count) / 1e4;
          return [x + radius * Math.cos(s), y, z + radius * Math.sin(s)];
        };
        return pieces({ ...figure, k: "line", n: count + 1 },
          Array.from({ length: count + 1 }, (_, k) => at(k)).flat());
      }
      case "spring": case "arrow": case "ground":
        return one(points(v, 2));
      case "text":
        // Words are read, whatever is before them.
        return one(points(v, 1)).map((piece) => ({ ...piece, depth: Infinity }));
      default:
        return one(points(v, 1));
    }
  }

  // What a figure reaches: places with a radius about them. Circles about an axis are the corners of polygons
  // around them.
  function places(figure, v, count, visit) {
    if (v.some(Number.isNaN)) return;
    if (figure.k === "cuboid") {
      const [center, ...faces] = points(v, 4), half = faces.map((face) => minus(face, center));
      const sign = (k, axis) => (k >> axis & 1 ? 1 : -1);
      const corner = (k) =>
        center.map((x, i) => x + half.reduce((sum, h, axis) => sum + sign(k, axis) * h[i], 0));
      for (let k = 0; k < 8; k++) visit(corner(k), 0);
    } else if (figure.k === "cone") {
      const ends = points(v, 2), axis = unit(minus(ends[1], ends[0]));
      ends.forEach((end, k) => ring(end, axis, 1.04 * Math.abs(v[6 + k]), 12).forEach((p) => visit(p, 0)));
    } else {
      const radius = figure.k === "disc" || figure.k === "circle" || figure.k === "arc"
        ? Math.abs(v[3 * count]) : 0;
      for (const p of points(v, count)) visit(p, radius);
    }
  }

  // Some directions all around, and of everything what reaches farthest in each: enough to know how far it
  // reaches from any eye.
  const around = Array.from({ length: 80 }, (_, k) => {
    const z = 1 - (2 * k + 1) / 80, r = Math.sqrt(1 - z * z), s = k * Math.PI * (3 - Math.sqrt(5));
    return [r * Math.cos(s), r * Math.sin(s), z];
  });
  function outermost(every) {
    if (farthest) return farthest;
    const found = around.map(() => ({ far: -Infinity, p: null, radius: 0 }));
    every((p, radius) => around.forEach((direction, k) => {
      const far = dot(p, direction) + radius;
      if (far > found[k].far) found[k] = { far, p, radius };
    }));
    return (farthest = found.filter(({ p }) => p));
  }

  // What has to have room: as from the eye's first place, and more where the viewer has turned and it needs
  // more.
  function reach(first, every) {
    if (!turnedAway) return first;
    const now = extent((visit) => outermost(every).forEach(({ p, radius }) => visit(p, radius)));
    return first.map((x, side) => (side % 2 ? Math.max : Math.min)(x, now[side]));
  }

  // How far everything reaches in the picture: [left, right, down, up].
  function extent(visit) {
    const reach = [Infinity, -Infinity, Infinity, -Infinity];
    visit((p, radius) => {
      const [x, y, , f] = project(p), r = f * radius;
      if (!(Number.isFinite(x) && Number.isFinite(y))) return;
      reach[0] = Math.min(reach[0], x - r); reach[1] = Math.max(reach[1], x + r);
      reach[2] = Math.min(reach[2], y - r); reach[3] = Math.max(reach[3], y + r);
    });
    return reach[0] <= reach[1] ? reach : [-size, size, -size, size];
  }

  // The level grid under everything, as lines of the plane. `spacing` in parts of the view, `offset` from the
  // middle to a line along x and y.
  function floor(spacing, offset) {
    const lines = [], z = -half[2];
    const [lo, hi] = [0, 1].map((sign) => [0, 1].map((axis) => {
      const edge = (sign ? 1 : -1) * Math.max(half[axis], 0.35 * size);
      const k = (edge - offset[axis]) / spacing;
      return offset[axis] + spacing * (sign ? Math.ceil(k) : Math.floor(k));
    }));
    for (let axis = 0; axis < 2; axis++) {
      for (let x = lo[axis], n = 0; x <= hi[axis] + 1e-6 * spacing && n < 60; x += spacing, n++) {
        lines.push(flat(axis === 0 ? [[x, lo[1], z], [x, hi[1], z]] : [[lo[0], x, z], [hi[0], x, z]]));
      }
    }
    return lines;
  }

  // Pixels of a finger to a radian.
  const turn = (dx, dy) => {
    azimuth -= dx / 120;
    elevation = clamp(elevation + dy / 120, -Math.PI / 2, Math.PI / 2);
    turnedAway = true;
    aimEye();
  };
  return {
    project, unproject, along, pieces, places, extent, reach, floor, resize, reset, stride: 12,
    get size() { return size; },
    get whole() { return zoom === 1 && !turnedAway; },
    // What is made larger grows about the middle.
    aim: ({ scale, x, y }, width, height) => ({
      scale: zoom * scale, x: width / 2 + zoom * (x - width / 2), y: height / 2 + zoom * (y - height / 2),
    }),
    drag: turn,
    pinch(by) { zoom = clamp(zoom * by, 0.1, 20); },
  };
};
