// How the viewer chooses what of the picture is seen: fingers, wheel, keys, and what to follow. `sight` is of
// `makePlane` or `makeSpace`.
"use strict";

// One finger or the mouse moves the plane and turns space; two fingers or the wheel make the picture larger;
// a double click shows the whole again. A press that `takes` says to be its own is left alone, until a second
// finger makes a gesture of both: then `letGo` is called. Returns whether the last press moved.
function makeGestures(canvas, sight, { refresh, whole, takes = () => false, letGo = () => {} }) {
  const held = new Map();
  let dragged = false, taken = null;
  // How far two fingers are apart, and what is between them.
  const pinch = () => {
    const [a, b] = [...held.values()];
    return { apart: Math.hypot(a.x - b.x, a.y - b.y), x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 };
  };
  const fromMiddle = ({ x, y }) => {
    const box = canvas.getBoundingClientRect();
    return [x - box.left - box.width / 2, y - box.top - box.height / 2];
  };
  canvas.classList.add("moves");
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    if (!held.size) {
      dragged = false;
      taken = takes(event) ? event.pointerId : null;
    } else if (taken !== null) {
      letGo();
      taken = null;
      dragged = true;
    }
    held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    const from = held.get(event.pointerId);
    if (!from) return;
    const to = { x: event.clientX, y: event.clientY }, [dx, dy] = [to.x - from.x, to.y - from.y];
    // A finger never holds still.
    if (taken === null && !dragged && Math.hypot(dx, dy) < 4) return;
    const pair = held.size === 2, before = pair && pinch();
    held.set(event.pointerId, to);
    if (taken !== null) return;
    dragged = true;
    if (held.size === 1) sight.drag(dx, dy);
    else if (before.apart > 0) {
      sight.pinch(pinch().apart / before.apart, ...fromMiddle(before), dx / 2, dy / 2);
    }
    refresh();
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (event) => {
      held.delete(event.pointerId);
      if (event.pointerId === taken) taken = null;
    });
  }
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    // Two fingers on a trackpad are a wheel with small numbers and the control key.
    const speed = event.ctrlKey ? 0.01 : 0.0015 * (event.deltaMode ? 30 : 1);
    const by = Math.exp(-speed * clamp(event.deltaY, -400, 400));
    sight.pinch(by, ...fromMiddle({ x: event.clientX, y: event.clientY }));
    refresh();
  }, { passive: false });
  canvas.addEventListener("dblclick", whole);
  return { get dragged() { return dragged; } };
}

// The picture's choices: `names` are points that can stay in its middle, `refresh` draws it again; `takes`
// and `letGo` are those of gestures.
function makeLook({ canvas, sight, names, refresh, ...hands }) {
  const follow = $("follow"), button = $("whole");
  let found = null;
  function whole() {
    follow.value = "";
    sight.reset();
    refresh();
  }
  function step(act) {
    act();
    refresh();
  }
  const gestures = makeGestures(canvas, sight, { refresh, whole, ...hands });
  follow.append(new Option("follow nothing", ""));
  names.forEach((name, k) => follow.append(new Option("follow " + name, k)));
  if (names.length > 1) follow.append(new Option("follow all", "all"));
  follow.hidden = !sight.follow || !names.length;
  follow.addEventListener("change", () => { found = null; refresh(); });
  button.addEventListener("click", () => {
    whole();
    // The button hides itself: keys go to the bar.
    $("play").focus();
  });

  // Where the followed point is; what is nowhere stays where it was.
  function place(points) {
    if (follow.value === "") return null;
    const chosen = follow.value === "all" ? points : [points[follow.value]];
    const known = chosen.filter((point) => point?.every(Number.isFinite));
    const mean = (axis) => known.reduce((sum, point) => sum + point[axis], 0) / known.length;
    if (known.length) found = [mean(0), mean(1)];
    return found;
  }
  return {
    get dragged() { return gestures.dragged; },
    // Before every picture: `points()` are the places of the names now.
    follow(points) {
      sight.follow?.(place(follow.value === "" ? [] : points()));
      button.hidden = sight.whole;
      if (!sight.whole) $("hint").classList.add("gone");
    },
    // Keys that move or turn the picture as a finger would, magnify it, and show the whole.
    keys: {
      a: () => step(() => sight.drag(-sight.stride, 0)), d: () => step(() => sight.drag(sight.stride, 0)),
      w: () => step(() => sight.drag(0, -sight.stride)), s: () => step(() => sight.drag(0, sight.stride)),
      z: () => step(() => sight.pinch(1.1)), x: () => step(() => sight.pinch(1 / 1.1)), 0: whole,
    },
  };
}
