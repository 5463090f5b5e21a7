"use strict";
// Figures as SVG, from a part of Plotly's JSON: lines, points, bands and bars on linear, log and
// category axes, lines and boxes across.

const DRAG = 12; // the least size of a box to zoom to [px]
let clips = 0;

// Draw a figure into a box, and draw it again when the size of the box changes.
//   data: the traces, with their values in place of "driver".
// Returns `reset` (the zoom), `show` (a series, or hide it), `fit` (the figure to a width and
// height for paper, or to the box without them), `change` (to other traces and lines across) and
// `at` (the values at a place of the box).
function plot(box, { data, layout }) {
  const clip = `clip-${clips++}`;
  const hidden = new Set();
  let frame = null;
  let view = null;
  let size = null;
  // read when the box changes: a question for it makes the browser lay out all figures before
  let room = [0, 0];
  let family = "";

  const seen = () => data.filter((trace) => !hidden.has(trace.meta));
  const hasValues = ({ name, hoverinfo, type }) => name && hoverinfo !== "skip" && type !== "bar";
  const values = readout(box, layout, () => ({ frame, traces: seen().filter(hasValues) }));

  function draw() {
    const [width, height] = size || room;
    if (!width) return;
    values.clear();
    frame = frameOf(seen(), layout, [width, height], view, family);
    const { left, right, top, bottom } = frame;
    const whole = { viewBox: `0 0 ${width} ${height}`, width, height, "aria-hidden": "true" };
    const inside = svgElement("rect", rectangle([left, top], [right, bottom]));
    const content = [...shapes(frame), ...seen().flatMap((trace) => drawn(trace, frame))];
    const svg = svgElement(
      "svg",
      whole,
      svgElement("clipPath", { id: clip }, inside),
      ...grid(frame),
      svgElement("g", { "clip-path": `url(#${clip})` }, ...content),
      svgElement("g", { class: "pointer" }),
    );
    box.replaceChildren(svg, values.element);
  }

  function reset() {
    view = null;
    delete box.dataset.zoomed;
    draw();
  }

  // A dragged box fills the figure; a flat or narrow box enlarges only one axis.
  function enlarge([x0, y0], [x1, y1]) {
    const ends = { x: [x0, x1], y: [y0, y1] };
    const drag = ([from, to]) => Math.abs(to - from) > DRAG;
    const axes = ["x", "y"].filter((axis) => drag(ends[axis]) && frame[axis].back);
    if (!axes.length) return;
    const before = view || { x: null, y: null };
    const to = (axis) => ends[axis].map(frame[axis].back).sort((one, other) => one - other);
    view = { ...before, ...Object.fromEntries(axes.map((axis) => [axis, to(axis)])) };
    box.dataset.zoomed = "";
    draw();
  }

  function listenToPointer() {
    let start = null;
    const at = (event) => {
      const { left, top } = box.getBoundingClientRect();
      return [event.clientX - left, event.clientY - top];
    };
    box.addEventListener("pointermove", (event) => {
      if (!frame) return;
      if (!start) return values.point(...at(event));
      values.clear();
      const zoom = svgElement("rect", { class: "zoom", ...rectangle(start, at(event)) });
      box.querySelector(".pointer").replaceChildren(zoom);
    });
    box.addEventListener("pointerdown", (event) => {
      if (!frame || event.button || event.pointerType !== "mouse") return;
      start = at(event);
      box.setPointerCapture(event.pointerId);
    });
    box.addEventListener("pointerup", (event) => {
      if (start) enlarge(start, at(event));
      start = null;
    });
    box.addEventListener("pointerleave", values.clear);
    box.addEventListener("blur", values.clear);
    box.addEventListener("dblclick", reset);
  }

  listenToPointer();
  listenToKeys(box, {
    ArrowLeft: () => values.step(-1),
    ArrowRight: () => values.step(1),
    ArrowDown: () => values.step(-1),
    ArrowUp: () => values.step(1),
    Escape: () => (view ? reset() : values.clear()),
  });
  function fill() {
    room = [box.clientWidth, box.clientHeight];
    family = getComputedStyle(box).fontFamily;
    draw();
  }
  new ResizeObserver(fill).observe(box);
  fill();
  return {
    reset,
    show(series, on) {
      if (!data.some((trace) => trace.meta === series)) return;
      if (on) hidden.delete(series);
      else hidden.add(series);
      draw();
    },
    at: ([x, y]) => ({ x: frame.x.back(x), y: frame.y.back(y) }),
    change(traces, across) {
      data = traces;
      layout.shapes = across;
      draw();
    },
    fit(...given) {
      size = given.length ? given : null;
      draw();
    },
  };
}
