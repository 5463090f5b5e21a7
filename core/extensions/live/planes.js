"use strict";
// Three plane views in which points are dragged.

const LATE = 60; // time for an answer, before the points are drawn without it [ms]
const NEAR = 14; // from a pointer to the point that it takes [px]
const NEAR_FINGER = 28;
const PLANE_VIEWS = [
  ["y z", "front"],
  ["x z", "side"],
  ["x y", "top"],
];

// The views of a table's points in a box.
//   metres: from a position in the file to global metres, and `file` back;
//   design: the numbers; choose: called with the point that is taken.
// Returns `change` (the drawing), `ghost` (another drawing behind it), `await`, `choose` (a point)
// and `spots` (the places of all points in a view [px]).
function planes(box, points, { metres, file, step }, design, choose) {
  const state = { drawing: null, motion: null, bounds: null, ghost: null, chosen: -1 };
  const views = PLANE_VIEWS.map(([plane, name]) => planeView(plane, name));
  box.replaceChildren(...views.map(({ figure }) => figure));

  function planeView(plane, name) {
    const canvas = document.createElement("canvas");
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${name} view; drag a point, or type in the table`);
    const figure = document.createElement("figure");
    const caption = document.createElement("figcaption");
    caption.textContent = `${name} (${plane})`;
    figure.className = "plane";
    figure.append(canvas, caption);
    const [azimuth, elevation] = PLANES[plane];
    let held = null;

    const look = { azimuth, elevation, zoom: 1, layers: ["wheels"] };
    const camera = () => cameraOf(look, state.bounds, canvas.clientWidth, canvas.clientHeight);

    function draw() {
      if (!state.motion || !canvas.clientWidth) return;
      const { drawing, motion, bounds } = state;
      paint(figure, drawing, motion, bounds, { ...look, frame: drawing.start });
      const style = getComputedStyle(figure);
      const colour = (key) => style.getPropertyValue(`--${key}`).trim();
      const { seen } = camera();
      const { line, disc } = brush(canvas.getContext("2d"));
      if (state.ghost) {
        for (const ends of state.ghost) line(ends.map(seen), colour("soft"), 1, [4, 4], 0.8);
      }
      design.rows().forEach((row, k) => {
        const at = seen(metres(row));
        const was = seen(metres(design.start[k]));
        const isChosen = k === state.chosen;
        line([was, at], colour("link"), 1, [2, 3]);
        disc(at, isChosen ? 6 : 4, colour(isChosen ? "link" : "paper"), colour("link"));
      });
      if (state.chosen >= 0) writeChosen(seen, colour, style.fontFamily);
    }

    function writeChosen(seen, colour, family) {
      const pen = canvas.getContext("2d");
      const write = writer(pen, canvas.clientWidth, canvas.clientHeight, family, colour("raised"));
      const at = seen(metres(design.rows()[state.chosen]));
      write(at, points[state.chosen].name, colour("link"), ABOVE_BELOW, "bold");
    }

    const place = (event) => {
      const { left, top } = canvas.getBoundingClientRect();
      return [event.clientX - left, event.clientY - top];
    };
    // The nearest point; of several at one place that which is nearest to the eye.
    function nearest(event) {
      if (!state.motion) return -1;
      const [x, y] = place(event);
      const { seen } = camera();
      const found = design.rows().map((row, k) => {
        const [px, py, depth] = seen(metres(row));
        return { k, far: Math.round(Math.hypot(px - x, py - y)), depth };
      });
      found.sort((a, b) => a.far - b.far || b.depth - a.depth);
      const most = event.pointerType === "mouse" ? NEAR : NEAR_FINGER;
      return found.length && found[0].far <= most ? found[0].k : -1;
    }
    // A finger beside the points scrolls the page.
    canvas.addEventListener(
      "touchstart",
      (event) => nearest(event.touches[0]) >= 0 && event.preventDefault(),
      { passive: false },
    );
    canvas.addEventListener("pointerdown", (event) => {
      const k = nearest(event);
      choose(k);
      if (k < 0 || event.button) return;
      event.preventDefault();
      canvas.setPointerCapture(event.pointerId);
      design.begin();
      held = { k, at: metres(design.rows()[k]), from: place(event) };
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) {
        canvas.style.cursor = nearest(event) < 0 ? "default" : "move";
        return;
      }
      const { seen } = camera();
      const moved = place(event).map((value, i) => value - held.from[i]);
      const origin = seen(held.at);
      const to = held.at.map((value, axis) => {
        const [x, y] = seen(sum(held.at, unit(axis), 1));
        const along = [x - origin[0], y - origin[1]];
        const square = along[0] ** 2 + along[1] ** 2;
        const metresMoved = (along[0] * moved[0] + along[1] * moved[1]) / square;
        return square < 1 ? value : value + (event.altKey ? 0.1 : 1) * metresMoved;
      });
      const old = file(held.at);
      const fine = event.altKey ? 0.1 * step : step;
      const rounded = file(to).map((value, i) =>
        design.locked[i] || Math.abs(value - old[i]) < 1e-9
          ? old[i]
          : Math.round(value / fine) * fine,
      );
      design.set(held.k, rounded);
    });
    const release = () => (held = null);
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    new ResizeObserver(draw).observe(canvas);
    const spots = () => design.rows().map((row) => camera().seen(metres(row)).slice(0, 2));
    return { figure, draw, spots };
  }

  // Several changes before the next picture are drawn once.
  let due = 0;
  let late = 0;
  function draw() {
    due = due || requestAnimationFrame(drawNow);
  }
  function drawNow() {
    cancelAnimationFrame(due);
    clearTimeout(late);
    due = late = 0;
    views.forEach((view) => view.draw());
  }
  const lines = (drawing) => {
    const { places } = motionOf(drawing);
    const at = places[drawing.start];
    return [...drawing.links, ...drawing.rods].map(([a, b]) => [at[a], at[b]]);
  };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  return {
    // Draw the points alone if the drawing to come is late.
    await: () => (late = late || setTimeout(draw, LATE)),
    spots: (view) => views[view].spots(),
    change(drawing, motion) {
      state.drawing = drawing;
      state.motion = motion;
      const places = [...state.motion.places, design.start.map(metres)];
      // The road is wider than the wheel and would make the points small.
      const wheels = motion.wheels.flat().map(({ tyre }) => ({ tyre, road: [] }));
      state.bounds = state.bounds || boundsOf({ places, wheels, forces: [] });
      drawNow();
    },
    ghost(drawing) {
      state.ghost = lines(drawing);
      draw();
    },
    choose(k) {
      state.chosen = k;
      draw();
    },
  };
}
