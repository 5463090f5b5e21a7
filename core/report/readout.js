"use strict";
// The values of a figure at the pointer, or at the place that the arrow keys reached.

const REACH = 60; // from a pointer to the sample that it shows [px]

// The readout of a figure in a box.
//   current: returns the frame, and the traces that have values to show.
// Returns its element, and `point` (at a place), `step` (to the next sample) and `clear`.
function readout(box, layout, current) {
  const element = Object.assign(document.createElement("div"), { className: "readout" });
  const across = (layout.hovermode || "").startsWith("y") ? "y" : "x"; // along which samples lie
  const up = across === "x" ? "y" : "x";
  let pointed = null;
  clear();

  // The values of all curves at the sample next to a place; in diagrams of points, the point.
  function point(px, py) {
    const { frame, traces } = current();
    const samples = traces.flatMap((trace) =>
      trace.x.map((_, k) => ({ trace, k, at: sampleAt(trace, k, frame, true) })),
    );
    const near = samples.filter(({ at }) => at);
    const aside = ([x, y]) => Math.abs(across === "x" ? x - px : y - py);
    const far = ({ at }) => (isDiagram(layout) ? Math.hypot(at[0] - px, at[1] - py) : aside(at));
    const best = near.reduce((least, each) => (far(each) < far(least) ? each : least), near[0]);
    if (!best || far(best) > REACH) return clear();
    pointed = best;
    if (isDiagram(layout)) return show(frame, best.at, [best], "");
    const value = best.trace[across][best.k];
    const rows = near.filter(({ trace, k }) => trace[across][k] === value);
    show(frame, best.at, rows, headOf(value));
  }

  function headOf(value) {
    const side = layout[`${across}axis`];
    const unit = typeof value === "number" ? unitOf(side) : "";
    return shown(value, side.hoverformat || ".6g") + unit;
  }

  function show(frame, [x, y], rows, head) {
    const line =
      across === "x" ? `M${x} ${frame.top}V${frame.bottom}` : `M${frame.left} ${y}H${frame.right}`;
    const circles = rows.map(({ at }) => svgElement("circle", { cx: at[0], cy: at[1], r: 3 }));
    const guide = svgElement("path", { d: head && line });
    box.querySelector(".pointer").replaceChildren(guide, ...circles);
    const heads = head ? [division("head", head)] : [];
    element.replaceChildren(...heads, ...rows.map(rowOf));
    element.hidden = false;
    const width = element.offsetWidth;
    const beside = x + 14 + width > frame.width ? x - width - 14 : x + 14;
    element.style.left = `${Math.max(0, beside)}px`;
    element.style.top = `${Math.max(0, Math.min(y - 20, frame.height - element.offsetHeight))}px`;
  }

  function rowOf({ trace, k }) {
    const value = (axis, format) => shown(trace[axis][k], format) + unitOf(layout[`${axis}axis`]);
    const detail = trace.text
      ? `${trace.text[k]}: ${value("x", ".3g")}, ${value("y", ".3g")}`
      : value(up, layout[`${up}axis`].hoverformat || ".4g");
    const sign = document.createElement("span");
    sign.style.background = colour((trace.line || {}).color);
    return division("value", sign, `${trace.name} ${detail}`);
  }

  function division(className, ...children) {
    const made = Object.assign(document.createElement("div"), { className });
    made.append(...children);
    return made;
  }

  // The sample before or after the current one; without one, the first or the last.
  function step(by) {
    const { frame, traces } = current();
    const trace = pointed ? pointed.trace : traces[0];
    if (!trace || !frame) return;
    const count = trace.x.length;
    const first = by > 0 ? 0 : count - 1;
    for (let k = pointed ? pointed.k + by : first; k >= 0 && k < count; k += by) {
      const at = sampleAt(trace, k, frame, true);
      if (at) return point(...at);
    }
  }

  function clear() {
    pointed = null;
    element.hidden = true;
    const layer = box.querySelector(".pointer");
    if (layer) layer.replaceChildren();
  }

  return { element, point, step, clear };
}
