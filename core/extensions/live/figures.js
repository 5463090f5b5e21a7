"use strict";
// Curves of the outputs over the sweep, with a ghost and limits, and their key numbers.

const NOTHING = 1e-12; // round-off of lengths and angles [m, rad]

// The ranges of the driver's values without a solution, from the last sample with one.
function unreached(solved, driver) {
  const ranges = [];
  for (let k = 0; k < solved.length; k++) {
    if (solved[k]) continue;
    const from = Math.max(k - 1, 0);
    while (k < solved.length && !solved[k]) k++;
    ranges.push([driver[from], driver[Math.min(k, solved.length - 1)]]);
  }
  return ranges;
}

// The figures of a group of outputs.
//   axis: of the sweep; state: `answer`, `ghost`, and by output `limits` and `reference`; `fresh`
//   are the outputs of the last answer.
// Returns `group` (draw the outputs of a group) and `draw` (those in view, or all).
function figures(box, outputs, axis, state) {
  const driver = axis.values.map((value) => value * axis.scale);
  const [along, across] = axis.up ? ["y", "x"] : ["x", "y"];
  let drawn = [];

  function trace(output, curves, name, line) {
    const values = (curves[output.name] || []).map((v) => (v === null ? null : v * output.scale));
    const places = { [along]: driver, [across]: values };
    return { type: "scatter", mode: "lines", ...places, name, meta: name, line };
  }
  // The reference, and the band of its tolerance.
  function compared(output) {
    const { values, tolerance } = (state.reference || {})[output.name] || {};
    if (!values) return [];
    const known = values.flatMap((value, k) => (value === null ? [] : [[value, driver[k]]]));
    const side = (sign) =>
      known.map(([value, at]) => [(value + sign * tolerance) * output.scale, at]);
    const ring = [...side(1), ...side(-1).reverse()];
    const band = { [across]: ring.map(([value]) => value), [along]: ring.map(([, at]) => at) };
    const look = { fill: "toself", fillcolor: "rgba(128, 128, 128, 0.25)", hoverinfo: "skip" };
    const line = { width: 5, color: "rgba(128, 128, 128, 0.6)" };
    return [
      { type: "scatter", mode: "lines", ...band, ...look, meta: "band" },
      trace(output, { [output.name]: values }, "reference", line),
    ];
  }
  const traces = (output) => [
    ...compared(output),
    ...(state.ghost && state.ghost !== state.answer
      ? [trace(output, state.ghost.outputs, "ghost", { width: 2, dash: "dash", color: "#D55E00" })]
      : []),
    trace(output, state.answer.outputs, "design", { width: 2, color: "#0072B2" }),
  ];
  function bands({ name }) {
    const [low, high] = state.limits.get(name) || [];
    const whole = { [`${along}0`]: 0, [`${along}1`]: 1, [`${along}ref`]: "paper", type: "line" };
    const ends = [low, high].filter(Number.isFinite);
    const inside = { ...whole, type: "rect", fillcolor: "rgba(0, 158, 115, 0.1)" };
    const band = { ...inside, [`${across}0`]: low, [`${across}1`]: high };
    const lost = unreached(state.answer.solved, driver).map(([from, to]) => ({
      type: "rect",
      [`${along}0`]: from,
      [`${along}1`]: to,
      [`${across}0`]: 0,
      [`${across}1`]: 1,
      [`${across}ref`]: "paper",
      fillcolor: "rgba(213, 94, 0, 0.16)",
    }));
    const lines = ends.map((value) => ({
      ...whole,
      [`${across}0`]: value,
      [`${across}1`]: value,
      line: { color: "#009E73", width: 2, dash: "dot" },
    }));
    return [...lost, ...(ends.length === 2 ? [band] : []), ...lines];
  }
  function start(output) {
    const figure = document.createElement("figure");
    const plotBox = document.createElement("div");
    Object.assign(plotBox, { className: "plot", tabIndex: 0 });
    plotBox.setAttribute("role", "img");
    const label = `${output.label} over ${axis.title}; arrow keys read values`;
    plotBox.setAttribute("aria-label", label);
    plotBox.dataset.output = output.name;
    figure.append(plotBox);
    box.append(figure);
    const title = output.shown_unit ? `${output.label} [${output.shown_unit}]` : output.label;
    const side = { title: { text: axis.title } };
    if (axis.up < 0) side.autorange = "reversed";
    const layout = {
      [`${along}axis`]: side,
      [`${across}axis`]: { title: { text: title }, hoverformat: ".6g" },
      hovermode: `${along} unified`,
      shapes: bands(output),
    };
    const made = plot(plotBox, { data: traces(output), layout });
    listenForGoal(plotBox, output.name, made.at);
    return { output, plotBox, figure: made };
  }
  // While goals are picked, a drag across a figure sets the limits of its output.
  function listenForGoal(plotBox, name, at) {
    let from = null;
    const valueOf = (event) => {
      const { left, top } = plotBox.getBoundingClientRect();
      return at([event.clientX - left, event.clientY - top])[across];
    };
    function take(event) {
      if (from === null) return;
      event.stopImmediatePropagation();
      const ends = [from, valueOf(event)].map((value) => Number(value.toPrecision(3)));
      state.limits.set(name, ends.sort((a, b) => a - b));
      state.limited();
    }
    const before = (kind, react) => plotBox.addEventListener(kind, react, true);
    before("pointerdown", (event) => {
      if (!state.picking || event.button) return;
      event.stopImmediatePropagation();
      plotBox.setPointerCapture(event.pointerId);
      from = valueOf(event);
    });
    before("pointermove", take);
    before("pointerup", (event) => {
      take(event);
      from = null;
    });
  }
  return {
    group(name) {
      box.replaceChildren();
      drawn = outputs.filter(({ group }) => group === name).map(start);
    },
    // Draw the figures in view, or all.
    draw(all = false) {
      const isSeen = ({ plotBox }) => {
        const { top, bottom } = plotBox.getBoundingClientRect();
        return bottom > 0 && top < innerHeight;
      };
      for (const { output, plotBox, figure } of drawn.filter((each) => all || isSeen(each))) {
        plotBox.classList.toggle("late", !state.fresh.has(output.name));
        figure.change(traces(output), bands(output));
      }
    },
  };
}

