"use strict";
// Goals picked in the curves, points ticked in the table, and a proposal that reaches the goals.

// The panel of proposals.
//   box: the panel; table: of the points; metres: size of their unit; outputs: of the case;
//   ask: called with bands and boxes; show: with a proposal to see as the ghost, or null for the
//   ghost before; take: with the points of one.
// Returns `goals` (show them), `told` (a proposal) and `refused` (none).
function tuning(box, table, { points, outputs, unit, metres }, design, state, { ask, show, take }) {
  const one = (selector) => box.querySelector(selector);
  const named = new Map(outputs.map((output) => [output.name, output]));
  let proposed = null;

  const ticks = points.map(({ name, roles }, k) => {
    const tick = Object.assign(document.createElement("input"), { type: "checkbox" });
    tick.setAttribute("aria-label", `${name} may move`);
    tick.dataset.tick = name;
    if (roles.length) table.querySelectorAll("tbody th")[k].prepend(tick);
    return tick;
  });
  one("[data-unit]").textContent = unit;
  box.hidden = false;

  const bands = () => [...state.limits].filter(([, ends]) => ends.every(Number.isFinite));

  function goals() {
    one("#goals").replaceChildren(
      ...bands().map(([name, ends]) => {
        const { label, shown_unit } = named.get(name);
        const text = `${label} ${ends.map((end) => shown(end, ".3g")).join(" to ")} ${shown_unit}`;
        const remove = Object.assign(document.createElement("button"), {
          type: "button",
          textContent: "remove",
        });
        remove.setAttribute("aria-label", `remove the goal of ${label}`);
        remove.onclick = () => {
          state.limits.delete(name);
          state.limited();
        };
        const row = document.createElement("li");
        row.append(`${text} `, remove);
        return row;
      }),
    );
  }

  // Which places may move, by how much [m].
  function boxes() {
    const most = typed(one("#most").value) * metres;
    const free = [0, 1, 2].filter((i) => !design.locked[i]);
    const places = points.flatMap(({ name }, k) =>
      ticks[k].checked ? free.map((i) => [`${name} ${"xyz"[i]}`, most]) : [],
    );
    return Object.fromEntries(places);
  }

  function end(text) {
    proposed = null;
    one("#proposal").textContent = text;
    one("#decide").hidden = true;
    one("#propose").disabled = false;
  }

  one("#pick").onclick = () => {
    state.picking = !state.picking;
    one("#pick").setAttribute("aria-pressed", state.picking);
    document.body.classList.toggle("picking", state.picking);
  };
  one("#propose").onclick = () => {
    if (proposed) show(null);
    const ends = ([name, range]) => [name, range.map((end) => end / named.get(name).scale)];
    end("looking for the least moves");
    one("#propose").disabled = true;
    ask({ bands: Object.fromEntries(bands().map(ends)), boxes: boxes() });
  };
  one("#take").onclick = () => {
    take(proposed.points);
    show(null);
    end("taken; undo brings the points before back");
  };
  one("#leave").onclick = () => {
    show(null);
    end("");
  };
  return {
    goals,
    told(message) {
      end(message.message);
      proposed = message;
      one("#decide").hidden = false;
      show(message);
    },
    refused() {
      if (one("#propose").disabled) end("");
    },
  };
}
