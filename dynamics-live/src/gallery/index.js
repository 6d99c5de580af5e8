// Stops all pictures of the index, and lets them go on.
"use strict";
const button = document.getElementById("still"), frames = [...document.querySelectorAll("iframe")];
button.hidden = matchMedia("(prefers-reduced-motion: reduce)").matches;
button.addEventListener("click", () => {
  const stopped = button.getAttribute("aria-pressed") === "false";
  button.setAttribute("aria-pressed", stopped);
  // Another fragment loads no page again.
  for (const frame of frames) frame.src = frame.src.split("#")[0] + "#only=picture" + (stopped ? "&still=1" : "");
});
