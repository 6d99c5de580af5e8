// The bar under a picture: play, back to the start, time, speed, and the keys of the page.
"use strict";
const SPEEDS = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20];   // parts of the usual speed

// What the page does: `toggle` plays or pauses, `again` goes back to the start, `seek` to a part of the time
// that the bar spans, `step` moves by instants, `far(more)` of them for an arrow, `hurry` plays at a speed of
// SPEEDS; `keys` are further keys of the page.
function makeTransport({ toggle, again, seek, step, far, hurry, keys }) {
  const [play, scrub, speed] = [$("play"), $("scrub"), $("speed")];
  let playing = false, before = null;

  play.addEventListener("click", toggle);
  $("again").addEventListener("click", again);
  scrub.addEventListener("input", () => seek(scrub.valueAsNumber));
  speed.addEventListener("change", () => hurry(SPEEDS[speed.selectedIndex]));
  function faster(by) {
    speed.selectedIndex = clamp(speed.selectedIndex + by, 0, SPEEDS.length - 1);
    hurry(SPEEDS[speed.selectedIndex]);
  }

  document.addEventListener("keydown", (event) => {
    const { key, shiftKey } = event, within = (selector) => event.target.closest?.(selector);
    // What a focused control does with its keys is its own affair; the time takes arrows as the page does.
    if (event.ctrlKey || event.metaKey || event.altKey || within("select, summary, dialog")) return;
    if (key === " " && within("button") || key.startsWith("Arrow") && within("input:not(#scrub)")) return;
    const actions = {
      " ": toggle, k: toggle, r: again, R: again,
      ArrowLeft: () => step(-far(shiftKey)), ArrowRight: () => step(far(shiftKey)),
      ",": () => step(-1), ".": () => step(1),
      "+": () => faster(1), "=": () => faster(1), "-": () => faster(-1), ...keys,
    };
    if (!Object.hasOwn(actions, key)) return;
    event.preventDefault();
    actions[key]();
  });

  return {
    // Offers speeds; `usual` seconds of the motion pass in a second of playing.
    offer(usual) {
      const words = (factor) => number(Number((factor * usual).toPrecision(6))) + " ×";
      speed.replaceChildren(...SPEEDS.map((factor) => new Option(words(factor), factor)));
      speed.selectedIndex = SPEEDS.indexOf(1);
    },
    // Says whether the motion plays.
    show(on) {
      playing = on;
      before = null;
      $("sign").setAttribute("d", on ? "M6 5h4v14H6zM14 5h4v14h-4z" : "M7 4.5v15l12.5-7.5z");
      play.setAttribute("aria-label", on ? "pause" : "play");
    },
    // Says where it is; `spoken` differs from `words` where those are too long to be heard.
    place(part, words, spoken = words) {
      scrub.value = part;
      $("time").textContent = words;
      if (!playing) scrub.setAttribute("aria-valuetext", spoken);
    },
    // Seconds since the last picture. A page that was hidden goes on where it was.
    passed(clock) {
      const seconds = before === null ? 0 : Math.min(clock - before, 100) / 1000;
      before = clock;
      return seconds;
    },
  };
}
const reducedMotion = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
// Colours follow the scheme of the reader's device.
function watchScheme(repaint) {
  readPalette();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readPalette(); repaint(); });
}
