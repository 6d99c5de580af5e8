// A run side by side with others: attempts at steps of Verner's method of order 9(8) until it ends, pauses or
// needs another method. Each has its own step. It is side_by_side.c in single precision.

const N: u32 = <<N>>u;
const P: u32 = <<P>>u;
const W: u32 = <<W>>u;
const ENDED: i32 = 1;
const UNUSUAL: i32 = 2;
const PAUSED: i32 = 4;
// Larger numbers count as infinite.
const LARGEST: f32 = 3.0e38f;

// Element e of a run r is number e*runs + r of an array.
@group(0) @binding(0) var<storage, read> given: array<f32>;
@group(0) @binding(1) var<storage, read_write> moving: array<f32>;
@group(0) @binding(2) var<storage, read_write> outcomes: array<i32>;
// How many runs there are.
// And how many attempts are to be made at most.
@group(0) @binding(3) var<uniform> sizes: vec4<u32>;

// Coordinates and rates, or the derivatives of both.
struct Phase {
  q: array<f32, N>,
  u: array<f32, N>,
}

// Whether an angle was met that is too large for single precision: the processor then makes the run.
var<private> is_lost: bool;

// Sine and cosine within 1e-7: x = k pi/2 + r in three parts, and polynomials of r. Of larger angles single
// precision has too few digits behind the point.
fn sin_cos(x: f32) -> vec2<f32> {
  if (!(abs(x) <= 8192.0f)) {
    is_lost = true;
    return vec2<f32>(0.0f, 1.0f);
  }
  let k = round(x*0.63661977f);
  let r = ((x - k*1.5703125f) - k*4.8375129e-4f) - k*7.5497899e-8f;
  let z = r*r;
  let s = r + r*z*(-0.16666654f + z*(8.3321609e-3f - z*1.9515296e-4f));
  let c = 1.0f - 0.5f*z + z*z*(4.1666646e-2f + z*(-1.3887316e-3f + z*2.4433157e-5f));
  let quarter = i32(k) & 3;
  let odd = (quarter & 1) == 1;
  let sine = select(s, c, odd);
  let cosine = select(c, s, odd);
  return vec2<f32>(
    select(sine, -sine, (quarter & 2) == 2),
    select(cosine, -cosine, (quarter == 1) || (quarter == 2)),
  );
}

<<PROGRAMS>>

// Adds a part of a slope.
fn add(weight: f32, slope: ptr<function, Phase>, sum: ptr<function, Phase>) {
  for (var i = 0u; i < N; i++) {
    (*sum).q[i] += weight*(*slope).q[i];
    (*sum).u[i] += weight*(*slope).u[i];
  }
}

fn clear(sum: ptr<function, Phase>) {
  for (var i = 0u; i < N; i++) {
    (*sum).q[i] = 0.0f;
    (*sum).u[i] = 0.0f;
  }
}

// y + h times a sum of slopes.
fn move_by(h: f32, sum: ptr<function, Phase>, y: ptr<function, Phase>, to: ptr<function, Phase>) {
  for (var i = 0u; i < N; i++) {
    (*to).q[i] = (*y).q[i] + h*(*sum).q[i];
    (*to).u[i] = (*y).u[i] + h*(*sum).u[i];
  }
}

// The slope at a place; false where it does not exist.
fn stage(p: array<f32, <<P1>>>, k: array<f32, <<K1>>>, w: array<f32, <<W1>>>, t: f32,
  y: ptr<function, Phase>, slope: ptr<function, Phase>) -> bool {
  var a = model_accelerations(p, k, t, (*y).q, (*y).u, w);
  for (var i = 0u; i < N; i++) {
    (*slope).q[i] = (*y).u[i];
    (*slope).u[i] = a[i];
  }
  return a[N] == 1.0f;
}

fn part(absolute: f32, relative: f32, error: f32, size: f32) -> f32 {
  return error/(absolute + relative*size);
}

