// What tests ask of a page. `live` is the page's hook for them.
const tests = {
  of: (id) => document.getElementById(id),
  // The next frames, one after another.
  frames: async (count) => { while (count-- > 0) await new Promise(requestAnimationFrame); },
  // Whether a condition becomes true; busy machines need their time.
  async becomes(condition) {
    for (const end = performance.now() + 100000; performance.now() < end;) {
      if (condition()) return true;
      await tests.frames(1);
    }
    return false;
  },

  // ---- controls

  // What a keyboard has to reach, in the order of the document.
  controls() {
    const all = document.querySelectorAll("a[href], button, input, select, textarea, summary, [tabindex]");
    const reachable = (control) => control.checkVisibility() && !control.disabled && control.tabIndex >= 0;
    return Array.from(all).filter(reachable);
  },
  // A control in words.
  words(control) {
    const name = control.id || control.getAttribute("aria-label") || control.textContent;
    return `${control.localName} ${name.trim().slice(0, 60)}`;
  },
  // Opens everything that unfolds.
  unfold() { for (const details of document.querySelectorAll("details")) details.open = true; },
  // Whether something else lies over a control, or it is out of sight.
  covered(control) {
    const { left, right, top, bottom } = control.getBoundingClientRect();
    // What is larger than the window is seen in part.
    const x = (Math.max(left, 0) + Math.min(right, innerWidth)) / 2;
    const y = (Math.max(top, 0) + Math.min(bottom, innerHeight)) / 2;
    const seen = document.elementFromPoint(x, y);
    return !(seen && (control.contains(seen) || seen.contains(control)));
  },
  // Begins to take note of what has the focus; the number of what can have it, as parts that scroll do, too.
  track() {
    tests.unfold();
    Object.assign(tests, { all: tests.controls(), met: new Set(), hidden: [] });
    return tests.all.length + document.querySelectorAll(".eq, pre").length;
  },
  // Whether all controls had the focus by now.
  meets() {
    const { activeElement: at } = document, { all, met, hidden } = tests;
    met.add(at);
    if (all.includes(at) && tests.covered(at)) hidden.push(at);
    return all.every((control) => met.has(control));
  },
  missed: () => tests.all.filter((control) => !tests.met.has(control)),
  // What stands out of the window sideways.
  beside() {
    const wide = document.documentElement.clientWidth, { scrollWidth } = document.documentElement;
    if (scrollWidth <= wide && document.body.scrollWidth <= wide) return [];
    const out = Array.from(document.body.querySelectorAll("*"))
      .filter((element) => element.checkVisibility() && element.getBoundingClientRect().right > wide + 0.5);
    return [`${scrollWidth} px of ${wide} px`, ...out.map(tests.words)];
  },

  // ---- contrast

  // Red, green, blue from 0 to 255, and the opacity, of a computed color.
  channels(color) {
    const numbers = color.match(/-?[\d.]+(e-?\d+)?/g).map(Number);
    const [r, g, b, alpha = 1] = numbers;
    return color.startsWith("color(") ? [255 * r, 255 * g, 255 * b, alpha] : [r, g, b, alpha];
  },
  over([r, g, b, alpha], ground) {
    return [r, g, b].map((x, i) => alpha * x + (1 - alpha) * ground[i]);
  },
  // The ground on which an element stands.
  ground(element) {
    if (!element) return matchMedia("(prefers-color-scheme: dark)").matches ? [0, 0, 0] : [255, 255, 255];
    const color = tests.channels(getComputedStyle(element).backgroundColor);
    return color[3] === 1 ? color.slice(0, 3) : tests.over(color, tests.ground(element.parentElement));
  },
  // Relative luminance and contrast, after WCAG 2.2.
  luminance(color) {
    const linear = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
    const [r, g, b] = color.map((x) => linear(x / 255));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  },
  contrast(a, b) {
    const [dark, bright] = [a, b].map(tests.luminance).sort((x, y) => x - y);
    return (bright + 0.05) / (dark + 0.05);
  },
  opacity(element) {
    return element ? Number(getComputedStyle(element).opacity) * tests.opacity(element.parentElement) : 1;
  },
  // Shows what is seen at times only.
  showAll() {
    tests.unfold();
    const style = document.createElement("style");
    style.textContent = "* { transition: none !important; }";
    document.head.append(style);
    for (const refusal of document.querySelectorAll(".refusal")) refusal.textContent = "refused";
    if (!window.live) return;
    tests.of("toast").textContent = "done";
    tests.of("toast").classList.add("on");
    tests.of("drift").classList.add("bad");
    tests.of("by-hand").showModal();
  },
  // Sliders and symbols as they are under a finger.
  lightUp() { for (const part of document.querySelectorAll(".slider, [data-s]")) part.classList.add("hot"); },
  // Texts of less contrast than 4.5.
  faint() {
    const found = new Set(), walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
      const { parentElement: element, textContent } = walker.currentNode, opacity = tests.opacity(element);
      if (!textContent.trim() || !element.checkVisibility() || opacity < 0.05) continue;
      if (element.closest("script, style, noscript, option, canvas")) continue;
      const ground = tests.ground(element);
      const [r, g, b, alpha] = tests.channels(getComputedStyle(element).color);
      const ratio = tests.contrast(tests.over([r, g, b, alpha * opacity], ground), ground);
      const words = `${tests.words(element)} “${textContent.trim().slice(0, 30)}”`;
      if (ratio < 4.5) found.add(`${words}: ${ratio.toFixed(2)}`);
    }
    return [...found];
  },
  // The same of what is written on canvases: labels of axes, and words of pictures.
  faintOnCanvas() {
    if (!window.live) return [];
    const probe = document.body.appendChild(document.createElement("p"));
    const color = (name) => {
      probe.style.color = `var(--${name})`;
      return tests.channels(getComputedStyle(probe).color).slice(0, 3);
    };
    const ratio = ([text, ground]) => tests.contrast(color(text), color(ground));
    const found = [["quiet", "panel"], ["ink", "panel"]].filter((pair) => ratio(pair) < 4.5);
    probe.remove();
    return found.map((pair) => pair.join(" on "));
  },

  // ---- the motion

  // Everything that an address keeps, to the last digit.
  state() {
    const { motion, start, w, method, accuracy } = live.player, { t, q, u, m } = start;
    return JSON.stringify([t, ...[q, u, m, w, motion.p].map((list) => Array.from(list)), method, accuracy]);
  },
  // The state some time after the start, computed without a clock; or why there is none.
  later(seconds) {
    const { player } = live, { motion, start, method, accuracy } = player, { t, q, u, m } = start;
    const end = t + seconds, refusal = motion.start(t, q, u, player.w, m);
    let made = !refusal;
    while (made && motion.t < end && motion.steps < 2000) made = motion.step(method, accuracy, end);
    const state = JSON.stringify([motion.t, ...motion.q, ...motion.u]);
    const reason = refusal ?? motion.reason ?? "";
    player.begin(start);
    return `${state} ${reason}`;
  },
  // Follows the motion for ten seconds of playing at the tolerance 1e-8, whatever method a page begins with:
  // the largest drift of the energy account in parts of the energy, the steps in which it came together, and
  // the largest constraint residual.
  errors() {
    tests.choose("method", "dp5");
    tests.choose("accuracy", "1e-8");
    const { player } = live;
    player.begin(player.start);
    let state = "more", drift = 0, residual = 0;
    while (state === "more" && player.last < 600) state = player.advance(Infinity);
    for (const instant of player.instants) {
      drift = Math.max(drift, Math.abs(instant.drift) / player.scale);
      residual = Math.max(residual, instant.residual);
    }
    const { steps } = player.motion, reason = player.reason ?? "";
    // Ten seconds of playing, or an end that was asked for.
    const followed = player.last === 600 || /ends at event|was to be followed/.test(reason);
    return { drift, residual, steps, followed, t: player.time(player.last), reason };
  },
  choose(id, value) {
    const select = tests.of(id);
    select.value = value;
    select.dispatchEvent(new Event("change"));
  },
  // What a slider says of a value that it does not take.
  refusal: (id) => tests.of(id).closest(".slider").querySelector(".refusal").textContent,
  // Whether constraints hold the number of a slider of the start, as their Jacobian says.
  isHeld(id) {
    const [, part, digits] = /^([qu])(\d+)/.exec(id) ?? [];
    if (!part) return false;
    const { motion: { system }, start: { t, q, u } } = live.player, n = q.length;
    const jacobian = system.value("jacobian", t, q, u), basis = [];
    const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
    // What is left of a vector beside the rows before.
    const beside = (vector) => basis.reduce((v, b) => {
      const along = dot(v, b);
      return v.map((x, i) => x - along * b[i]);
    }, vector);
    for (let row = 0; row < (part === "q" ? system.holonomic : system.r); row++) {
      const vector = Array.from(jacobian.slice(row * n, (row + 1) * n)), rest = beside(beside(vector));
      const length = Math.sqrt(dot(rest, rest));
      if (system.holds(row) && length > 1e-7 * Math.sqrt(dot(vector, vector))) {
        basis.push(rest.map((x) => x / length));
      }
    }
    const unit = Array.from(q, (x, i) => (i === Number(digits) ? 1 : 0)), rest = beside(beside(unit));
    return dot(rest, rest) < 1e-12;
  },
  // Sliders of the start that show another number than that of the start.
  staleStarts() {
    const { q, u } = live.player.start, read = (text) => Number(text.replace("−", "-").split(" ")[0]);
    return [["q", q], ["u", u]].flatMap(([part, values]) => Array.from(values).flatMap((value, i) => {
      // Nodes of families have no sliders.
      if (!tests.of(part + i)) return [];
      const shown = read(tests.of(part + i).getAttribute("aria-valuetext"));
      const stale = Math.abs(shown - value) > 0.006 * Math.abs(value) + 1e-12;
      return stale ? [`${part}${i} (${shown} instead of ${value})`] : [];
    }));
  },
  // Links that nobody should send.
  strangeLinks() {
    const all = [...new URLSearchParams(live.link()).keys()].filter((key) => !key.startsWith("~"));
    const every = (value) => new URLSearchParams(all.map((key) => [key, value])).toString();
    return [
      every("-1"), every("0"), every("1e300"), every("x") + "&~modes=7,7,7&%ZZ=%&&=",
      "~method=toString&~accuracy=1e300&~t=1e9", "~method=dp5&~accuracy=1e-300",
    ];
  },
  sliders() {
    return tests.controls().filter(({ type, id }) => type === "range" && id !== "scrub").map(({ id }) => id);
  },

  // ---- dragging

  // The canvas's corner in the window.
  corner() {
    const { left, top } = tests.of("picture").getBoundingClientRect();
    return [left, top];
  },
  inWindow(point) {
    const corner = tests.corner();
    return live.picture.onCanvas(point).map((x, axis) => x + corner[axis]);
  },
  isInPicture([x, y]) {
    const { left, right, top, bottom } = tests.of("picture").getBoundingClientRect();
    return x > left && x < right && y > top && y < bottom;
  },
  // Shows the middle of the next two seconds of playing, and finds those of their states that are possible at
  // its time, too.
  reachable() {
    const { player } = live, { system } = player.motion;
    let state = "more";
    while (state === "more" && player.last < 120) state = player.advance(Infinity);
    const states = player.instants.map(({ y }) => [y.slice(0, y.length / 2), y.slice(y.length / 2)]);
    const scrub = tests.of("scrub");
    scrub.value = scrub.max / 2;
    scrub.dispatchEvent(new Event("input"));
    // A drive holds other places at other times.
    const t = player.time();
    const residual = (state) => Array.from(system.value("residual", t, ...state) ?? []);
    tests.states = states.filter((state) => residual(state).every((x) => Math.abs(x) < 1e-6));
  },
  // Waits until the view stands, but no longer than some seconds.
  async settled() {
    for (let still = 0, turn = 0, before = ""; still < 20 && turn < 300; turn++) {
      await tests.frames(1);
      const now = JSON.stringify(live.picture.painter.view);
      still = now === before ? still + 1 : 0;
      before = now;
    }
  },
  // A point to be dragged, where it is, and where else it can be: a place of it in `states`, some 80 px away.
  // Null where no point can move.
  dragged() {
    const { player, picture } = live, { system } = player.motion, corner = tests.corner();
    let best = null;
    for (const handle of picture.handles()) {
      const { dimension, first } = handle, from = tests.inWindow(handle.place());
      const taken = picture.handleAt(from[0] - corner[0], from[1] - corner[1], false);
      if (taken?.index !== handle.index) continue;
      const places = tests.states.map((state) => {
        const all = system.value("points", player.time(), ...state);
        const [a, b, c] = all.slice(first, first + dimension);
        return tests.inWindow(dimension === 3 ? [a, b, c] : picture.space ? [a, 0, b] : [a, b]);
      });
      for (const to of places.filter(tests.isInPicture)) {
        const way = Math.hypot(to[0] - from[0], to[1] - from[1]), off = Math.abs(way - 80);
        if (way > 8 && !(best?.off < off)) best = { name: handle.name, from, to, way, off };
      }
    }
    return best;
  },
  // Where the held point is seen.
  heldAt: () => tests.inWindow(live.picture.held.handle.place()),
};
