"use strict";
// Axes of figures: scales from values to pixels, their ticks, and numbers as text.

const SUPERSCRIPTS = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

// A number to some digits; a format such as ".9g" says how many.
function shown(value, format) {
  if (typeof value !== "number") return String(value);
  const digits = Number((/\d+/.exec(format || "") || [6])[0]);
  return String(Number(value.toPrecision(digits))).replace("-", "−").replace("e-", "e−").replace("e+", "e");
}

// The unit in the brackets of an axis' title; empty without one.
function unitOf(side) {
  const found = /\[([^\]]*)\]/.exec((side.title && side.title.text) || "");
  return found ? ` ${found[1]}` : "";
}

// 1, 2 or 5 times a power of ten, at least as large as a step.
function niceStep(step) {
  const power = 10 ** Math.floor(Math.log10(step));
  return power * [1, 2, 5, 10].find((each) => each * power >= 0.999 * step);
}

// The scale of one side of a figure.
//   side: the axis of the layout; values: all that is drawn, or the categories;
//   from, to: pixels of its ends; count: ticks that have room; view: two values that were zoomed to, or null.
function scaled(side, values, from, to, count, view) {
  if (isCategory(side, values)) return categories(side, values, from, to, count);
  const log = side.type === "log", ahead = log ? Math.log10 : (value) => value;
  const [low, high] = view ? view.map(ahead) : side.range || around(values.map(ahead).filter(Number.isFinite), side);
  const ends = side.autorange === "reversed" ? [to, from] : [from, to];
  const place = (value) => ends[0] + ((ahead(value) - low) / (high - low)) * (ends[1] - ends[0]);
  const back = (pixel) => {
    const value = low + ((pixel - ends[0]) / (ends[1] - ends[0])) * (high - low);
    return log ? 10 ** value : value;
  };
  const ticks = side.tickvals && !view ? side.tickvals.map((at, k) => [at, side.ticktext[k]]) : log ? logTicks(low, high, count) : linearTicks(low, high, count, side.dtick);
  return { place, back, ticks: ticks.filter(([at]) => ahead(at) >= low - 1e-9 * (high - low) && ahead(at) <= high + 1e-9 * (high - low)) };
}

const isCategory = (side, values) => side.type === "category" || values.some((value) => typeof value === "string");

// The range around values, with room at both ends.
function around(values, side) {
  if (side.rangemode === "tozero") values.push(0);
  const low = values.reduce((a, b) => Math.min(a, b), Infinity), high = values.reduce((a, b) => Math.max(a, b), -Infinity);
  if (low > high) return [0, 1];
  if (high - low <= 1e-14 * Math.max(Math.abs(low), Math.abs(high))) {
    const half = side.type === "log" ? 0.5 : 0.1 * Math.abs(low) || 1;
    return [low - half, high + half];
  }
  return [low - 0.05 * (high - low), high + 0.05 * (high - low)];
}

function linearTicks(low, high, count, given) {
  let step = given || niceStep((high - low) / count);
  while ((high - low) / step > 2 * count) step *= 2;
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k <= high / step + 1e-9 && found.length < 100; k++) {
    found.push([k * step, k ? shown(k * step, `.${Math.min(15, 2 + Math.ceil(Math.log10(Math.abs(k) + 1)))}g`) : "0"]);
  }
  return found;
}

// Powers of ten; within few decades also 2 and 5 times them.
function logTicks(low, high, count) {
  if (high - low < 0.3) return linearTicks(10 ** low, 10 ** high, count);
  const stride = Math.max(1, Math.ceil((high - low) / count)), found = [];
  for (let power = Math.ceil(low) - 1; power <= high; power++) {
    for (const factor of 3 * (high - low) <= count + 1 ? [1, 2, 5] : [1]) {
      if (power % stride) continue;
      const raised = `10${[...String(power)].map((sign) => SUPERSCRIPTS[sign]).join("")}`;
      found.push([factor * 10 ** power, Math.abs(power) < 4 ? shown(factor * 10 ** power) : factor === 1 ? raised : `${factor}·${raised}`]);
    }
  }
  return found;
}

// Places side by side; names that have no room get no tick.
function categories(side, values, first, last, count) {
  const [from, to] = side.autorange === "reversed" ? [last, first] : [first, last];
  const names = [...new Set(values)], width = (to - from) / Math.max(1, names.length);
  const stride = Math.ceil(names.length / Math.min(count, side.nticks || Infinity));
  return {
    place: (name) => from + (names.indexOf(name) + 0.5) * width,
    width: Math.abs(width),
    ticks: names.map((name) => [name, name]).filter((_, k) => (names.length - 1 - k) % stride === 0),
  };
}
