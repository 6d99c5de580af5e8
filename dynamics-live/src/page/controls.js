// Sliders: one for every number that can be changed, in groups, tied to the symbols in the equations.
"use strict";
const element = (tag, className = "", text = "") => {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text) made.textContent = text;
  return made;
};
// Digits that tell apart some hundred values between two ends, three at least.
function digitsBetween(v, lo, hi) {
  const finer = Math.ceil(Math.log10(Math.abs(v) / (2 * (hi - lo))));
  return Number.isFinite(finer) ? clamp(3 + finer, 3, 15) : 3;
}
const roundedBetween = (v, lo, hi) => clamp(Number(v.toPrecision(digitsBetween(v, lo, hi))), lo, hi);

// The symbols of the equations by the name of what they stand for, and the sliders of that name.
const symbols = new Map(), slidersOf = new Map();
function glow(name, on) {
  for (const symbol of symbols.get(name) ?? []) symbol.classList.toggle("hot", on);
  for (const { row } of slidersOf.get(name) ?? []) row.classList.toggle("hot", on);
}
function bindSymbols(equations) {
  for (const symbol of equations.querySelectorAll("[data-s]")) {
    const name = symbol.dataset.s;
    symbols.set(name, [...(symbols.get(name) ?? []), symbol]);
    symbol.addEventListener("pointerenter", () => glow(name, true));
    symbol.addEventListener("pointerleave", () => glow(name, false));
    symbol.addEventListener("click", () => {
      const [slider] = slidersOf.get(name) ?? [];
      if (!slider) return;
      for (let at = slider.row; (at = at.parentElement.closest("details"));) at.open = true;
      slider.input.focus();
    });
  }
}

const STEPS_OF_KEYS = {
  ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10,
};

// A value between two ends; `change(value)` returns what refuses it, in words, or null.
class Slider {
  constructor(into, item) {
    Object.assign(this, item);
    this.row = element("div", "slider");
    this.label = element("label");
    // The symbol is MathML that the library printed.
    this.label.innerHTML = `<math>${item.symbol}</math>`;
    this.input = Object.assign(element("input"), { type: "range", min: 0, max: 1, step: "any", id: item.id });
    this.output = element("output");
    this.refusal = element("p", "refusal");
    this.refusal.setAttribute("role", "alert");
    this.output.setAttribute("aria-live", "off");
    this.label.htmlFor = this.output.htmlFor = item.id;
    const spoken = (item.spoken ?? item.name) + (item.unit ? " in " + item.unit : "");
    this.input.setAttribute("aria-label", spoken + (item.about ? ": " + item.about : ""));
    this.row.title = item.name + (item.about ? ": " + item.about : "");
    this.row.append(this.label, this.input, this.output, element("p", "about", item.about), this.refusal);
    into.append(this.row);
    this.listen();
  }
  get log() { return this.lo > 0 && this.hi > 0; }
  valueAt(part) {
    const { lo, hi } = this;
    return this.log ? lo * (hi / lo) ** part : lo + (hi - lo) * part;
  }
  partOf(v) {
    const { lo, hi } = this;
    return this.log ? Math.log(v / lo) / Math.log(hi / lo) : (v - lo) / (hi - lo);
  }
  listen() {
    const { input, row, name } = this;
    slidersOf.set(name, [...(slidersOf.get(name) ?? []), this]);
    input.addEventListener("input", () => this.choose(this.valueAt(input.valueAsNumber)));
    input.addEventListener("keydown", (event) => {
      const steps = STEPS_OF_KEYS[event.key];
      if (!steps) return;
      event.preventDefault();
      event.stopPropagation();
      this.choose(this.valueAt(clamp(input.valueAsNumber + steps / 100, 0, 1)));
    });
    for (const kind of ["pointerenter", "focusin"]) row.addEventListener(kind, () => glow(name, true));
    for (const kind of ["pointerleave", "focusout"]) {
      row.addEventListener(kind, ({ relatedTarget }) => {
        const kept = kind === "focusout" ? row.contains(relatedTarget) : row.contains(document.activeElement);
        if (!kept) glow(name, false);
      });
    }
  }
  // Takes a value from the slider. The middle of one about 0 can be met. What constraints decide is not what
  // was chosen: `now()` tells it.
  choose(v) {
    const { lo, hi, value: before } = this, isZero = lo < 0 && hi > 0 && Math.abs(v) < 4e-3 * (hi - lo);
    const value = isZero ? 0 : roundedBetween(v, lo, hi), earlier = this.now?.();
    this.show(value);
    // What changes may set the slider to what came of it.
    const refusal = this.change(value), after = this.now?.();
    const stays = !refusal && Math.abs(after - earlier) < 1e-6 * Math.abs(value - earlier);
    this.refusal.textContent = refusal ?? (stays ? "held by the constraints" : "");
    if (refusal) this.show(before);
    else if (after !== undefined) this.show(after);
  }
  // Takes a value from elsewhere; the ends give way to one beyond them, but not to its rounding.
  set(v) {
    const { lo, hi } = this, least = 1e-9 * (hi - lo);
    if (v < lo - least) this.lo = this.log && v > 0 ? v / 2 : v - 0.5 * (hi - v);
    if (v > hi + least) this.hi = this.log ? 2 * v : v + 0.5 * (v - lo);
    this.show(v);
  }
  show(v) {
    this.value = v;
    this.input.value = clamp(this.partOf(v), 0, 1);
    const text = number(v, digitsBetween(v, this.lo, this.hi)) + (this.unit ? " " + this.unit : "");
    this.output.textContent = text;
    this.input.setAttribute("aria-valuetext", text);
  }
  setEnds(lo, hi) {
    Object.assign(this, { lo: Math.min(lo, this.value), hi: Math.max(hi, this.value) });
    this.set(this.value);
  }
}

