// What leaves the page: its address, Rust, CSV.
"use strict";
// ---- the address: start, parameters and method, to the last digit

// Names of the model stand for themselves. The page's own keys begin with a sign that no name has.
function link() {
  const { t, q, u, m } = player.start, entries = [];
  MODEL.parameters.forEach(({ name }, i) => entries.push([name, player.motion.p[i]]));
  MODEL.inputs.forEach(({ name }, i) => entries.push([name, player.w[i]]));
  if (PROGRAMS.family) entries.push(nodesInLink(player.start));
  else {
    MODEL.coordinates.forEach(({ name }, i) => entries.push([name, q[i]]));
    MODEL.coordinates.forEach((coordinate, i) => entries.push([rateName(coordinate), u[i]]));
  }
  if (t) entries.push(["~t", t]);
  if (m.length) entries.push(["~modes", m.join(",")]);
  entries.push(["~method", player.method], ["~accuracy", player.wanted]);
  return new URLSearchParams(entries).toString();
}
// Of many nodes: the number of a start of the page, or all values to the last bit.
function nodesInLink({ t, q, u }) {
  const same = (a, b) => a.every((x, i) => x === b[i]);
  const known = MODEL.starts.findIndex((start) => start.t === t && same(start.q, q) && same(start.u, u));
  if (known >= 0) return ["~start", known];
  const bytes = new Uint8Array(Float64Array.from([...q, ...u]).buffer);
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return ["~state", btoa(text)];
}
// The start that a link has in this way, or null.
function nodesOfLink(given) {
  const known = MODEL.starts[given.get("~start") ?? -1], text = given.get("~state");
  if (known) return known;
  if (!text) return null;
  try {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const values = bytes.length === 16 * N ? Array.from(new Float64Array(bytes.buffer)) : [NaN];
    return values.every(Number.isFinite) ? { q: values.slice(0, N), u: values.slice(N) } : null;
  } catch { return null; }
}
let addressTimer;
function remember() {
  if (alone) return;
  clearTimeout(addressTimer);
  // Browsers refuse addresses that change many times a second, and in some frames all of them.
  addressTimer = setTimeout(() => {
    try { history.replaceState(null, "", "#" + link()); } catch { /* A frame without an address. */ }
  }, 300);
}
// Takes a start with its inputs under other parameters; the text of a refusal, or null.
function takeAll(parameters, start) {
  const { motion } = player;
  motion.p.set(parameters);
  player.w.set(start.w);
  return motion.refresh() ?? player.begin(start);
}
// Takes what an address says, or the model's own start where that is refused; where that is refused, too, the
// page stands there. Returns the method and the accuracy, which is null where the address has none.
function recall(address = location.hash.slice(1)) {
  const given = new URLSearchParams(address);
  const usual = { ...MODEL.starts[0], ...(PROGRAMS.family ? nodesOfLink(given) : null) };
  const get = (name, otherwise) => {
    const text = given.get(name), v = Number(text);
    return text === null || text === "" || !Number.isFinite(v) ? otherwise : v;
  };
  const modes = given.get("~modes")?.split(",").map(Number) ?? [];
  const isSide = (x) => x === 0 || x === 1 || x === -1;
  const start = {
    t: get("~t", usual.t),
    q: Float64Array.from(MODEL.coordinates, ({ name }, i) => get(name, usual.q[i])),
    u: Float64Array.from(MODEL.coordinates, (coordinate, i) => get(rateName(coordinate), usual.u[i])),
    w: Float64Array.from(MODEL.inputs, ({ name }, i) => get(name, usual.w[i])),
    m: modes.length === usual.m.length && modes.every(isSide) ? modes : usual.m,
  };
  picture.forget();
  const refusal = takeAll(MODEL.parameters.map(({ name, value }) => get(name, value)), start);
  if (refusal) {
    toast(refusal);
    const [first] = MODEL.starts;
    const own = { ...first, q: Float64Array.from(first.q), u: Float64Array.from(first.u) };
    const second = takeAll(MODEL.parameters.map(({ value }) => value), own);
    if (second) player.stand(own, second);
  }
  const key = given.get("~method"), method = Object.hasOwn(METHODS, key ?? "") ? key : MODEL.method;
  const accuracy = get("~accuracy", NaN);
  const fits = METHODS[method].fixed ? accuracy > 0 : accuracy >= 1e-14 && accuracy <= 0.1;
  return { method, accuracy: fits ? accuracy : null };
}
function recalled({ method, accuracy }) {
  parameterSliders.forEach((slider, i) => slider?.set(player.motion.p[i]));
  inputSliders.forEach((slider, i) => slider?.set(player.w[i]));
  setMethod(method, accuracy);
}

