"use strict";
// Figures as SVG, from a part of Plotly's JSON: lines, points, bands and bars on linear, log and category axes, lines and boxes across.
// The style sheet colours them, so that dark mode and paper need no second set.

const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"]; // of the engines: --s0 and on
const DASHES = { solid: "", dot: "2,3", dash: "8,4" };
const SVG = "http://www.w3.org/2000/svg";

function element(name, attributes, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) if (value !== undefined && value !== "") made.setAttribute(key, value);
  made.append(...children);
  return made;
}

const colour = (given) => (COLOURS.includes(given) ? `var(--s${COLOURS.indexOf(given)})` : given || "var(--axis)");

// The outline of a symbol around 0, 0.
function symbol(name, r) {
  const kind = name.replace("-open", "").replace("-thin", "");
  const cross = `M0 ${-r}V${r}M${-r} 0H${r}`, x = `M${-r} ${-r}L${r} ${r}M${r} ${-r}L${-r} ${r}`;
  const paths = {
    square: `M${-r} ${-r}H${r}V${r}H${-r}Z`, diamond: `M0 ${-1.3 * r}L${1.3 * r} 0L0 ${1.3 * r}L${-1.3 * r} 0Z`,
    "triangle-up": `M0 ${-1.2 * r}L${1.2 * r} ${r}H${-1.2 * r}Z`, x, cross, asterisk: cross + x, "line-ns": `M0 ${-r}V${r}`,
  };
  return paths[kind] || `M${-r} 0a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`;
}

let clips = 0;

