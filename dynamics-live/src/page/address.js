// What leaves the page: its address, Rust, CSV.
"use strict";
// ---- the address: start, parameters and method, to the last digit

const rateName = ({ name }) => name.replace(/^[^[]*/, "$&_rate");
function link() {
  const { t, q, u, m } = player.start, entries = [];
  MODEL.parameters.forEach(({ name }, i) => entries.push([name, player.motion.p[i]]));
  MODEL.inputs.forEach(({ name }, i) => entries.push([name, player.w[i]]));
  MODEL.coordinates.forEach(({ name }, i) => entries.push([name, q[i]]));
  MODEL.coordinates.forEach((coordinate, i) => entries.push([rateName(coordinate), u[i]]));
  if (t) entries.push(["t", t]);
  if (m.length) entries.push(["modes", m.join(",")]);
  entries.push(["method", player.method], ["accuracy", player.accuracy]);
  return new URLSearchParams(entries).toString();
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
function recall() {
  const given = new URLSearchParams(location.hash.slice(1)), [usual] = MODEL.starts;
  const get = (name, otherwise) => {
    const text = given.get(name), v = Number(text);
    return text === null || text === "" || !Number.isFinite(v) ? otherwise : v;
  };
  MODEL.parameters.forEach(({ name, value }, i) => { player.motion.p[i] = get(name, value); });
  MODEL.inputs.forEach(({ name, value }, i) => { player.w[i] = get(name, usual.w?.[i] ?? value ?? 0); });
  const modes = given.get("modes")?.split(",").map(Number);
  const start = {
    t: get("t", usual.t ?? 0),
    q: Float64Array.from(MODEL.coordinates, ({ name }, i) => get(name, usual.q[i])),
    u: Float64Array.from(MODEL.coordinates, (coordinate, i) => get(rateName(coordinate), usual.u[i])),
    m: modes?.length === usual.m?.length && modes?.every(Number.isFinite) ? modes : usual.m ?? [],
  };
  picture.forget();
  let refusal = player.motion.refresh() ?? player.begin(start);
  if (refusal) {
    toast(refusal);
    MODEL.parameters.forEach(({ value }, i) => { player.motion.p[i] = value; });
    player.motion.refresh();
    refusal = player.begin({ ...usual, q: Float64Array.from(usual.q), u: Float64Array.from(usual.u) });
    if (refusal) throw new Error(refusal);
  }
  const method = given.get("method"), accuracy = get("accuracy", MODEL.accuracy);
  return {
    method: method in METHODS ? method : MODEL.method, accuracy: accuracy > 0 ? accuracy : MODEL.accuracy,
  };
}
function recalled({ method, accuracy }) {
  parameterSliders.forEach((slider, i) => slider?.set(player.motion.p[i]));
  inputSliders.forEach((slider, i) => slider?.set(player.w[i]));
  syncStart();
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
// Values by field; the elements of an array, also of one of arrays, in brackets.
function fieldsOf(items, values) {
  const fields = new Map();
  items.forEach(({ name }, i) => {
    const [base, ...indices] = name.split(/\[|\]\[|\]/).filter((part) => part !== "");
    if (!indices.length) { fields.set(base, literal(values[i])); return; }
    if (!fields.has(base)) fields.set(base, []);
    let list = fields.get(base);
    for (const index of indices.slice(0, -1)) list = list[index] ??= [];
    list[indices[indices.length - 1]] = literal(values[i]);
  });
  const print = (value) => (Array.isArray(value) ? `[${value.map(print).join(", ")}]` : value);
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
      const side = direction > 0 ? "Rising" : direction < 0 ? "Falling" : "Any";
      return `stop_at("${event(index)}", dynamics::simulate::Direction::${side})`;
    }),
  ];
}
function rust() {
  const { t, q, u, m } = player.start, { method, accuracy } = player;
  const parameters = fieldsOf(MODEL.parameters, player.motion.p).map(([name, value]) => `${name}: ${value}`);
  if (MODEL.functions?.length) parameters.push("..model");
  const set = [
    ...fieldsOf(MODEL.coordinates, q),
    ...fieldsOf(MODEL.coordinates, u).map(([name, value]) => [name + "_rate", value]),
    ...fieldsOf(MODEL.inputs, player.w), ...(t ? [["at_time", literal(t)]] : []),
  ].map(([name, value]) => `.${name}(${value})`);
  MODEL.rows.forEach(({ name, switched }, row) => {
    const first = MODEL.rows.findIndex((other) => other.switched === switched) === row;
    if (Number.isInteger(switched) && first && m[switched] !== 0) set.push(`.release("${name}")`);
  });
  const rules = rustRules().map((rule) => `.${rule}`).join("");
  // The library has no implicit midpoint rule; its method for stiff problems takes a tolerance.
  const steps = METHODS[method].fixed && method !== "midpoint" ? `fixed_step(${literal(accuracy)})`
    : `tolerance(${method === "midpoint" ? "1e-9" : literal(accuracy)})`;
  const length = Math.max(10 * player.pace, player.time(player.last) - t);
  const until = literal(Number((t + length).toPrecision(3)));
  return `let model = ${MODEL.name} { ${parameters.join(", ")} };\n`
    + `let start = model.state()${set.join("")}.build()?;\n`
    + `let method = dynamics::methods::${RUST_METHODS[method] ?? "Dop853"};\n`
    + `let motion = model.simulate(start)${rules}.until(${until}).method(method).${steps}.run()?;\n`
    + "println!(\"{}\", motion.summary());\n";
}
const quoted = (name) => (/[",\n]/.test(name) ? `"${name.replace(/"/g, '""')}"` : name);
function csv() {
  const names = ["t", ...MODEL.coordinates.map(({ name }) => name), ...MODEL.coordinates.map(rateName)];
  if (HAS_ENERGY) names.push("energy");
  names.push(...player.channels.map(({ name }) => name));
  const rows = player.instants.map(({ t, y, energy, channels }) =>
    [t, ...y, ...(HAS_ENERGY ? [energy.E] : []), ...channels].join(","));
  return [names.map(quoted).join(","), ...rows].join("\n") + "\n";
}
function saveCsv() {
  const anchor = element("a");
  anchor.href = URL.createObjectURL(new Blob([csv()], { type: "text/csv" }));
  anchor.download = MODEL.name + ".csv";
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 10000);
}
