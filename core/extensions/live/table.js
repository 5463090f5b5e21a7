"use strict";
// The points of a table, to type in, and the history of its numbers.

const FINE = 1e4; // numbers are kept to so many parts of a unit

// A number as typed, with a decimal comma or point; NaN if it is none.
function typed(text) {
  const plain = text.trim().replace(",", ".").replace("−", "-");
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
}

// Of each point the one that mirrors it across the middle, or -1.
//   across: the axis of the file from side to side.
function mirrors(points, across) {
  const size = Math.max(...points.flatMap(({ position }) => position.map(Math.abs)));
  const isSame = (a, b) => Math.abs(a - b) < 1e-6 * size;
  return points.map(({ position: here }) => {
    if (isSame(here[across], 0)) return -1;
    return points.findIndex(({ position }) =>
      position.every((value, i) => isSame(value, i === across ? -here[i] : here[i])),
    );
  });
}

// The design: the numbers of all points, with undo and redo.
//   across: the axis of the file from side to side; changed: called after each change.
function designOf(points, across, changed) {
  const copy = (rows) => rows.map((row) => row.slice());
  const start = points.map(({ position }) => position.slice());
  let rows = copy(start);
  let before = [];
  let after = [];
  const others = mirrors(points, across);
  const same = (a, b) => a.every((row, k) => row.every((value, i) => value === b[k][i]));

  function go(from, to) {
    if (!from.length) return;
    to.push(copy(rows));
    rows = from.pop();
    changed();
  }
  return {
    start,
    locked: [false, false, false], // whether x, y and z stay
    hasSides: others.some((k) => k >= 0),
    isSymmetric: true, // whether a point takes the one that mirrors it along
    rows: () => rows,
    can: () => [before.length > 0, after.length > 0],
    // Begin a gesture: everything up to the next one is undone together.
    begin() {
      if (before.length && same(before.at(-1), rows)) return;
      before.push(copy(rows));
      after = [];
    },
    set(k, position) {
      rows[k] = position.map((value) => Math.round(value * FINE) / FINE);
      const other = this.isSymmetric ? others[k] : -1;
      if (other >= 0) rows[other] = rows[k].map((value, i) => (i === across ? -value : value));
      changed();
    },
    all(next) {
      this.begin();
      rows = copy(next);
      changed();
    },
    undo() {
      while (before.length && same(before.at(-1), rows)) before.pop();
      go(before, after);
    },
    redo: () => go(after, before),
  };
}

// The table of the points: typed numbers and arrow keys go to the design.
//   choose: called with the point that has the focus; refuse: with the point, axis and text of
//   what is no number.
// Returns `show` (the numbers), `mark` (the point that a message is about) and `chosen`.
function pointTable(table, points, unit, design, { choose, refuse }) {
  const text = (value) => String(value);
  const inputs = points.map(({ name }, k) =>
    ["x", "y", "z"].map((axis, i) => {
      const input = document.createElement("input");
      Object.assign(input, { type: "text", inputMode: "decimal", autocomplete: "off" });
      input.setAttribute("aria-label", `${name} ${axis} [${unit}]`);
      input.dataset.point = name;
      input.dataset.axis = axis;
      input.addEventListener("focus", () => choose(k));
      input.addEventListener("change", () => take(input, k, i));
      input.addEventListener("keydown", (event) => step(event, k, i));
      return input;
    }),
  );

  function take(input, k, i) {
    const value = typed(input.value);
    if (!Number.isFinite(value)) {
      refuse({ point: points[k].name, axis: "xyz"[i], text: input.value });
      return show();
    }
    put(k, i, value);
  }
  function put(k, i, value) {
    design.begin();
    design.set(k, design.rows()[k].map((old, j) => (j === i ? value : old)));
  }
  function step(event, k, i) {
    const by = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (event.key === "Enter") {
      const below = inputs[Math.min(k + 1, inputs.length - 1)][i];
      below.focus();
      below.select();
    }
    if (!by || design.locked[i]) return;
    event.preventDefault();
    const value = typed(event.target.value);
    const from = Number.isFinite(value) ? value : design.rows()[k][i];
    put(k, i, from + by * (event.shiftKey ? 10 : event.altKey ? 0.1 : 1));
  }
  // A column can be locked against keys, typing and dragging.
  table.querySelectorAll("thead .number").forEach((head, i) => {
    const lock = Object.assign(document.createElement("input"), { type: "checkbox" });
    const text = `lock ${head.textContent} of all points`;
    lock.setAttribute("aria-label", text);
    lock.title = text;
    lock.addEventListener("change", () => {
      design.locked[i] = lock.checked;
      inputs.forEach((row) => (row[i].readOnly = lock.checked));
    });
    head.append(" ", lock);
  });
  if (design.hasSides) {
    const label = document.createElement("label");
    const both = Object.assign(document.createElement("input"), { type: "checkbox" });
    both.checked = true;
    both.addEventListener("change", () => (design.isSymmetric = both.checked));
    label.append(both, " both sides: the mirrored point moves too");
    table.querySelector("caption").append(label);
  }
  const body = table.querySelector("tbody");
  const rows = points.map(({ name, roles }, k) => {
    const head = Object.assign(document.createElement("th"), { scope: "row", textContent: name });
    if (!roles.length) head.append(smallText("not used"));
    const cells = inputs[k].map((input) => {
      const cell = Object.assign(document.createElement("td"), { className: "number" });
      cell.append(input);
      return cell;
    });
    const row = document.createElement("tr");
    row.append(head, ...cells);
    return row;
  });
  body.replaceChildren(...rows);

  function show() {
    design.rows().forEach((row, k) =>
      row.forEach((value, i) => {
        inputs[k][i].value = text(value);
        inputs[k][i].classList.toggle("changed", value !== design.start[k][i]);
      }),
    );
  }
  function mark(name) {
    rows.forEach((row, k) => row.classList.toggle("wrong", points[k].name === name));
  }
  function chosen(at) {
    rows.forEach((row, k) => row.classList.toggle("chosen", k === at));
  }
  return { show, mark, chosen };
}

function smallText(text) {
  return Object.assign(document.createElement("small"), { textContent: text, className: "quiet" });
}
