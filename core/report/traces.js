"use strict";
// Traces of Plotly's JSON as SVG: lines, points, bands and bars.

const has = (trace, part) => (trace.mode || "").includes(part);
const isLine = (trace) => !trace.mode || has(trace, "lines");
const isDiagram = (layout) => layout.hovermode === "closest"; // of points, not of curves

// Where a sample is [px], or null: zero has no place on a log axis, and is marked on the floor.
function sampleAt(trace, k, frame, grounded = false) {
  const x = trace.x[k];
  const y = frame.floor && trace.y[k] === 0 ? (grounded ? frame.floor : null) : trace.y[k];
  if (x === null || y === null || x === undefined || y === undefined) return null;
  const at = [frame.x.place(x), frame.y.place(y)];
  return at.every(Number.isFinite) ? at : null;
}

// The elements of a trace in a frame.
function drawn(trace, frame) {
  if (trace.type === "bar") return bars(trace, frame);
  if (trace.type !== "scatter") throw new Error(`figures have no traces of type ${trace.type}`);
  const points = isDiagram(frame.layout);
  const places = trace.x.map((_, k) => sampleAt(trace, k, frame, points));
  const made = curve(trace, places);
  if (frame.floor && !points) made.push(zeros(trace, frame));
  return [...made, ...marks(trace, places)];
}

function curve(trace, places) {
  const command = (k) => (k && places[k - 1] ? "L" : "M");
  const path = places.map((at, k) => (at ? command(k) + pixels(at) : "")).join("");
  if (trace.fill) {
    const style = `fill: ${trace.fillcolor}`;
    return [svgElement("path", { class: "band", d: path && `${path}Z`, style })];
  }
  if (!isLine(trace)) return [];
  const known = { "data-series": trace.meta, class: "curve" };
  return [svgElement("path", { ...known, d: path, ...stroke(trace.line) })];
}

// Ticks on the floor at values of exactly zero.
function zeros(trace, frame) {
  const places = trace.y.flatMap((y, k) => (y === 0 ? [sampleAt(trace, k, frame, true)] : []));
  const d = places.map(([x, y]) => `M${x.toFixed(1)} ${y - 4}v8`).join("");
  const line = stroke({ color: trace.line && trace.line.color, width: 1.2 });
  return svgElement("path", { "data-series": trace.meta, class: "zeros", d, ...line });
}

// The markers of a trace; of a line, the samples without a neighbour.
function marks(trace, places) {
  const all = has(trace, "markers");
  if (!all && (trace.fill || !isLine(trace))) return [];
  const marker = trace.marker || {};
  const stride = Math.ceil(places.length / (marker.maxdisplayed || Infinity)) || 1;
  const isShown = (k) => (all ? k % stride === 0 : !places[k - 1] && !places[k + 1]);
  const known = { "data-series": trace.meta, class: "mark" };
  const d = symbol(marker.symbol || "circle-open", (marker.size || 6) / 2);
  const line = stroke({
    color: marker.color || (trace.line || {}).color,
    width: (marker.line || {}).width || 1.2,
  });
  return places.flatMap((at, k) => {
    if (!at || !isShown(k)) return [];
    return [svgElement("path", { ...known, d, transform: `translate(${pixels(at)})`, ...line })];
  });
}

function bars(trace, frame) {
  const heights = trace[barAxes(trace)[1]];
  return heights.flatMap((height, k) => (height === null ? [] : [bar(trace, k, frame)]));
}

function bar(trace, k, frame) {
  const [along, up] = barAxes(trace);
  const at = trace[along][k];
  const height = trace[up][k];
  const middle = frame[along].place(at);
  const half = halfWidth(trace, at, frame[along]);
  const end = frame.tops.has(trace) ? frame.tops.get(trace)[k] : height;
  const [from, to] = [end - height, end].map(frame[up].place).sort((a, b) => a - b);
  const corners =
    up === "x"
      ? { x: from, y: middle - half, width: to - from, height: 2 * half }
      : { x: middle - half, y: from, width: 2 * half, height: to - from };
  const name = trace.name ? `${trace.name}, ` : "";
  const value = `${shown(height, ".3g")}${unitOf(frame.layout[`${up}axis`])}`;
  return svgElement(
    "rect",
    {
      class: "bar",
      "data-series": trace.meta,
      ...corners,
      style: `fill: ${colour((trace.marker || {}).color)}`,
    },
    svgElement("title", {}, `${name}${shown(at)}: ${value}`),
  );
}

// Half of a bar's width [px].
function halfWidth(trace, at, scale) {
  if (scale.width) return 0.36 * scale.width;
  const width = barWidth(trace);
  return width ? 0.47 * Math.abs(scale.place(at + width) - scale.place(at)) : 8;
}
