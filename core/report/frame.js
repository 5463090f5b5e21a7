"use strict";
// The frame of a figure: its scales, its grid, and the lines and boxes across it.

// The axes of bars: the one along which they stand, and the one of their height.
const barAxes = (trace) => (trace.orientation === "h" ? ["y", "x"] : ["x", "y"]);

// Where a figure is drawn in a box.
//   traces: the visible traces; size: width and height of the box [px];
//   view: the two values of each axis in the zoom, or null; font: family of the texts.
// Returns the edges of the frame [px], the scales `x` and `y`, the axes `sides`, whether names
// below it are `slanted`, the layout, and `tops`, where stacked bars end, by trace.
function frameOf(traces, layout, [width, height], view, font) {
  const tops = layout.barmode === "stack" ? stacked(traces) : new Map();
  const floor = layout.meta && layout.meta.floor;
  const values = {
    x: drawnValues("x", traces, tops, null),
    y: drawnValues("y", traces, tops, floor),
  };
  const sides = { x: sideOf("x", traces, layout), y: sideOf("y", traces, layout) };
  const slanted = isCategory(sides.x, values.x);
  const rows = Math.max(2, Math.floor((height - 60) / (isCategory(sides.y, values.y) ? 16 : 42)));
  const scale = (axis, from, to, count) =>
    scaled(sides[axis], values[axis], from, to, count, view && view[axis]);

  const texts = scale("y", height, 0, rows).ticks.map(([, text]) => text);
  const left = 32 + Math.min(0.5 * width, longest(texts, font));
  const names = slanted ? longest([...new Set(values.x)], font) : 0;
  const bottom = height - (slanted ? 14 + Math.min(90, 0.55 * names) : 42);
  const right = width - 14;
  const top = 12;
  const columns = Math.max(2, Math.floor((right - left) / (slanted ? 40 : 72)));
  const x = scale("x", left, right, columns);
  const y = scale("y", bottom, top, rows);
  const edges = { left, right, top, bottom, width, height };
  return { ...edges, x, y, sides, slanted, layout, floor, tops, font };
}

// The ends of stacked bars, by trace.
function stacked(traces) {
  const found = new Map();
  const sums = new Map();
  for (const trace of traces) {
    const [along, up] = barAxes(trace);
    const tops = trace[along].map((at, k) => {
      sums.set(at, (sums.get(at) || 0) + (trace[up][k] || 0));
      return sums.get(at);
    });
    found.set(trace, tops);
  }
  return found;
}

// All values along an axis that the frame must hold; zeros on a floor need no room.
function drawnValues(axis, traces, tops, floor) {
  const valuesOf = (trace) => {
    const height = barAxes(trace)[1] === axis;
    if (tops.has(trace) && height) return tops.get(trace);
    return trace.type === "bar" && !height ? edges(trace, axis) : trace[axis];
  };
  const missing = (value) => value === null || value === undefined || (floor && value === 0);
  return traces.flatMap(valuesOf).filter((value) => !missing(value));
}

// The axis of the layout; bars stand on zero.
function sideOf(axis, traces, layout) {
  const side = layout[`${axis}axis`];
  const stand = traces.some((trace) => trace.type === "bar" && barAxes(trace)[1] === axis);
  return stand ? { rangemode: "tozero", ...side } : side;
}

// The width of bars at numbers [unit of the axis]: the least distance of two; 0 for one bar, and
// for categories.
function barWidth(trace) {
  const at = trace[barAxes(trace)[0]];
  if (at.length < 2 || typeof at[0] === "string") return 0;
  return Math.min(...at.slice(1).map((value, k) => Math.abs(value - at[k])));
}

// Both ends of each bar along its axis; the places themselves for bars without a width.
function edges(trace, axis) {
  const half = 0.5 * barWidth(trace);
  return half ? trace[axis].flatMap((at) => [at - half, at + half]) : trace[axis];
}

// The width of the longest text [px].
const ruler = document.createElement("canvas").getContext("2d");

function longest(texts, font) {
  ruler.font = `12px ${font}`;
  return texts.reduce((most, text) => Math.max(most, ruler.measureText(text).width), 0);
}

function grid({ left, right, top, bottom, height, x, y, sides, slanted, font }) {
  const made = [];
  const line = (side, at) => (at === 0 && side.zeroline !== false ? "zero" : "grid");
  const add = (name, attributes, ...texts) => made.push(svgElement(name, attributes, ...texts));
  for (const [at, text] of x.ticks) {
    const place = x.place(at).toFixed(1);
    const aslant = `translate(${place} ${bottom + 12})rotate(-30)`;
    add("path", { class: line(sides.x, at), d: `M${place} ${top}V${bottom}` });
    if (slanted) add("text", { transform: aslant, "text-anchor": "end" }, text);
    else add("text", { x: place, y: bottom + 16, "text-anchor": "middle" }, text);
  }
  for (const [at, text] of y.ticks) {
    const place = y.place(at).toFixed(1);
    add("path", { class: line(sides.y, at), d: `M${left} ${place}H${right}` });
    add("text", { x: left - 6, y: +place + 4, "text-anchor": "end" }, text);
  }
  const title = { class: "title", "text-anchor": "middle" };
  const wide = longest([titleOf(sides.y)], font);
  const isLong = wide > bottom - top; // it stands over the whole height, in smaller letters
  const upwards = `translate(13 ${isLong ? height / 2 : (top + bottom) / 2})rotate(-90)`;
  const size = wide > height - 8 ? `font-size: ${(12 * (height - 8)) / wide}px` : "";
  add("text", { ...title, x: (left + right) / 2, y: height - 6 }, titleOf(sides.x));
  add("text", { ...title, transform: upwards, style: size }, titleOf(sides.y));
  return made;
}

// Boxes and lines across the whole figure, or between values.
function shapes(frame) {
  const whole = { x: [frame.left, frame.right], y: [frame.bottom, frame.top] };
  return (frame.layout.shapes || []).map((shape) => {
    const end = (axis, value) =>
      shape[`${axis}ref`] === "paper" ? whole[axis][value] : frame[axis].place(value);
    const [x0, x1] = [end("x", shape.x0), end("x", shape.x1)];
    const [y0, y1] = [end("y", shape.y0), end("y", shape.y1)];
    if (shape.type === "rect")
      return svgElement("rect", { ...rectangle([x0, y0], [x1, y1]), fill: shape.fillcolor });
    return svgElement("path", {
      class: "limit",
      d: `M${x0} ${y0}L${x1} ${y1}`,
      ...stroke(shape.line),
    });
  });
}

// The attributes of a rectangle between two corners.
const rectangle = ([x0, y0], [x1, y1]) => ({
  x: Math.min(x0, x1),
  y: Math.min(y0, y1),
  width: Math.abs(x1 - x0),
  height: Math.abs(y1 - y0),
});
