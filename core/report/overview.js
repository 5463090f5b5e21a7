"use strict";
// The filters of the overview: rows by words and outcome, columns by engine.

const isPressed = (button) => button.getAttribute("aria-pressed") === "true";
const press = (button, pressed) => button.setAttribute("aria-pressed", String(pressed));

// Rows by words and outcome, columns by engine. A case hidden in the overview is hidden below,
// too.
function overview() {
  const form = document.querySelector(".filters");
  if (!form) return;
  const search = form.querySelector("#search");
  const worst = form.querySelector("#worst-first");
  const rows = [...document.querySelectorAll(".overview tbody tr")];
  const body = rows[0].parentElement;
  const buttons = [...form.querySelectorAll("button[aria-pressed]")];
  const chosen = (kind) =>
    buttons
      .filter((each) => each.dataset[kind] && isPressed(each))
      .map((each) => each.dataset[kind]);

  function apply() {
    const engines = chosen("engine");
    for (const cell of document.querySelectorAll(".overview [data-engine]")) {
      cell.hidden = engines.length > 0 && !engines.includes(cell.dataset.engine);
    }
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const outcomes = chosen("outcome");
    for (const row of rows) {
      const there = markCells(row, outcomes);
      row.hidden = !(there && words.every((word) => row.dataset.words.includes(word)));
      document.getElementById(row.dataset.anchor).hidden = row.hidden;
    }
    const severity = (a, b) => b.dataset.severity - a.dataset.severity;
    body.append(...(isPressed(worst) ? rows.slice().sort(severity) : rows));
    const count = rows.filter((row) => !row.hidden).length;
    document.getElementById("none").hidden = count > 0;
    const shown = count === rows.length ? "" : `${count} of ${rows.length} cases`;
    document.getElementById("shown").textContent = shown;
  }

  function clear() {
    search.value = "";
    buttons.forEach((button) => press(button, false));
    apply();
  }

  for (const button of buttons) {
    button.addEventListener("click", () => {
      press(button, !isPressed(button));
      apply();
    });
  }
  search.addEventListener("input", apply);
  form.addEventListener("submit", (event) => event.preventDefault());
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Escape") clear();
    if (event.key === "/" && !event.target.closest("input, select, textarea")) {
      event.preventDefault();
      search.focus();
    }
  });
}

// Fade the cells of a row that have none of the outcomes; return whether a visible cell has one.
function markCells(row, outcomes) {
  let found = false;
  for (const cell of row.querySelectorAll("td[data-engine]")) {
    const own = (cell.dataset.outcome || "").split(" ");
    const there = !outcomes.length || own.some((each) => outcomes.includes(each));
    cell.classList.toggle("other", !there);
    found ||= there && !cell.hidden;
  }
  return found;
}
