// The page: what the viewer does, the address, and the clock.
"use strict";
const player = new Player(), picture = new Picture($("picture"), player);
const phase = new PhasePlot($("phase"), player), precision = new Precision($("precision"), player);
const plots = [];
// With `~only=picture` in its address the page is its picture alone, for frames of other pages; with
// `~still=1` that stands. (`#picture` would be the place of an element, to which the outer page would
// scroll.)
const asked = (name) => new URLSearchParams(location.hash.slice(1)).get(name);
const alone = asked("~only") === "picture", still = () => asked("~still") === "1";
document.documentElement.classList.toggle("alone", alone);
let dirty = true, chartDirty = true, frames = 0, spent = 0;

// ---- words

let toastTimer;
function toast(text) {
  $("toast").textContent = text;
  $("toast").classList.add("on");
  clearTimeout(toastTimer);
  toastTimer = setTimeout(() => $("toast").classList.remove("on"), 4000);
}
const setStatus = (text) => { if ($("status").textContent !== text) $("status").textContent = text; };

// Times with as many digits as the pace shows; very short and very long ones count in a power of ten.
function timeWords(t) {
  const { pace } = player, power = pace < 1e-3 || pace > 1e4 ? Math.floor(Math.log10(pace)) : 0;
  const digits = clamp(2 - Math.floor(Math.log10(pace)) + power, 0, 6);
  return (t / 10 ** power).toFixed(digits).replace(/^-(?=0\.?0*$)/, "").replace("-", "−")
    + (power ? scaled(power, "s") : " s");
}
const driftWords = (part) =>
  (Number.isFinite(part) ? `drift ${part < 1e-16 ? "0" : number(part, 2)}` : "drift unknown");
// What a screen reader says of a picture that stands.
let sayTimer;
function say() {
  clearTimeout(sayTimer);
  sayTimer = setTimeout(() => {
    const y = player.show();
    const shown = MODEL.coordinates.slice(0, 6)
      .map(({ name, unit }, i) => `${name} = ${number(y[i])} ${unit}`.trim());
    if (N > 6) shown.push(`and ${N - 6} more`);
    const text = `t = ${timeWords(player.time())}: ${shown.join(", ")}`;
    $("live").textContent = text;
    $("picture").setAttribute("aria-label", `${MODEL.title}, ${text}`);
  }, 250);
}

// ---- play, scrub, start again

function setPlaying(on) {
  if (on && player.reason && player.head >= player.last - 1e-6) player.begin(player.start);
  if (on) player.cut();
  player.playing = on;
  transport.show(on);
  pacing.clear();
  if (!on) say();
  dirty = true;
}
// A start that the viewer chose.
function takeStart(start, forget = true) {
  if (forget) picture.forget();
  return player.begin(start);
}
const backToStart = () => { player.begin(player.start); dirty = true; };
// One instant after another while the motion stands.
function stepBy(instants) {
  if (player.playing) setPlaying(false);
  const goal = player.head + instants;
  for (const deadline = performance.now() + 50; player.last < goal;) {
    if (player.advance(deadline) !== "more") break;
  }
  player.seek(goal);
  say();
  dirty = true;
}

// Whether playing keeps up, over about a second.
const pacing = {
  clear() { this.wanted = this.reached = 0; this.slow = ""; },
  note(passed, part) {
    this.wanted += passed;
    this.reached += passed * part;
    if (this.wanted < 0.8) return;
    const share = this.reached / this.wanted, { motion } = player;
    const rate = player.now.slice(N).reduce((most, u) => Math.max(most, Math.abs(u)), 0);
    const step = `steps of ${number(motion.t - motion.t0, 2)} s, rates up to ${number(rate, 2)} per second`;
    this.clear();
    const speed = `×${number(share * player.speed, 2)}`;
    if (share < 1e-3) this.slow = `does not get ahead: ${step}`;
    else if (share < 0.93) this.slow = `${speed}: as fast as this device computes it (${step})`;
  },
};

// A picture alone begins again where all that moved has stood still for a while.
const rest = {
  most: new Float64Array(N), seconds: 0,
  note(passed) {
    let moved = false, still = true;
    for (let i = 0; i < N; i++) {
      const rate = Math.abs(player.now[N + i]);
      this.most[i] = Math.max(this.most[i], rate);
      moved ||= this.most[i] > 0;
      still &&= rate <= 2e-3 * this.most[i];
    }
    this.seconds = moved && still ? this.seconds + passed : 0;
    if (this.seconds < 1.5) return;
    this.most.fill(this.seconds = 0);
    backToStart();
  },
};

// ---- the picture under the finger