// Draw a figure into a box, and again when the box changes its size.
//   traces: those of the figure with their values in place of "driver".
// Returns what the page does with it: `reset` (the zoom), `show` (name of a series, whether it is seen) and `fit` (width, height: for paper; none: the box's own).
function plot(box, { data, layout }) {
  const hidden = new Set(), floor = layout.meta && layout.meta.floor, clip = `clip-${clips++}`;
  const across = (layout.hovermode || "").startsWith("y") ? "y" : "x"; // along which samples lie
  const readout = document.createElement("div");
  readout.className = "readout";
  readout.hidden = true;
  let view = null, size = null, frame, pointed = null, ends;

  const seen = () => data.filter((trace) => !hidden.has(trace.meta));
  const named = () => seen().filter((trace) => trace.name && trace.hoverinfo !== "skip" && trace.type !== "bar");

  function draw() {
    const [width, height] = size || [box.clientWidth, box.clientHeight];
    if (!width) return;
    pointed = null;
    readout.hidden = true;
    ends = stacked();
    const drawnValues = (axis) => seen().flatMap((trace) => (ends.get(trace) || {})[axis] || trace[axis]);
    const values = (axis) => drawnValues(axis).filter((value) => value !== null && value !== undefined && !(floor && axis === "y" && value === 0));
    // bars stand on zero
    const sides = Object.fromEntries(["x", "y"].map((axis) => {
      const bars = seen().some((trace) => trace.type === "bar" && (trace.orientation === "h") === (axis === "x"));
      return [axis, bars ? { rangemode: "tozero", ...layout[`${axis}axis`] } : layout[`${axis}axis`]];
    }));
    const rows = Math.max(2, Math.floor((height - 60) / (isCategory(sides.y, values("y")) ? 16 : 42)));
    const labels = scaled(sides.y, values("y"), 1, 0, rows, view && view.y).ticks.map(([, text]) => text);
    const left = 32 + Math.min(0.5 * width, longest(labels)), slanted = isCategory(sides.x, values("x"));
    const bottom = slanted ? 14 + Math.min(90, 0.55 * longest([...new Set(values("x"))])) : 42;
    frame = { left, right: width - 14, top: 12, bottom: height - bottom, width, height };
    const columns = Math.max(2, Math.floor((frame.right - left) / (slanted ? 40 : 72)));
    frame.x = scaled(sides.x, values("x"), left, frame.right, columns, view && view.x);
    frame.y = scaled(sides.y, values("y"), frame.bottom, frame.top, rows, view && view.y);
    const inside = element("g", { "clip-path": `url(#${clip})` }, ...shapes(), ...seen().flatMap(drawn));
    const svg = element("svg", { viewBox: `0 0 ${width} ${height}`, width, height, "aria-hidden": "true" },
      element("clipPath", { id: clip }, element("rect", { x: left, y: frame.top, width: frame.right - left, height: frame.bottom - frame.top })),
      ...grid(sides, slanted), inside, element("g", { class: "pointer" }));
    box.replaceChildren(svg, readout);
  }

  // Where bars end that stand on others, by trace.
  function stacked() {
    const found = new Map(), sums = new Map();
    if (layout.barmode !== "stack") return found;
    for (const trace of seen()) {
      const [along, up] = trace.orientation === "h" ? ["y", "x"] : ["x", "y"];
      found.set(trace, { [up]: trace[along].map((at, k) => sums.set(at, (sums.get(at) || 0) + (trace[up][k] || 0)).get(at)) });
    }
    return found;
  }

  function longest(texts) {
    const pen = document.createElement("canvas").getContext("2d");
    pen.font = `12px ${getComputedStyle(box).fontFamily}`;
    return texts.reduce((most, text) => Math.max(most, pen.measureText(text).width), 0);
  }

  function grid(sides, slanted) {
    const { left, right, top, bottom, width, height, x, y } = frame, made = [];
    const zero = (side, at) => (at === 0 && side.zeroline !== false ? "zero" : "grid");
    for (const [at, text] of x.ticks) {
      const place = x.place(at).toFixed(1);
      made.push(element("path", { class: zero(sides.x, at), d: `M${place} ${top}V${bottom}` }));
      made.push(element("text", slanted ? { transform: `translate(${place} ${bottom + 12})rotate(-30)`, "text-anchor": "end" } : { x: place, y: bottom + 16, "text-anchor": "middle" }, text));
    }
    for (const [at, text] of y.ticks) {
      const place = y.place(at).toFixed(1);
      made.push(element("path", { class: zero(sides.y, at), d: `M${left} ${place}H${right}` }));
      made.push(element("text", { x: left - 6, y: +place + 4, "text-anchor": "end" }, text));
    }
    const title = (side) => (side.title && side.title.text) || "";
    made.push(element("text", { class: "title", x: (left + right) / 2, y: height - 6, "text-anchor": "middle" }, title(sides.x)));
    made.push(element("text", { class: "title", transform: `translate(13 ${(top + bottom) / 2})rotate(-90)`, "text-anchor": "middle" }, title(sides.y)));
    return made;
  }

  // Boxes and lines across the whole figure, or between values.
  function shapes() {
    return (layout.shapes || []).map((shape) => {
      const end = (axis, k) => {
        const value = shape[`${axis}${k}`], whole = shape[`${axis}ref`] === "paper";
        return whole ? [[frame.left, frame.right], [frame.bottom, frame.top]][axis === "x" ? 0 : 1][value] : frame[axis].place(value);
      };
      const [x0, x1, y0, y1] = [end("x", 0), end("x", 1), end("y", 0), end("y", 1)];
      if (shape.type === "rect") {
        return element("rect", { x: Math.min(x0, x1), y: Math.min(y0, y1), width: Math.abs(x1 - x0), height: Math.abs(y1 - y0), fill: shape.fillcolor });
      }
      return element("path", { class: "limit", d: `M${x0} ${y0}L${x1} ${y1}`, ...stroke(shape.line) });
    });
  }

  const stroke = (line = {}) => ({ style: `stroke: ${colour(line.color)}`, "stroke-width": line.width, "stroke-dasharray": line.dash in DASHES ? DASHES[line.dash] : line.dash });

  // Where a sample is, or null: zero has no place on a log axis, and is marked on the floor.
  function place(trace, k, grounded = false) {
    const x = trace.x[k], y = floor && trace.y[k] === 0 ? (grounded ? floor : null) : trace.y[k];
    if (x === null || y === null || x === undefined || y === undefined) return null;
    const at = [frame.x.place(x), frame.y.place(y)];
    return at.every(Number.isFinite) ? at : null;
  }

  function drawn(trace) {
    if (trace.type === "bar") return bars(trace);
    if (trace.type !== "scatter") throw new Error(`figures have no traces of type ${trace.type}`);
    const made = [], places = trace.x.map((_, k) => place(trace, k)), known = { "data-series": trace.meta };
    const lines = (trace.mode || "lines").includes("lines");
    const path = places.map((at, k) => (at ? `${k && places[k - 1] ? "L" : "M"}${at[0].toFixed(1)} ${at[1].toFixed(1)}` : "")).join("");
    if (trace.fill) made.push(element("path", { class: "band", d: path && `${path}Z`, style: `fill: ${trace.fillcolor}` }));
    else if (lines) made.push(element("path", { ...known, class: "curve", d: path, ...stroke(trace.line) }));
    if (floor) made.push(element("path", { ...known, class: "zeros", d: trace.y.flatMap((y, k) => (y === 0 ? [place(trace, k, true)] : [])).map(([x, y]) => `M${x.toFixed(1)} ${y - 4}v8`).join(""), ...stroke({ color: trace.line && trace.line.color, width: 1.2 }) }));
    const marker = trace.marker || {}, stride = Math.ceil(places.length / (marker.maxdisplayed || Infinity)) || 1;
    if ((trace.mode || "").includes("markers") || (lines && !trace.fill && places.some((at, k) => at && !places[k - 1] && !places[k + 1]))) {
      const mark = symbol(marker.symbol || "circle-open", (marker.size || 6) / 2), alone = !(trace.mode || "").includes("markers");
      places.forEach((at, k) => {
        if (!at || (alone ? places[k - 1] || places[k + 1] : k % stride)) return;
        made.push(element("path", { ...known, class: "mark", d: mark, transform: `translate(${at[0].toFixed(1)} ${at[1].toFixed(1)})`, ...stroke({ color: marker.color || (trace.line || {}).color, width: (marker.line || {}).width || 1.2 }) }));
      });
    }
    return made;
  }

  function bars(trace) {
    const flat = trace.orientation === "h", [along, up] = flat ? ["y", "x"] : ["x", "y"];
    const steps = frame[along].width ? 0 : Math.min(...trace[along].slice(1).map((value, k) => Math.abs(value - trace[along][k])), Infinity);
    return trace[along].flatMap((at, k) => {
      if (trace[up][k] === null) return [];
      const middle = frame[along].place(at), width = (trace.width && (trace.width[k] || trace.width)) || steps;
      const half = frame[along].width ? 0.36 * frame[along].width : width < Infinity ? 0.47 * Math.abs(frame[along].place(at + width) - middle) : 8;
      const end = ends.has(trace) ? ends.get(trace)[up][k] : trace[up][k], base = ends.has(trace) ? end - trace[up][k] : 0;
      const [from, to] = [base, end].map(frame[up].place).sort((a, b) => a - b);
      const size = flat ? { x: from, y: middle - half, width: to - from, height: 2 * half } : { x: middle - half, y: from, width: 2 * half, height: to - from };
      return [element("rect", { class: "bar", "data-series": trace.meta, ...size, style: `fill: ${colour((trace.marker || {}).color)}` }, element("title", {}, `${trace.name ? `${trace.name}, ` : ""}${shown(at)}: ${shown(trace[up][k], ".3g")}${unitOf(layout[`${up}axis`])}`))];
    });
  }

  // The values of all curves at the sample next to a place; in diagrams of points, the point next to it.
  function point(px, py) {
    const near = named().flatMap((trace) => trace.x.map((_, k) => [trace, k, place(trace, k, true)]).filter(([, , at]) => at));
    const closest = layout.hovermode === "closest", far = ([, , [x, y]]) => (closest ? Math.hypot(x - px, y - py) : Math.abs(across === "x" ? x - px : y - py));
    const best = near.reduce((least, each) => (far(each) < far(least) ? each : least), near[0]);
    if (!best || far(best) > 60) return clear();
    const value = best[0][across][best[1]];
    pointed = best;
    tell(best[2], closest ? [best] : near.filter(([trace, k]) => trace[across][k] === value), closest ? "" : shown(value, layout[`${across}axis`].hoverformat || ".6g") + (typeof value === "number" ? unitOf(layout[`${across}axis`]) : ""));
  }

  function tell([x, y], rows, head) {
    const marks = rows.map(([, , at]) => element("circle", { cx: at[0], cy: at[1], r: 3 }));
    const guide = !head ? "" : across === "x" ? `M${x} ${frame.top}V${frame.bottom}` : `M${frame.left} ${y}H${frame.right}`;
    box.querySelector(".pointer").replaceChildren(element("path", { d: guide }), ...marks);
    const up = across === "x" ? "y" : "x", side = layout[`${up}axis`];
    const line = (text, className) => Object.assign(document.createElement("div"), { textContent: text, className });
    readout.replaceChildren(...(head ? [line(head, "head")] : []), ...rows.map(([trace, k]) => {
      const detail = trace.text ? `${trace.text[k]}: ${shown(trace.x[k], ".3g")}${unitOf(layout.xaxis)}, ${shown(trace.y[k], ".3g")}${unitOf(layout.yaxis)}` : `${shown(trace[up][k], side.hoverformat || ".4g")}${unitOf(side)}`;
      const row = line("", "value"), sign = document.createElement("span");
      sign.style.background = colour((trace.line || {}).color);
      row.append(sign, `${trace.name} ${detail}`);
      return row;
    }));
    readout.hidden = false;
    const wide = readout.offsetWidth, right = x + 14 + wide > frame.width;
    readout.style.left = `${Math.max(0, right ? x - wide - 14 : x + 14)}px`;
    readout.style.top = `${Math.max(0, Math.min(y - 20, frame.height - readout.offsetHeight))}px`;
  }

  function clear() {
    pointed = null;
    readout.hidden = true;
    const layer = box.querySelector(".pointer");
    if (layer) layer.replaceChildren();
  }

  // The sample before or after the one pointed at.
  function step(by) {
    const trace = pointed ? pointed[0] : named()[0];
    for (let k = pointed ? pointed[1] + by : by > 0 ? 0 : trace ? trace.x.length - 1 : 0; trace && k >= 0 && k < trace.x.length; k += by) {
      const at = place(trace, k, true);
      if (at) return point(...at);
    }
  }

  function reset() {
    view = null;
    delete box.dataset.zoomed;
    draw();
  }

  // What a box was drawn around fills the figure; a flat or a narrow one enlarges one axis alone.
  function enlarge([x0, y0], [x1, y1]) {
    const wide = Math.abs(x1 - x0) > 12 && frame.x.back, high = Math.abs(y1 - y0) > 12 && frame.y.back;
    if (!wide && !high) return;
    const sorted = (axis, a, b) => [frame[axis].back(a), frame[axis].back(b)].sort((one, other) => one - other);
    view = { x: wide ? sorted("x", x0, x1) : view && view.x, y: high ? sorted("y", y0, y1) : view && view.y };
    box.dataset.zoomed = "";
    draw();
  }

  let start = null;
  const at = (event) => {
    const { left, top } = box.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  };
  box.addEventListener("pointermove", (event) => {
    if (!frame) return;
    const [x, y] = at(event);
    if (!start) return point(x, y);
    clear();
    const layer = box.querySelector(".pointer"), [x0, y0] = start;
    layer.replaceChildren(element("rect", { class: "zoom", x: Math.min(x, x0), y: Math.min(y, y0), width: Math.abs(x - x0), height: Math.abs(y - y0) }));
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
  box.addEventListener("pointerleave", clear);
  box.addEventListener("blur", clear);
  box.addEventListener("dblclick", reset);
  const keys = { ArrowLeft: () => step(-1), ArrowRight: () => step(1), ArrowDown: () => step(-1), ArrowUp: () => step(1), Escape: () => (view ? reset() : clear()) };
  box.addEventListener("keydown", (event) => {
    if (!(event.key in keys) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    keys[event.key]();
  });
  new ResizeObserver(draw).observe(box);
  draw();
  return {
    reset,
    show(series, on) {
      if (!data.some((trace) => trace.meta === series)) return;
      if (on) hidden.delete(series);
      else hidden.add(series);
      draw();
    },
    fit(...given) {
      size = given.length ? given : null;
      draw();
    },
  };
}

// The figure of a box as an SVG file, with the colours that it has on the screen.
function standalone(box) {
  const svg = box.querySelector("svg"), copy = svg.cloneNode(true), originals = [...svg.querySelectorAll("*")];
  copy.setAttribute("xmlns", SVG);
  copy.querySelectorAll("*").forEach((each, k) => {
    const style = getComputedStyle(originals[k]);
    for (const name of ["stroke", "fill", "stroke-width", "font-size", "font-family"]) each.style.setProperty(name, style.getPropertyValue(name));
  });
  return copy.outerHTML;
}