// Ends of a slider without given ones.
function endsOf(value) {
  if (value > 0) return [value / 10, 10 * value];
  return value < 0 ? [3 * value, -3 * value] : [-1, 1];
}

// Sliders of a list of items. The elements of an array, `theta[0]`, `theta[1]`, stand behind one slider for
// all of them; of many items only the first stand open.
function makeSliders(into, items, most = 6) {
  const arrays = new Map();
  for (const item of items) {
    const base = item.name.replace(/\[[^\]]*\]/g, "");
    const key = base === item.name ? item.name : base + "[]";
    arrays.set(key, [...(arrays.get(key) ?? []), item]);
  }
  const made = new Map();
  let place = into, shown = 0;
  for (const [key, members] of arrays) {
    if (shown++ === most && arrays.size > most + 1) place = fold(into, `${arrays.size - most} more`);
    if (members.length === 1) made.set(members[0], new Slider(place, members[0]));
    else makeArray(place, key.slice(0, -2), members, made);
  }
  return items.map((item) => made.get(item));
}
function fold(into, title) {
  const details = element("details", "fold");
  details.append(element("summary", "", title));
  into.append(details);
  return details;
}
function makeArray(into, name, members, made) {
  const [first] = members;
  if (first.name.includes(",")) {
    // Equal numbers make no matrix.
    const elements = fold(into, `each of ${name}`);
    for (const member of members) made.set(member, new Slider(elements, member));
    return;
  }
  const symbol = /<mi[^>]*>.*?<\/mi>/.exec(first.symbol)?.[0] ?? first.symbol;
  const all = new Slider(into, {
    ...first, id: first.id + "-all", name, symbol,
    spoken: first.spoken?.replace(first.name, name),
    about: `all ${members.length} of ${name}. ${first.about ?? ""}`,
    change: (v) => {
      const refusal = first.changeAll(members.map(({ index }) => index), v);
      if (!refusal) for (const member of members) made.get(member).set(v);
      return refusal;
    },
  });
  all.label.append(` ×${members.length}`);
  const elements = fold(into, `each ${all.spoken ?? `of ${name}`}`);
  for (const member of members) made.set(member, new Slider(elements, member));
  // The slider for all shows the first element.
  const slider = made.get(first), show = slider.show.bind(slider), setEnds = slider.setEnds.bind(slider);
  slider.show = (v) => { show(v); all.set(v); };
  slider.setEnds = (lo, hi) => { setEnds(lo, hi); all.setEnds(lo, hi); };
}
