// Stops all pictures of the index, and lets them go on.
"use strict";
const button = document.getElementById("still"), frames = [...document.querySelectorAll("iframe")];
button.hidden = matchMedia("(prefers-reduced-motion: reduce)").matches;
// In a frame that has loaded, a new address takes the place of the last one, so that the browser's way back
// leads out of this page. One that is still to come has no entry in the history yet.
const loaded = new WeakSet();
for (const frame of frames) frame.addEventListener("load", () => loaded.add(frame));
button.addEventListener("click", () => {
  const stopped = button.getAttribute("aria-pressed") === "false";
  button.setAttribute("aria-pressed", stopped);
  // Another fragment loads no page again.
  for (const frame of frames) {
    const address = frame.src.split("#")[0] + "#~only=picture" + (stopped ? "&~still=1" : "");
    if (loaded.has(frame)) frame.contentWindow.location.replace(address);
    else frame.src = address;
  }
});