// The key numbers: outputs at some poses, such as the ends of the travel and design, with their
// gradients, and limits.
//   columns: of each pose its word, and the value of an output there.
// Returns `show`.
function keyNumbers(table, outputs, columns, state) {
  const first = outputs.some(({ group }) => group === "outputs") ? "outputs" : "coordinates";
  const isPose = columns.length === 1;
  const main = outputs.filter(({ group }) => group === first || isPose);
  const named = new Map(outputs.map((output) => [output.name, output]));
  const slope = ({ name }) => named.get(`${name}.per_travel`);
  const cell = (kind, text, className = "") =>
    Object.assign(document.createElement(kind), { textContent: text, className });
  const heads = ["output", ...columns.map(({ word }) => word), "low", "high"];
  const headRow = document.createElement("tr");
  headRow.append(
    ...heads.map((text, k) =>
      Object.assign(cell("th", text, k ? "number" : ""), { scope: "col" }),
    ),
  );
  table.querySelector("thead").replaceChildren(headRow);
  const rows = main.map((output) => {
    const row = document.createElement("tr");
    const head = Object.assign(cell("th", output.label), { scope: "row" });
    if (output.shown_unit) head.append(smallText(output.shown_unit));
    const cells = columns.map(() => cell("td", "", "number"));
    const inputs = ["low", "high"].map((end, k) => {
      const input = Object.assign(document.createElement("input"), { autocomplete: "off" });
      input.setAttribute("aria-label", `${end} limit of ${output.label} [${output.shown_unit}]`);
      input.addEventListener("change", () => {
        const both = state.limits.get(output.name) || [NaN, NaN];
        both[k] = typed(input.value);
        state.limits.set(output.name, both);
        state.limited();
      });
      return input;
    });
    const ends = inputs.map((input) => {
      const holder = cell("td", "", "number");
      holder.append(input);
      return holder;
    });
    row.append(head, ...cells, ...ends);
    row.dataset.output = output.name;
    return { output, cells, inputs, row };
  });
  table.querySelector("tbody").replaceChildren(...rows.map(({ row }) => row));

  function show() {
    for (const { output, cells, inputs } of rows) {
      const [low, high] = state.limits.get(output.name) || [];
      [low, high].forEach((end, k) => {
        inputs[k].value = Number.isFinite(end) ? shown(end, ".6g") : "";
      });
      const rate = slope(output);
      columns.forEach(({ valueOf }, k) => {
        const value = valueOf(output.name);
        const known = typeof value === "number";
        const exact = Math.abs(value) < NOTHING ? 0 : value;
        const scaled = known ? exact * output.scale : NaN;
        cells[k].textContent = known ? shown(scaled, ".4g") : "–";
        cells[k].dataset.value = known ? String(value) : "";
        cells[k].classList.toggle("over", scaled < low || scaled > high);
        cells[k].classList.toggle("late", !state.fresh.has(output.name));
        const each = rate && valueOf(rate.name);
        const gradient = typeof each === "number" ? shown(each * rate.scale, ".4g") : "";
        if (gradient) cells[k].append(smallText(`${gradient} ${rate.shown_unit}`));
      });
    }
  }
  return { show };
}

