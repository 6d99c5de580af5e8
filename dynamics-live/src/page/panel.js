// What stands beside and under the picture: sliders of start, inputs and parameters, methods, plots.
"use strict";
// ---- sliders and choices

const rateSymbol = (symbol) =>
  symbol.replace(/<mi[^>]*>.*?<\/mi>/, '<mover>$&<mo>˙</mo></mover>');
let parameterSliders = [], startSliders = [], inputSliders = [];

// Sets numbers of a list under the motion; what refuses is returned.
const setterOf = (list) => (indices, v) => player.change("parameters", () => {
  for (const i of indices) list[i] = v;
});

// The element of a matrix across the diagonal, if the whole matrix is symmetric: then it stays so.
function mirrorOf({ name }) {
  const across = (other) => {
    const mirrored = other.replace(/(\d+), (\d+)/, "$2, $1");
    return MODEL.parameters.findIndex((parameter) => parameter.name === mirrored);
  };
  const matrix = name.replace(/\[[^[]*$/, "["), at = across(name);
  const elements = MODEL.parameters.filter((parameter) => parameter.name.startsWith(matrix));
  const symmetric = elements.every((one) => MODEL.parameters[across(one.name)]?.value === one.value);
  return at >= 0 && MODEL.parameters[at].name !== name && symmetric ? [at] : [];
}
function makeParameters() {
  const set = setterOf(player.motion.p);
  const items = MODEL.parameters.map((parameter, index) => {
    const [lo, hi] = parameter.range ?? endsOf(parameter.value), mirror = mirrorOf(parameter);
    const change = (v) => {
      const refusal = set([index, ...mirror], v);
      if (!refusal) for (const at of mirror) parameterSliders[at]?.set(v);
      return refusal;
    };
    return { ...parameter, id: "p" + index, index, lo, hi, change, changeAll: set };
  });
  const shown = items.filter(({ held }) => !held), made = makeSliders($("parameters"), shown);
  parameterSliders = items.map((item) => made[shown.indexOf(item)]);
  shown.forEach((item, k) => made[k].set(item.value));
  $("parameter-group").hidden = !shown.length;
}
function makeInputs() {
  const set = setterOf(player.w);
  const items = MODEL.inputs.map((input, index) => {
    const most = 2 * Math.abs(input.value) || 10, [lo, hi] = input.range ?? [-most, most];
    return { ...input, id: "w" + index, index, lo, hi, change: (v) => set([index], v), changeAll: set };
  });
  const shown = items.filter(({ held }) => !held), made = makeSliders($("inputs"), shown);
  inputSliders = items.map((item) => made[shown.indexOf(item)]);
  inputSliders.forEach((slider, i) => slider?.set(player.w[i]));
  $("input-group").hidden = !shown.length;
}
function makeStart() {
  const set = (part) => (indices, v) => {
    const { t, q, u, m } = player.start, start = { t, q: Float64Array.from(q), u: Float64Array.from(u), m };
    for (const i of indices) start[part][i] = v;
    if (part === "q" && indices.length === 1) [start.chosen] = indices;
    return takeStart(start);
  };
  const item = (part, coordinate, index) => {
    const whole = part === "q", change = set(part), { name, unit } = coordinate;
    const [lo, hi] = whole && coordinate.angle ? [-Math.PI, Math.PI] : [-1, 1];
    return {
      id: part + index, name, index, lo, hi, unit: whole ? unit : rateUnit(coordinate),
      spoken: whole ? undefined : `rate of ${name}`,
      symbol: whole ? coordinate.symbol : rateSymbol(coordinate.symbol),
      change: (v) => change([index], v), changeAll: change, now: () => player.start[part][index],
    };
  };
  // Nodes have no sliders: starts have buttons, and nodes are dragged.
  const own = MODEL.coordinates.map((coordinate, i) => [coordinate, i]).filter(([{ node }]) => !node);
  const sliders = (into, part) => {
    const all = new Array(N), made = makeSliders(into, own.map(([c, i]) => item(part, c, i)));
    own.forEach(([, i], k) => { all[i] = made[k]; });
    return all;
  };
  const into = own.length > 3 ? fold($("velocities"), "velocities") : $("velocities");
  startSliders = [...sliders($("positions"), "q"), ...sliders(into, "u")];
  for (const start of MODEL.starts.length > 1 ? MODEL.starts : []) {
    const chip = Object.assign(element("button", "", start.name), { type: "button" });
    chip.addEventListener("click", () => { if (!takeStartOf(start)) setPlaying(true); });
    $("starts").append(chip);
  }
}
function takeStartOf({ t, q, u, w, m }) {
  const refusal = takeStart({ t, q: Float64Array.from(q), u: Float64Array.from(u), w, m });
  if (refusal) toast(refusal);
  else inputSliders.forEach((slider, i) => slider?.set(player.w[i]));
  return refusal;
}
function syncStart() {
  const { q, u } = player.start;
  startSliders.forEach((slider, i) => slider?.set(i < N ? q[i] : u[i - N]));
}
function resetParameters() {
  const usual = MODEL.parameters.map(({ value }) => value);
  const refusal = player.change("parameters", () => player.motion.p.set(usual));
  if (refusal) toast(refusal);
  parameterSliders.forEach((slider, i) => slider?.set(player.motion.p[i]));
}
// Ends of start sliders from the motion's own range; angles keep theirs.
function fitStartSliders({ lo, hi }) {
  startSliders.forEach((slider, k) => {
    if (!slider) return;
    const angle = k < N && MODEL.coordinates[k].angle, most = Math.max(Math.abs(lo[k]), Math.abs(hi[k]));
    if (angle || !(most > 0) || !Number.isFinite(most)) return;
    const end = roundStep(1.5 * most);
    slider.setEnds(-end, end);
  });
}

// ---- method and accuracy

// Steps are no longer than the longest one.
function ladders() {
  const { method, motion, pace } = player;
  if (!METHODS[method].fixed) return [3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13].map((k) => Number("1e-" + k));
  const steps = [0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001].map((h) => Number((h * pace).toPrecision(3)));
  const longest = motion.longest_step?.(method) ?? Infinity;
  return steps.filter((h) => h <= longest);
}
function setMethod(method, accuracy) {
  accuracy ??= player.usualAccuracy(method);
  const refusal = player.change("method", () => { player.method = method; player.accuracy = accuracy; });
  if (refusal) {
    toast(refusal);
    ({ method, accuracy } = player);
  }
  $("kind").textContent = METHODS[method].fixed ? "step in s" : "tolerance";
  $("method").value = method;
  listAccuracies();
}
function listAccuracies() {
  const list = ladders(), { accuracy } = player;
  if (!list.includes(accuracy)) list.push(accuracy);
  list.sort((a, b) => b - a);
  // An open list stays open where nothing changes.
  const listed = Array.from($("accuracy").options, ({ value }) => Number(value));
  const same = listed.length === list.length && list.every((v, k) => v === listed[k]);
  if (same && Number($("accuracy").value) === accuracy) return;
  $("accuracy").replaceChildren(...list.map((v) => new Option(number(v), v, false, v === accuracy)));
}
// Of a model with families the longest step depends on the parameters and the start.
function showAccuracy() {
  if (PROGRAMS.family) listAccuracies();
}
function makeMethods() {
  for (const [id, { name }] of Object.entries(METHODS)) $("method").append(new Option(name, id));
  $("method").addEventListener("change", ({ target: { value } }) =>
    setMethod(value, null));
  $("accuracy").addEventListener("change", ({ target }) => setMethod(player.method, Number(target.value)));
  for (const id of compared) $("methods").append(key(METHODS[id].name, TINTS[id] ?? "teal"));
  $("precision").addEventListener("pointerdown", ({ offsetX, offsetY }) => {
    const run = precision.runAt(offsetX, offsetY);
    if (!run) return;
    setMethod(run.method, run.accuracy);
    const { name, fixed } = METHODS[run.method], made = `${run.cost} evaluations`;
    const error = run.failed ? "no end" : `error ${number(run.error, 2)} ${precision.unit ?? "(relative)"}`;
    toast(`${name}, ${fixed ? "step" : "tolerance"} ${number(run.accuracy)}: ${made}, ${error}`);
  });
}
function key(name, tint) {
  const item = element("span", "", name), line = element("i");
  line.style.borderColor = `var(--${tint})`;
  item.prepend(line);
  return item;
}

// ---- plots

function makePlots() {
  const energies = PROGRAMS.kinetic_energy && PROGRAMS.potential_energy
    ? [["kinetic", "blue", "T"], ["potential", "amber", "V"], ["sum", "ink", "E"]]
    : HAS_ENERGY ? [["energy function", "ink", "E"]] : [];
  if (energies.length) {
    plots.push(new TimePlot($("energy"), player, energies.map(([, color, which]) =>
      ({ color, width: color === "ink" ? 2 : 1.6, of: ({ energy }) => energy[which] })), ENERGY_UNIT, 1e-3));
    $("energies").append(...energies.map(([name, color]) => key(name, color)));
  }
  $("energy-card").hidden = !energies.length;
  $("residual-card").hidden = !MODEL.rows.length;
  if (MODEL.rows.length) plots.push(new ResidualPlot($("residual"), player));
  player.channels.forEach((channel, k) => addPlot(channel, k));
  plots.push(phase);
  phaseChoices().forEach((i) => $("which").append(new Option(MODEL.coordinates[i].name, i)));
  $("which").value = phase.which;
  $("which").addEventListener("change", ({ target }) => {
    phase.choose(Number(target.value));
    dirty = true;
  });
  if (!picture.program) makeStrip();
}
// The coordinates of the phase plane: all, or of many nodes a few.
const MOST_CHOICES = 40;
function phaseChoices() {
  const all = MODEL.coordinates.map((_, i) => i);
  if (N <= MOST_CHOICES) return all;
  const part = (i) => Math.floor(i * 12 / N) !== Math.floor((i - 1) * 12 / N) || i === N - 1;
  return all.filter((i) => !MODEL.coordinates[i].node || part(i) || i === phase.which);
}
function addPlot(channel, k) {
  const card = element("div", "card plot"), top = element("div", "top"), canvas = element("canvas");
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `${channel.name} over time`);
  top.append(element("h2", "", channel.name));
  card.append(top, canvas);
  $("phase-card").before(card);
  const curve = { color: HUES[k % HUES.length], of: ({ channels }) => channels[k] };
  // Of what is conserved, errors of the interpolation are no motion.
  const constant = channel.name === "energy" || MODEL.conserved.some(({ name }) => name === channel.name);
  plots.push(new TimePlot(canvas, player, [curve], channel.unit, constant ? 1e-3 : undefined));
}
// Without anything to draw, the coordinates over time stand in the picture's place.
function makeStrip() {
  const [{ unit }] = MODEL.coordinates;
  const all = MODEL.coordinates.map((coordinate, i) => ({ ...coordinate, i }));
  const shown = all.filter((coordinate) => coordinate.unit === unit).slice(0, HUES.length);
  const curves = shown.map(({ i }, k) => ({ color: HUES[k], of: ({ y }) => y[i] }));
  const strip = new TimePlot($("picture"), player, curves, unit);
  picture.draw = () => strip.draw();
  $("hint").replaceChildren(...shown.map(({ name }, k) => key(name, HUES[k])));
  $("hint").className = "keys stays";
}
