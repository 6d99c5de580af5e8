// What of the plane is seen: all of it, or what the viewer has chosen by zoom, shift and a point to follow.
"use strict";
const makePlane = () => {
  let zoom, shift;
  let followed = null;
  let scale = 1;                             // pixels to a length of the picture, as it was last seen
  let home = [0, 0], middle = [0, 0];        // places in the middle: of the whole picture, and as last seen

  function reset() {
    zoom = 1;
    shift = [0, 0];
    followed = null;
  }
  reset();

  // Moves what is seen by pixels.
  function drag(dx, dy) { shift = [shift[0] - dx / scale, shift[1] + dy / scale]; }

  return {
    reset, drag, stride: 40,
    get whole() { return zoom === 1 && !followed && !shift[0] && !shift[1]; },
    // The point that has to be in the middle, or null. Let go, the picture stays where it is.
    follow(point) {
      if (point && !followed) shift = [0, 0];
      if (!point && followed) shift = middle.map((x, axis) => x - home[axis]);
      followed = point;
    },
    aim(fit, width, height) {
      home = [(width / 2 - fit.x) / fit.scale, (fit.y - height / 2) / fit.scale];
      middle = (followed ?? home).map((x, axis) => x + shift[axis]);
      scale = zoom * fit.scale;
      return { scale, x: width / 2 - scale * middle[0], y: height / 2 + scale * middle[1] };
    },
    // Makes larger about (x, y), in pixels from the middle of the canvas to the right and down, or about the
    // point that is followed. Then moves by pixels.
    pinch(by, x = 0, y = 0, dx = 0, dy = 0) {
      const before = scale, next = clamp(zoom * by, 0.05, 50);
      scale *= next / zoom;
      zoom = next;
      const part = followed ? 0 : 1 / before - 1 / scale;
      shift = [shift[0] + x * part, shift[1] - y * part];
      drag(dx, dy);
    },
  };
};
