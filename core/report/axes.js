"use strict";
// Axes of figures: scales from values to pixels, their ticks, and numbers as text.

const SUPERSCRIPTS = { ..."⁰¹²³⁴⁵⁶⁷⁸⁹", "-": "⁻" };

// A number as text in a format such as ".9g".
function shown(value, format) {
  if (typeof value !== "number") return String(value);
  const digits = Number((/\d+/.exec(format || "") || [6])[0]);
  const text = String(Number(value.toPrecision(digits)));
  return text.replace("-", "−").replace("e-", "e−").replace("e+", "e");
}

const titleOf = (side) => (side.title && side.title.text) || "";

// The unit in the brackets of an axis' title; empty without one.
function unitOf(side) {
  const found = /\[([^\]]*)\]/.exec(titleOf(side));
  return found ? ` ${found[1]}` : "";
}

// 1, 2 or 5 times a power of ten, at least as large as a step.
function niceStep(step) {
  const power = 10 ** Math.floor(Math.log10(step));
  return power * [1, 2, 5, 10].find((each) => each * power >= 0.999 * step);
}

// The scale of one side of a figure.
//   side: the axis of the layout; values: all drawn values, or the categories;
//   from, to: pixels of its ends; count: largest number of ticks;
//   view: two values of the zoom, or null.
function scaled(side, values, from, to, count, view) {
  if (isCategory(side, values)) return categories(side, values, from, to, count);
  const log = side.type === "log";
  const ahead = log ? Math.log10 : (value) => value;
  const whole = () => side.range || around(values.map(ahead).filter(Number.isFinite), side);
  const [low, high] = view ? view.map(ahead) : whole();
  const [start, end] = side.autorange === "reversed" ? [to, from] : [from, to];
  const place = (value) => start + ((ahead(value) - low) / (high - low)) * (end - start);
  const back = (pixel) => {
    const value = low + ((pixel - start) / (end - start)) * (high - low);
    return log ? 10 ** value : value;
  };
  const margin = 1e-9 * (high - low);
  const inside = ([at]) => ahead(at) >= low - margin && ahead(at) <= high + margin;
  const ticks = ticksOf(side, low, high, count, view).filter(inside);
  return { place, back, ticks: apart(ticks, place) };
}

const isCategory = (side, values) =>
  side.type === "category" || values.some((value) => typeof value === "string");

// The range around values, with room at both ends.
function around(values, side) {
  if (side.rangemode === "tozero") values.push(0);
  const low = values.reduce((a, b) => Math.min(a, b), Infinity);
  const high = values.reduce((a, b) => Math.max(a, b), -Infinity);
  if (low > high) return [0, 1];
  if (high - low <= 1e-14 * Math.max(Math.abs(low), Math.abs(high))) {
    const half = side.type === "log" ? 0.5 : 0.1 * Math.abs(low) || 1;
    return [low - half, high + half];
  }
  return [low - 0.05 * (high - low), high + 0.05 * (high - low)];
}

// Ticks as values and texts; the axis' own unless the figure is zoomed.
function ticksOf(side, low, high, count, zoomed) {
  if (side.tickvals && !zoomed) return side.tickvals.map((at, k) => [at, side.ticktext[k]]);
  if (side.type === "log") return logTicks(low, high, count);
  return linearTicks(low, high, count, side.dtick);
}

// Ticks with room between them; the first tick stays.
function apart(ticks, place) {
  const kept = [];
  for (const tick of ticks) {
    if (!kept.length || Math.abs(place(tick[0]) - place(kept.at(-1)[0])) >= 13) kept.push(tick);
  }
  return kept;
}

function linearTicks(low, high, count, given) {
  let step = given || niceStep((0.75 * (high - low)) / count);
  while ((high - low) / step > 2 * count) step *= 2;
  // two ticks or one tell no scale
  const inside = () => Math.floor(high / step + 1e-9) - Math.ceil(low / step - 1e-9) + 1;
  while (!given && inside() < 3) step = niceStep(step / 2.5);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k <= high / step + 1e-9 && found.length < 100; k++) {
    const digits = Math.min(15, 2 + Math.ceil(Math.log10(Math.abs(k) + 1)));
    found.push([k * step, k ? shown(k * step, `.${digits}g`) : "0"]);
  }
  return found;
}

// Powers of ten; within few decades also 2 and 5 times them.
function logTicks(low, high, count) {
  if (high - low < 0.3) return linearTicks(10 ** low, 10 ** high, count);
  const stride = Math.max(1, Math.ceil((high - low) / count));
  const factors = 3 * (high - low) <= count + 1 ? [1, 2, 5] : [1];
  const found = [];
  for (let power = Math.ceil(low) - 1; power <= high; power++) {
    if (power % stride) continue;
    for (const factor of factors) found.push([factor * 10 ** power, powerText(factor, power)]);
  }
  return found;
}

function powerText(factor, power) {
  if (Math.abs(power) < 4) return shown(factor * 10 ** power);
  const raised = `10${[...String(power)].map((sign) => SUPERSCRIPTS[sign]).join("")}`;
  return factor === 1 ? raised : `${factor}·${raised}`;
}

// Places side by side; names without room get no tick.
function categories(side, values, first, last, count) {
  const [from, to] = side.autorange === "reversed" ? [last, first] : [first, last];
  const names = [...new Set(values)];
  const width = (to - from) / Math.max(1, names.length);
  const stride = Math.ceil(names.length / Math.min(count, side.nticks || Infinity));
  return {
    place: (name) => from + (names.indexOf(name) + 0.5) * width,
    width: Math.abs(width),
    ticks: names
      .map((name) => [name, name])
      .filter((_, k) => (names.length - 1 - k) % stride === 0),
  };
}