// Histograms of an output over the variants, at the key samples.
function showSpread(box, { bins, variants, failed }, output, words, limits) {
  const lost = failed ? `; ${failed} do not reach all samples` : "";
  box.querySelector("p").textContent = `${output.label} of ${variants} variants${lost}`;
  const title = (word) => `${word} [${output.shown_unit || "1"}]`;
  const made = bins.flatMap((each, k) => {
    if (!each) return [];
    const edges = each.edges.map((edge) => edge * output.scale);
    const middles = edges.slice(1).map((edge, i) => (edge + edges[i]) / 2);
    const plotBox = Object.assign(document.createElement("div"), { className: "plot" });
    plotBox.setAttribute("role", "img");
    plotBox.setAttribute("aria-label", `Variants by ${output.label} at ${words[k]}`);
    const ends = (limits || []).filter(Number.isFinite);
    const shapes = ends.map((x) => ({
      ...{ type: "line", x0: x, x1: x, y0: 0, y1: 1, yref: "paper" },
      line: { color: "#009E73", width: 2, dash: "dot" },
    }));
    const layout = {
      ...{ xaxis: { title: { text: title(words[k]) } }, yaxis: { title: { text: "variants" } } },
      shapes,
    };
    const bars = { type: "bar", x: middles, y: each.counts, marker: { color: "#0072B2" } };
    return [[plotBox, { data: [{ ...bars, hoverinfo: "skip" }], layout }]];
  });
  box.querySelector(".figures").replaceChildren(...made.map(([plotBox]) => plotBox));
  for (const [plotBox, figure] of made) plot(plotBox, figure);
}

// The numbers of the table that move an output most, with bars.
function showRanking(table, { samples, effects, output }, { scale, shown_unit }, unit, words) {
  const row = (kind, texts) => {
    const made = document.createElement("tr");
    made.append(
      ...texts.map((text, k) =>
        Object.assign(document.createElement(kind), {
          textContent: text,
          className: k ? "number" : "",
        }),
      ),
    );
    return made;
  };
  const perUnit = scale * unit.metres;
  const head = `${output} [${shown_unit || "1"}/${unit.name}]`;
  table.querySelector("thead").replaceChildren(row("th", [head, ...words]));
  const text = (slope) => (slope === null ? "–" : shown(slope * perUnit, ".3g"));
  const rows = effects
    .slice(0, 8)
    .map(({ point, axis, slopes }) => row("td", [`${point} ${axis}`, ...slopes.map(text)]));
  table.querySelector("tbody").replaceChildren(...rows);
}