// The point that a press takes hold of, or null.
function pointUnder(event) {
  const box = $("picture").getBoundingClientRect(), fingers = event.pointerType === "touch";
  if (picture.held || !event.isPrimary || event.button) return null;
  return picture.handleAt(event.clientX - box.left, event.clientY - box.top, fingers);
}
function takesPoint(event) {
  return picture.held ? picture.held.pointer === event.pointerId : Boolean(pointUnder(event));
}
let pressed = false;   // whether the last press took a point
// What the viewer sees of the picture; strip charts in its place stand.
const look = !picture.program ? null : makeLook({
  canvas: $("picture"), sight: picture.sight, names: picture.followed.map(({ name }) => name),
  refresh: () => { dirty = true; }, takes: takesPoint, letGo: () => letGo(),
});
picture.look = look;
picture.numbered = !alone;
function letGo(event) {
  if (picture.release(event)) setPlaying(true);
  dirty = true;
}
function listenToPicture() {
  const canvas = $("picture");
  canvas.addEventListener("pointerdown", (event) => {
    const handle = pointUnder(event);
    pressed = Boolean(handle);
    if (!handle) return;
    picture.take(event, handle);
    $("hint").classList.add("gone");
    dirty = true;
  });
  canvas.addEventListener("pointermove", (event) => {
    if (picture.held?.pointer !== event.pointerId) return;
    const refusal = picture.move(event);
    setStatus(refusal ?? "");
    dirty = true;
  });
  for (const kind of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(kind, (event) => {
      if (picture.held?.pointer === event.pointerId) letGo(event);
    });
  }
  canvas.addEventListener("click", () => {
    if (!pressed && !look?.dragged) setPlaying(!player.playing);
  });
  canvas.addEventListener("keydown", nudgeByKey);
  for (const kind of ["focus", "blur"]) canvas.addEventListener(kind, () => { dirty = true; });
}
// On the focused picture arrows move a point, N takes the next one.
function nudgeByKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
  const handles = picture.handles();
  if (!handles.length || !(way || event.key === "n")) return;
  event.preventDefault();
  event.stopPropagation();
  if (player.playing) setPlaying(false);
  if (way) {
    picture.nudge(...way.map((x) => x * (event.shiftKey ? 5 : 1)));
    say();
  } else {
    picture.grip = (picture.grip + 1) % handles.length;
    $("live").textContent = `point ${handles[picture.grip].name}`;
  }
  dirty = true;
}

// ---- the bar and its keys

const transport = makeTransport({
  toggle: () => setPlaying(!player.playing), again: backToStart, step: stepBy,
  seek(part) {
    if (player.playing) setPlaying(false);
    player.seek(player.first + part * (player.last - player.first));
    say();
    dirty = true;
  },
  far: (more) => (more ? RATE : RATE / 10),
  hurry(speed) {
    player.speed = speed;
    pacing.clear();
  },
  keys: look?.keys,
});

// ---- how far the motion reaches

// Runs ahead of the motion from every start, so that the view and the sliders know how far it reaches.
const probe = {
  shadow: new Motion(PROGRAMS, MODEL), wanted: false, spent: 0,
  stale() { this.wanted = true; this.spent = 0; this.begun = false; },
  begin() {
    const { shadow } = this, { t, q, u, m } = player.start;
    this.begun = true;
    this.lo = new Float64Array(2 * N).fill(Infinity);
    this.hi = new Float64Array(2 * N).fill(-Infinity);
    this.next = t;
    shadow.p.set(player.motion.p);
    return !(shadow.refresh() ?? shadow.start(t, q, u, player.w, m));
  },
  // Works until `deadline` or for 60 ms in all; looks thirty times in a second of playing.
  work(deadline) {
    if (!this.wanted || player.held) return;
    const { shadow } = this, began = performance.now(), { method } = player;
    const accuracy = METHODS[method].fixed ? player.accuracy : Math.max(player.accuracy, 1e-6);
    const end = Math.min(player.start.t + 10 * player.pace, player.end), y = new Float64Array(2 * N);
    let fine = this.begun || this.begin();
    while (fine && this.next <= end && performance.now() < deadline) {
      while (fine && shadow.t < this.next && performance.now() < deadline) {
        fine = shadow.step(method, accuracy, end);
      }
      if (!fine || shadow.t < this.next) break;
      if (this.next < shadow.t) shadow.at(this.next, y);
      else { y.set(shadow.q); y.set(shadow.u, N); }
      this.lo = this.lo.map((lo, i) => Math.min(lo, y[i]));
      this.hi = this.hi.map((hi, i) => Math.max(hi, y[i]));
      if (picture.program) picture.include(picture.sample(this.next, y, shadow));
      this.next += player.pace / 30;
    }
    this.spent += performance.now() - began;
    if (fine && this.next <= end && this.spent < 60) return;
    this.wanted = false;
    if (!this.fitted && this.lo[0] <= this.hi[0]) { this.fitted = true; fitStartSliders(this); }
  },
};

// ---- the clock

// Plots that nobody sees are not drawn.
const inSight = new Set();
const sight = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) inSight[isIntersecting ? "add" : "delete"](target);
  dirty = chartDirty = true;
}, { rootMargin: "100px" });

