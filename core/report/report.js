"use strict";
(async () => {
  const hidden = new Map([...document.querySelectorAll("[data-case]")].map((section) => [section, new Set()]));
  overview();

  const trouble = (text) => Object.assign(document.getElementById("trouble"), { textContent: text, hidden: false });
  if (!window.DecompressionStream) return trouble("Figures and mechanisms need a browser of 2023 or later; all tables are here without it.");
  const { drivers, figures, scenes } = JSON.parse(await unpacked("report-data"));
  for (const button of document.querySelectorAll("[data-curves]")) {
    button.addEventListener("click", async () => save(JSON.parse(await unpacked("curves"))[button.dataset.curves], "text/csv", button.dataset.file));
  }
  const canvases = [...document.querySelectorAll("[data-scene]")].map((box) => mechanism(box, scenes[box.dataset.scene]));

  async function unpacked(id) {
    const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (sign) => sign.charCodeAt(0));
    const stream = new DecompressionStream("deflate"), input = stream.writable.getWriter();
    input.write(bytes);
    input.close();
    return new Response(stream.readable).text();
  }

  function save(text, type, name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type }));
    link.download = name;
    link.click();
    URL.revokeObjectURL(link.href);
  }

  const drawn = new Map();
  function draw(box) {
    if (drawn.has(box)) return;
    const section = box.closest("[data-case]"), { data, layout } = figures[box.dataset.figure], driver = drivers[section.dataset.case];
    // samples at the driver's values say "driver"
    const whole = data.map((trace) => ({ ...trace, x: trace.x === "driver" ? driver : trace.x, y: trace.y === "driver" ? driver : trace.y }));
    try {
      drawn.set(box, plot(box, { data: whole, layout }));
    } catch (error) {
      return trouble(`Figure ${box.dataset.figure} cannot be drawn: ${error.message}.`);
    }
    hidden.get(section).forEach((series) => drawn.get(box).show(series, false));
    box.dataset.drawn = "";
  }

  // Figures in or near view are drawn, so that a report of many cases opens as fast as one of few:
  // at once and when something unfolds; the observer, which a busy browser calls late, when the page scrolls.
  const MARGIN = 600, plots = [...document.querySelectorAll(".plot")];
  const near = (box) => {
    const { top, bottom, height } = box.getBoundingClientRect();
    return height > 0 && bottom > -MARGIN && top < innerHeight + MARGIN && !box.closest("details:not([open])");
  };
  const drawNear = () => plots.filter(near).forEach(draw);
  drawNear();
  document.addEventListener("toggle", drawNear, true);
  const watch = new IntersectionObserver((seen) => {
    for (const { isIntersecting, target } of seen) if (isIntersecting) draw(target);
  }, { rootMargin: `${MARGIN}px` });
  plots.forEach((box) => watch.observe(box));

  for (const button of document.querySelectorAll("[data-save]")) {
    button.addEventListener("click", () => save(standalone(button.closest("figure").querySelector(".plot")), "image/svg+xml", `${button.dataset.save}.svg`));
  }
  for (const button of document.querySelectorAll("[data-reset]")) {
    button.addEventListener("click", () => drawn.get(button.closest("figure").querySelector(".plot")).reset());
  }
  for (const button of document.querySelectorAll("[data-series][aria-pressed]")) {
    button.addEventListener("click", () => {
      const section = button.closest("[data-case]"), off = hidden.get(section), series = button.dataset.series;
      const show = off.delete(series);
      if (!show) off.add(series);
      button.setAttribute("aria-pressed", String(show));
      for (const box of section.querySelectorAll(".plot[data-drawn]")) drawn.get(box).show(series, show);
    });
  }

  // Paper is light and narrower than the screen, and sends no resize event. What the filters hide stays away.
  window.addEventListener("beforeprint", () => {
    document.documentElement.dataset.paper = "";
    for (const rest of document.querySelectorAll(".problems details")) rest.open = true;
    canvases.forEach((redraw) => redraw());
    for (const box of plots.filter((each) => !each.closest("[hidden], details:not([open])"))) {
      draw(box);
      if (drawn.has(box)) drawn.get(box).fit(330, 270);
    }
  });
  window.addEventListener("afterprint", () => {
    delete document.documentElement.dataset.paper;
    canvases.forEach((redraw) => redraw());
    drawn.forEach((figure) => figure.fit());
  });
  document.documentElement.dataset.ready = "";

  // Rows by words and outcome, columns by engine; a case that is not shown above is not shown below either.
  function overview() {
    const form = document.querySelector(".filters");
    if (!form) return;
    const search = form.querySelector("#search"), worst = form.querySelector("#worst-first");
    const rows = [...document.querySelectorAll(".overview tbody tr")], body = rows[0].parentElement;
    const buttons = [...form.querySelectorAll("button[aria-pressed]")];
    const pressed = (kind) => buttons.filter((each) => each.dataset[kind] && each.getAttribute("aria-pressed") === "true").map((each) => each.dataset[kind]);

    function apply() {
      const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
      const outcomes = pressed("outcome"), engines = pressed("engine");
      let count = 0;
      for (const cell of document.querySelectorAll(".overview [data-engine]")) {
        cell.hidden = engines.length > 0 && !engines.includes(cell.dataset.engine);
      }
      for (const row of rows) {
        let found = false;
        for (const cell of row.querySelectorAll("td[data-engine]")) {
          const there = outcomes.length ? (cell.dataset.outcome || "").split(" ").some((each) => outcomes.includes(each)) : true;
          cell.classList.toggle("other", !there);
          found ||= there && !cell.hidden;
        }
        row.hidden = !(found && words.every((word) => row.dataset.words.includes(word)));
        document.getElementById(row.dataset.anchor).hidden = row.hidden;
        count += !row.hidden;
      }
      const sorted = worst.getAttribute("aria-pressed") === "true";
      body.append(...(sorted ? rows.slice().sort((a, b) => b.dataset.severity - a.dataset.severity) : rows));
      document.getElementById("none").hidden = count > 0;
      document.getElementById("shown").textContent = count === rows.length ? "" : `${count} of ${rows.length} cases`;
    }
    function clear() {
      search.value = "";
      buttons.forEach((button) => button.setAttribute("aria-pressed", "false"));
      apply();
    }
    for (const button of buttons) {
      button.addEventListener("click", () => {
        button.setAttribute("aria-pressed", String(button.getAttribute("aria-pressed") !== "true"));
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
})();
