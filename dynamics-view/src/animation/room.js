// How large the picture is drawn, so that all of the motion stays inside of it, with its words.
"use strict";
const makeRoom = ({ films, space, half, at, numbersOf }) => {
  // Every figure at every instant, with its numbers, its words and where its film is.
  function everyFigure(visit) {
    for (const film of films) for (const scene of film.scenes) {
      let number = 0, word = 0;
      for (const figure of scene.figures) {
        const columns = scene.numbers.slice(number, number + numbersOf(figure));
        number += columns.length;
        const words = figure.k === "text" ? scene.words[word++] : "";
        const lists = [...columns, words].filter((column) => typeof column === "object" && column !== null);
        const instants = Math.max(1, ...lists.map((column) => column.length));
        for (let k = 0; k < instants; k++) {
          visit(figure, columns.map((column) => at(column, k)), Array.isArray(words) ? words[k] : words);
        }
      }
    }
  }

  // All places of space that figures reach, with the radius about them.
  function everyPlace(visit) {
    everyFigure((figure, v) => {
      if (figure.k !== "text") space.places(figure, v, pointsOf(figure), visit);
    });
  }

  // Where every text stands, how wide it is in pixels, and whether it is beside its point: once, in few
  // places of the view.
  let placedWords = null;
  function wordsOf(pen) {
    if (placedWords) return placedWords;
    pen.font = fontOfWords;
    const found = new Map();
    everyFigure((figure, v, words) => {
      if (figure.k !== "text" || !words || v.some(Number.isNaN)) return;
      const [x, y] = space ? space.project(v) : v, key = figure.b + words;
      const seen = found.get(key);
      if (!seen) {
        found.set(key, { beside: figure.b, width: pen.measureText(words).width, box: [x, x, y, y] });
        return;
      }
      const [left, right, down, up] = seen.box;
      seen.box = [Math.min(left, x), Math.max(right, x), Math.min(down, y), Math.max(up, y)];
    });
    return (placedWords = [...found.values()]);
  }

  // Pixels that are kept free at the left, right, lower and upper edge, so that figures of fixed size and
  // words stay inside.
  let margins = { of: "", free: [0, 0, 0, 0] };
  function fit([left, right, down, up], width, height, free) {
    const across = (width - free[0] - free[1]) / Math.max(right - left, 2);
    const upright = (height - free[2] - free[3]) / Math.max(up - down, 2);
    const scale = Math.max(1e-9, Math.min(across, upright));
    const x = (free[0] + width - free[1]) / 2 - scale * (left + right) / 2;
    const y = (free[3] + height - free[2]) / 2 + scale * (down + up) / 2;
    return { scale, x, y };
  }
  function freeEdges(pen, width, height) {
    const of = width + " " + height;
    if (margins.of === of) return margins.free;
    const signs = Math.min(34, 0.08 * Math.min(width, height)) + 4;
    let free = [signs, signs, signs, signs];
    const words = wordsOf(pen);
    // The scale changes with the room for words, and the room that is missing with the scale.
    for (let round = 0; round < 6 && words.length; round++) {
      const { scale, x, y } = fit(fromTheFirst, width, height, free), missing = [0, 0, 0, 0];
      for (const { beside, width: wide, box } of words) {
        const [toLeft, toRight] = beside ? [0, besideWords + wide] : [wide / 2, wide / 2];
        const raised = beside ? besideWords : 0;
        const over = [
          3 + toLeft - (x + scale * box[0]), x + scale * box[1] + toRight + 3 - width,
          y - scale * box[2] - raised + 10 - height, 10 + raised - (y - scale * box[3]),
        ];
        over.forEach((pixels, side) => { missing[side] = Math.max(missing[side], pixels); });
      }
      if (missing.every((pixels) => pixels <= 0)) break;
      // Words never take more than half of the picture.
      const most = (side) => 0.25 * (side < 2 ? width : height);
      free = free.map((pixels, side) => Math.min(pixels + Math.max(0, missing[side]), most(side)));
    }
    margins = { of, free };
    return free;
  }

  // What has to have room: [left, right, down, up] in parts of the view.
  const fromTheFirst = space ? space.extent(everyPlace) : [-half[0], half[0], -half[1], half[1]];

  return {
    // Scale, and where the middle of the view is, in pixels.
    view(pen, width, height) {
      const reach = space ? space.reach(fromTheFirst, everyPlace) : fromTheFirst;
      return fit(reach, width, height, freeEdges(pen, width, height));
    },
  };
};