function drawAll() {
  player.show();
  picture.draw();
  for (const plot of plots) if (inSight.has(plot.canvas)) plot.draw();
  if (chartDirty) {
    chartDirty = false;
    precision.draw();
    const span = number(precision.span ?? 5 * player.pace);
    $("horizon").textContent = `after ${span} s` + (precision.busy ? " …" : "");
  }
  const { spacing } = picture, { first, last, head } = player;
  $("scale").textContent = spacing ? `grid ${number(spacing)} ${MODEL.length_unit ?? ""}`.trim() : "";
  transport.place(last > first ? (head - first) / (last - first) : 1, timeWords(player.time()));
  const { shown } = player, part = Math.abs(shown.drift) / (player.scale || 1);
  $("drift").textContent = driftWords(part);
  $("drift").classList.toggle("bad", !(part <= 0.01));
  $("residual-now").textContent = number(shown.residual, 2);
  if (player.held) return;
  setStatus(player.reason && head >= last - 1 ? player.reason : player.playing ? pacing.slow : "");
}
function tick(clock) {
  if (alone && !inSight.has($("picture"))) {
    transport.passed(clock);
    requestAnimationFrame(tick);
    return;
  }
  const began = performance.now();
  if (player.playing && !player.held) {
    const passed = transport.passed(clock);
    const { ended, reached } = player.play(passed, began + 10);
    pacing.note(passed, reached);
    if (alone) rest.note(passed);
    if (ended && player.head >= player.last - 1e-6) {
      setPlaying(false);
      if (alone) setTimeout(() => { if (!still()) setPlaying(true); }, 1500);
    }
    dirty = true;
  }
  if (probe.wanted) { probe.work(began + 8); dirty = true; }
  else if (!alone && precision.work(performance.now() + 4)) dirty = chartDirty = true;
  if (dirty || picture.gliding) { dirty = false; drawAll(); }
  spent += performance.now() - began;
  frames++;
  requestAnimationFrame(tick);
}

// ---- the beginning

function listen() {
  $("reset").addEventListener("click", resetParameters);
  $("share").addEventListener("click", () =>
    copy(`${location.href.split("#")[0]}#${link()}`, "Link copied: it opens this start and parameters"));
  $("rust").addEventListener("click", () => copy(rust(), "Copied: the same start as Rust"));
  $("csv").addEventListener("click", saveCsv);
  addEventListener("hashchange", () => {
    if (alone) setPlaying(!still());
    else recalled(recall());
  });
  const repaint = (printed) => {
    document.documentElement.classList.toggle("printed", printed);
    readPalette();
    chartDirty = true;
    for (const { canvas } of plots) inSight.add(canvas);
    drawAll();
  };
  addEventListener("beforeprint", () => repaint(true));
  addEventListener("afterprint", () => repaint(false));
  watchScheme(() => { dirty = chartDirty = true; });
  new ResizeObserver(() => { dirty = chartDirty = true; }).observe(document.body);
  for (const { canvas } of [...plots, picture]) sight.observe(canvas);
}
function begin() {
  readPalette();
  player.listeners.push((what) => {
    if (what !== "method") {
      showAccuracy();
      precision.stale();
      probe.stale();
      phase.forget();
      // Other parameters may have moved the start.
      syncStart();
    }
    remember();
    dirty = chartDirty = true;
  });
  makeParameters();
  makeInputs();
  makeStart();
  makeMethods();
  makePlots();
  const chosen = recall();
  player.settlePace(probe.shadow);
  recalled(chosen);
  listen();
  listenToPicture();
  transport.offer(player.pace);
  bindSymbols($("equations"));
  $("equations").hidden = !$("equations").querySelector("math");
  const loops = PROGRAMS.family;
  $("source").textContent = [loops ?? PROGRAMS.accelerations, PROGRAMS.terms].filter(Boolean)
    .flatMap(({ hoist, run, mass, forces }) => [hoist, run, mass, forces]).filter(Boolean)
    .map(String).join("\n\n");
  $("not-shown").replaceChildren(...(MODEL.not_portable ?? []).map((text) => element("li", "", text)));
  probe.work(performance.now() + 25);
  requestAnimationFrame(tick);
  if (!reducedMotion() && !still()) setPlaying(true);
  const hints = picture.handles().length ? [$("hint").textContent] : [];
  hints.push(`drag the ground to ${picture.space ? "turn" : "move"} it, scroll or pinch to zoom`);
  if (picture.program) $("hint").textContent = hints.join("; ");
  if (!$("hint").classList.contains("stays")) setTimeout(() => $("hint").classList.add("gone"), 6000);
}
// For tests: what a frame costs, and the motion.
window.live = {
  get frames() { return frames; }, get spent() { return spent; }, player, picture, precision, link, rust, csv,
};
begin();