@compute @workgroup_size(64)
fn advance(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
  let runs = sizes.x;
  let run = id.x + id.y*groups.x*64u;
  if (run >= runs) {
    return;
  }
  if (outcomes[run] != 0) {
    return;
  }
  var p: array<f32, <<P1>>>;
  var w: array<f32, <<W1>>>;
  var y: Phase;
  var from_y: Phase;
  for (var i = 0u; i < P; i++) {
    p[i] = given[i*runs + run];
  }
  for (var i = 0u; i < W; i++) {
    w[i] = given[(P + i)*runs + run];
  }
  let end = given[(P + W)*runs + run];
  let most = given[(P + W + 1u)*runs + run];
  let absolute = given[(P + W + 2u)*runs + run];
  let relative = given[(P + W + 3u)*runs + run];
  var t = moving[run];
  var from_t = moving[(1u + 2u*N)*runs + run];
  for (var i = 0u; i < N; i++) {
    y.q[i] = moving[(1u + i)*runs + run];
    y.u[i] = moving[(1u + N + i)*runs + run];
    from_y.q[i] = moving[(2u + 2u*N + i)*runs + run];
    from_y.u[i] = moving[(2u + 3u*N + i)*runs + run];
  }
  let control = 2u*(1u + 2u*N);
  var next_h = moving[control*runs + run];
  var left = moving[(control + 1u)*runs + run];
  var rejections = moving[(control + 2u)*runs + run];
  var beyond_stability = moving[(control + 3u)*runs + run];
  let k = model_constants(p);
  var outcome = 0;
  var sum: Phase;
  var place: Phase;
  var before: Phase;
  var error: Phase;
  var none: Phase;
  clear(&none);
<<SLOPES>>
  for (var made = 0u; (made < sizes.y) && (outcome == 0); made++) {
    // The step. The last one may be a little longer, to meet the end.
    let way = end - t;
    let proposed = min(abs(next_h), most);
    let is_last = abs(way) <= proposed*<<STRETCHED>>;
    let end_t = select(t + select(proposed, -proposed, way < 0.0f), end, is_last);
    let h = end_t - t;
    var exists = true;
<<STAGES>>
    // The end, and the square of the error.
<<ERRORS>>
    move_by(h, &sum, &none, &error);
<<ENDS>>
    move_by(h, &sum, &y, &sum);
    var squares = 0.0f;
    var size = 0.0f;
    for (var i = 0u; i < N; i++) {
      let of_q = max(abs(y.q[i]), abs(sum.q[i]));
      let of_u = max(abs(y.u[i]), abs(sum.u[i]));
      let part_q = part(absolute, relative, error.q[i], of_q);
      let part_u = part(absolute, relative, error.u[i], of_u);
      squares += part_q*part_q + part_u*part_u;
      size += of_q + of_u;
    }
    let squared = squares*<<SHARE>>;
    let has_value = exists && (squared <= LARGEST) && (size <= LARGEST);
    let is_accepted = has_value && (squared <= 1.0f);
    // The next step.
    let root = sqrt(sqrt(sqrt(sqrt(max(squared, 1.0e-30f)))));
    var factor = clamp(<<SAFETY>>/root, <<SHRINK>>, <<GROW>>);
    if (!(is_accepted && (rejections <= 0.0f))) {
      factor = min(factor, 1.0f);
    }
    let next = abs(h)*select(<<FAILED>>, factor, has_value);
    let new_h = select(next, max(next, proposed), is_accepted && (abs(h) < <<CUT>>*proposed));
    // What has happened: whether stability bounds the step, by the last two stages.
    var of_rates = 0.0f;
    var of_coordinates = 0.0f;
    var of_slopes = 0.0f;
    for (var i = 0u; i < N; i++) {
      let of_q = before.q[i] - place.q[i];
      let of_u = before.u[i] - place.u[i];
      let of_a = k<<BEFORE>>.u[i] - k<<LAST>>.u[i];
      of_coordinates += of_q*of_q;
      of_rates += of_u*of_u;
      of_slopes += of_a*of_a;
    }
    let is_stiff = (<<BORDER_2>>*of_rates < h*h*of_slopes)
      && (<<BORDER_4>>*of_coordinates < h*h*(h*h)*of_slopes);
    if (is_accepted) {
      beyond_stability = max(beyond_stability + select(-1.0f, 1.0f, is_stiff), 0.0f);
      rejections = 0.0f;
    } else {
      rejections += 1.0f;
    }
    left -= 1.0f;
    let is_unresolved = new_h <= <<RESOLVED>>*(abs(t) + abs(end));
    if (is_accepted && is_last) {
      outcome = ENDED;
    }
    if (is_lost || (!is_last && (is_unresolved || (abs(h) <= 0.0f))) || (rejections > <<REJECTIONS>>)
      || (beyond_stability >= <<STIFF>>)) {
      outcome = outcome | UNUSUAL;
    }
    if (left <= 0.0f) {
      outcome = outcome | PAUSED;
    }
    next_h = new_h;
    if (is_accepted) {
      from_t = t;
      from_y = y;
      t = end_t;
      y = sum;
    }
  }
  moving[run] = t;
  moving[(1u + 2u*N)*runs + run] = from_t;
  for (var i = 0u; i < N; i++) {
    moving[(1u + i)*runs + run] = y.q[i];
    moving[(1u + N + i)*runs + run] = y.u[i];
    moving[(2u + 2u*N + i)*runs + run] = from_y.q[i];
    moving[(2u + 3u*N + i)*runs + run] = from_y.u[i];
  }
  moving[control*runs + run] = next_h;
  moving[(control + 1u)*runs + run] = left;
  moving[(control + 2u)*runs + run] = rejections;
  moving[(control + 3u)*runs + run] = beyond_stability;
  outcomes[run] = outcome;
}
