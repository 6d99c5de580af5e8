// Stops all pictures of the index, and lets them go on.
"use strict";
const button = document.getElementById("still"), frames = [...document.querySelectorAll("iframe")];
let stopped = false;
// Whether a frame has begun its page; of those of other origins, as all files are, nothing can be read.
function isLoaded({ contentWindow }) {
  try { return contentWindow.location.href !== "about:blank"; } catch { return true; }
}
// Another fragment loads no page again. It takes the place of the last one, so that the browser's way back leads
// out of this page.
function tell(frame) {
  const address = frame.src.split("#")[0] + "#~only=picture" + (stopped ? "&~still=1" : "");
  if (isLoaded(frame)) frame.contentWindow.location.replace(address);
}
for (const frame of frames) frame.addEventListener("load", () => { if (stopped) tell(frame); });
button.hidden = matchMedia("(prefers-reduced-motion: reduce)").matches;
button.addEventListener("click", () => {
  stopped = !stopped;
  button.setAttribute("aria-pressed", stopped);
  frames.forEach(tell);
});