// ---- copies

// A frame may have no clipboard: the text is selected in a box then, to be copied by hand.
async function copy(text, said) {
  try {
    await navigator.clipboard.writeText(text);
    toast(said);
  } catch {
    $("by-hand-text").value = text;
    $("by-hand").showModal();
    $("by-hand-text").select();
  }
}
const literal = (v) => {
  const text = String(v).replace("e+", "e");
  return /[.e]|NaN|Infinity/.test(text) ? text : text + ".0";
};
// Names that Rust has for itself.
const RUST_WORDS = new Set(("abstract as async await become box break const continue do dyn else enum extern "
  + "false final fn for gen if impl in let loop macro match mod move mut override priv pub ref return static "
  + "struct trait true try type typeof unsafe unsized use virtual where while yield").split(" "));
const identifier = (name) => (RUST_WORDS.has(name) ? "r#" + name : name);
// Values by field. `theta[3]` is an element of an array, which may be one of arrays, `magnetic.x` a component
// of a vector, `inertia[0, 2]` one of a matrix.
function fieldsOf(items, values) {
  const fields = new Map();
  items.forEach(({ name }, i) => {
    const [base] = /^[^[.]*/.exec(name), way = [];
    for (const [, axis, indices] of name.matchAll(/\.(\w+)|\[([^\]]*)\]/g)) {
      const [row, column] = (indices ?? "").split(",").map(Number);
      if (axis) way.push(["vector", "xyz".indexOf(axis)]);
      else if (column === undefined) way.push(["array", row]);
      else way.push(["matrix", row], ["array", column]);
    }
    let part = { get: () => fields.get(base), set: (value) => fields.set(base, value) };
    for (const [kind, index] of way) {
      const { get, set } = part;
      if (!get()) set({ kind, of: [] });
      const { of } = get();
      part = { get: () => of[index], set: (value) => { of[index] = value; } };
    }
    part.set(literal(values[i]));
  });
  const print = (value) => {
    if (typeof value === "string") return value;
    return `[${value.of.map(print).join(", ")}]` + (value.kind === "array" ? "" : ".into()");
  };
  return [...fields].map(([name, value]) => [name, print(value)]);
}
const RUST_METHODS = {
  euler: "SemiImplicitEuler", rk4: "Rk4", dp5: "DormandPrince5", dop853: "Dop853", midpoint: "Radau5",
  explicit_euler: "ExplicitEuler", heun: "Heun",
};
// What happens at events of the motion, as a simulation is told.
function rustRules() {
  const law = ({ restitution, rest_speed: speed }) => {
    if (speed === null) return literal(restitution);
    const fields = `restitution: ${literal(restitution)}, rest_speed: Some(${literal(speed)})`;
    return `dynamics::simulate::Contact { ${fields} }`;
  };
  const event = (index) => MODEL.events[index].name;
  return [
    ...MODEL.contacts.map((contact) => `contact("${contact.name}", ${law(contact)})`),
    ...MODEL.stick_slip.map((rule) => `stick_slip("${rule.name}", "${event(rule.event)}")`),
    ...MODEL.stops.map(({ event: index, direction }) => {
      const way = ["Falling", "Any", "Rising"][direction + 1];
      return `stop_at("${event(index)}", dynamics::simulate::Direction::${way})`;
    }),
  ];
}
// The values of every field; those of grids row after row, as setters take them.
function nodesByField(values) {
  return PROGRAMS.family.fields.map(({ from, rows, columns, numbered }) => {
    const own = Array.from(values.slice(from, from + rows * columns), literal);
    return [MODEL.coordinates[from].name.replace(/\[.*/, ""), numbered ? `[${own.join(", ")}]` : own[0]];
  }).filter(([, value]) => !/^\[?(0\.0(, )?)*\]?$/.test(value));
}
function rust() {
  const { t, q, u, m } = player.start, { method, accuracy } = player;
  const parameters = fieldsOf(MODEL.parameters, player.motion.p);
  for (const { name, value } of MODEL.counts ?? []) parameters.push([name, String(value)]);
  for (const { name, values } of MODEL.numbered ?? []) {
    parameters.push([name, `vec![${values.map(literal).join(", ")}].into()`]);
  }
  parameters.forEach(([name, value], k) => { parameters[k] = `${identifier(name)}: ${value}`; });
  if (MODEL.functions?.length) parameters.push("..model");
  const coordinates = PROGRAMS.family ? nodesByField : (values) => fieldsOf(MODEL.coordinates, values);
  const set = [
    ...coordinates(q),
    ...coordinates(u).map(([name, value]) => [name + "_rate", value]),
    ...fieldsOf(MODEL.inputs, player.w), ...(t ? [["at_time", literal(t)]] : []),
  ].map(([name, value]) => `.${identifier(name)}(${value})`);
  MODEL.rows.forEach(({ constraint, switched }, row) => {
    const first = MODEL.rows.findIndex((other) => other.switched === switched) === row;
    if (!Number.isInteger(switched) || !first || m[switched] === 0) return;
    set.push(m[switched] > 0 ? `.release("${constraint}")` : `.release_to("${constraint}", -1.0)`);
  });
  const rules = rustRules().map((rule) => `.${rule}`).join("");
  if (PROGRAMS.family) return rustOfFamily(parameters, set);
  // The library has no implicit midpoint rule; its method for stiff problems takes a tolerance.
  const steps = METHODS[method].fixed && method !== "midpoint" ? `fixed_step(${literal(accuracy)})`
    : `tolerance(${method === "midpoint" ? "1e-9" : literal(accuracy)})`;
  const length = Math.max(10 * player.pace, player.time(player.last) - t);
  const until = literal(Math.min(t + Number(length.toPrecision(3)), player.end));
  return `let model = ${MODEL.name} { ${parameters.join(", ")} };\n`
    + `let start = model.state()${set.join("")}.build()?;\n`
    + `let method = dynamics::methods::${RUST_METHODS[method] ?? "Dop853"};\n`
    + `let motion = model.simulate(start)${rules}.until(${until}).method(method).${steps}.run()?;\n`
    + "println!(\"{}\", motion.summary());\n";
}
// The same for a model with families, which has methods of its own.
function rustOfFamily(parameters, set) {
  const { method, accuracy } = player, { fixed } = METHODS[method], { t } = player.start;
  const others = { verlet: "StormerVerlet", midpoint: "ImplicitMidpoint" };
  const own = { ...RUST_METHODS, ...others };
  const steps = `${fixed ? "fixed_step" : "tolerance"}(${literal(accuracy)})`;
  const length = Math.max(10 * player.pace, player.time(player.last) - t);
  const until = literal(Math.min(t + Number(length.toPrecision(3)), player.end));
  return `let model = ${MODEL.name} { ${parameters.join(", ")} };\n`
    + `let start = model.state()${set.join("")}.build()?;\n`
    + `let method = dynamics::families::methods::${own[method]};\n`
    + `let motion = model.simulate(start).until(${until}).method(method).${steps}.run()?;\n`
    + "println!(\"{}\", motion.summary());\n";
}
// What a table has of the coordinates: all, or of many nodes those that are plotted.
const MOST_COLUMNS = 40;
const inTable = () => MODEL.coordinates.map((coordinate, i) => ({ coordinate, i }))
  .filter(({ coordinate: { node } }) => N <= MOST_COLUMNS || !node);
const quoted = (name) => (/[",\n]/.test(name) ? `"${name.replace(/"/g, '""')}"` : name);
function csv() {
  const own = inTable(), all = own.map(({ coordinate }) => coordinate);
  const names = ["t", ...all.map(({ name }) => name), ...all.map(rateName)];
  if (HAS_ENERGY) names.push("energy");
  names.push(...player.channels.map(({ name }) => name));
  const values = (y) => [...own.map(({ i }) => y[i]), ...own.map(({ i }) => y[N + i])];
  const rows = player.instants.map(({ t, y, energy, channels }) =>
    [t, ...values(y), ...(HAS_ENERGY ? [energy.E] : []), ...channels].join(","));
  return [names.map(quoted).join(","), ...rows].join("\n") + "\n";
}
function saveCsv() {
  const anchor = element("a");
  anchor.href = URL.createObjectURL(new Blob([csv()], { type: "text/csv" }));
  anchor.download = MODEL.name + ".csv";
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 10000);
}
