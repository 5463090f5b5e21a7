"use strict";
(async () => {
  const config = { displaylogo: false, responsive: true, modeBarButtons: [["toImage", "resetScale2d"]] };
  const common = {
    margin: { l: 68, r: 12, t: 28, b: 48 }, showlegend: false, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { size: 12, family: getComputedStyle(document.body).fontFamily }, modebar: { bgcolor: "rgba(0,0,0,0)" }, hoverlabel: { font: { size: 12 }, namelength: -1 },
  };
  const axis = { gridcolor: "#ddd", zerolinecolor: "#aaa", automargin: true };
  const hidden = new Map([...document.querySelectorAll("[data-case]")].map((section) => [section, new Set()]));
  overview();

  if (!window.DecompressionStream) {
    const trouble = document.getElementById("trouble");
    trouble.textContent = "Figures and mechanisms need a browser of 2023 or later; all tables are here without it.";
    trouble.hidden = false;
    return;
  }
  const { drivers, figures, scenes } = JSON.parse(await unpacked("report-data"));
  for (const button of document.querySelectorAll("[data-curves]")) button.addEventListener("click", () => download(button));
  const canvases = [...document.querySelectorAll("[data-scene]")].map((box) => mechanism(box, scenes[box.dataset.scene]));
  const library = document.createElement("script");
  library.textContent = await unpacked("plotly");
  document.head.append(library);

  async function unpacked(id) {
    const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (sign) => sign.charCodeAt(0));
    const stream = new DecompressionStream("deflate"), input = stream.writable.getWriter();
    input.write(bytes);
    input.close();
    return new Response(stream.readable).text();
  }

  async function download(button) {
    const text = JSON.parse(await unpacked("curves"))[button.dataset.curves], link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
    link.download = button.dataset.file;
    link.click();
    URL.revokeObjectURL(link.href);
  }

  // Samples at the driver's values say "driver". Zero has no place on a log axis: it breaks the curve and is ticked at the floor.
  // What is pointed at is told by a third, unseen trace, which has every sample.
  function completed(trace, driver, floor, off) {
    const whole = { ...trace, visible: !off.has(trace.meta) };
    for (const side of ["x", "y"]) if (trace[side] === "driver") whole[side] = driver;
    if (floor === undefined || trace.mode === "markers") return [whole];
    const exact = trace.y.flatMap((value, k) => (value === 0 ? [k] : []));
    const curve = { ...whole, y: trace.y.map((value) => (value === 0 ? null : value)), hoverinfo: "skip", hovertemplate: undefined };
    const ticks = {
      ...whole, uid: `${trace.uid}-zeros`, mode: "markers", x: exact.map((k) => whole.x[k]), y: exact.map(() => floor), hoverinfo: "skip", hovertemplate: undefined,
      marker: { symbol: "line-ns-open", size: 7, color: trace.marker.color, line: { width: 1.2 } },
    };
    const told = {
      ...whole, uid: `${trace.uid}-told`, mode: "lines", opacity: 0, customdata: trace.y,
      y: trace.y.map((value) => (value === 0 ? floor : value)), hovertemplate: trace.hovertemplate || "%{customdata:.4~g}",
    };
    return exact.length ? [curve, ticks, told] : [curve, told];
  }

  // without a distance of its own, a title stands where long labels of ticks are
  function side(given) {
    return { ...axis, ...given, title: { standoff: 8, ...(given && given.title) } };
  }

  function draw(plot) {
    if (plot.dataset.drawn || plot.closest("[hidden]")) return;
    plot.dataset.drawn = "yes";
    const section = plot.closest("[data-case]");
    const { data, layout } = figures[plot.dataset.figure];
    const floor = layout.meta && layout.meta.floor;
    Plotly.newPlot(
      plot,
      data.flatMap((trace) => completed(trace, drivers[section.dataset.case], floor, hidden.get(section))),
      { ...common, ...layout, xaxis: side(layout.xaxis), yaxis: side(layout.yaxis) },
      config,
    );
  }

  // What is about to be seen is drawn, so that a report of many cases opens as fast as one of few.
  const plots = [...document.querySelectorAll(".plot")];
  const watch = new IntersectionObserver((seen) => {
    for (const { isIntersecting, target } of seen) if (isIntersecting) draw(target);
  }, { rootMargin: "600px" });
  plots.forEach((plot) => watch.observe(plot));

  for (const button of document.querySelectorAll("[data-series]")) {
    button.addEventListener("click", () => {
      const section = button.closest("[data-case]"), off = hidden.get(section), series = button.dataset.series;
      const show = off.delete(series);
      if (!show) off.add(series);
      button.setAttribute("aria-pressed", String(show));
      for (const plot of section.querySelectorAll(".plot[data-drawn]")) {
        const traces = plot.data.flatMap((trace, index) => (trace.meta === series ? [index] : []));
        if (traces.length) Plotly.restyle(plot, { visible: show }, traces);
      }
    });
  }

  for (const select of document.querySelectorAll("[data-errors]")) {
    select.addEventListener("change", () => {
      for (const set of select.closest("[data-case]").querySelectorAll("[data-output]")) {
        set.hidden = set.dataset.output !== select.value;
        set.querySelectorAll(".plot").forEach(draw);
      }
    });
  }

  // Paper is light and narrower than the screen, and sends no resize event. What the filters hide stays away.
  window.addEventListener("beforeprint", () => {
    document.documentElement.dataset.paper = "";
    canvases.forEach((redraw) => redraw());
    plots.forEach((plot) => {
      draw(plot);
      if (plot.dataset.drawn) Plotly.relayout(plot, plot.closest(".errors") ? { width: 225, height: 230 } : { width: 340, height: 350 });
    });
  });
  window.addEventListener("afterprint", () => {
    delete document.documentElement.dataset.paper;
    canvases.forEach((redraw) => redraw());
    plots.forEach((plot) => {
      if (plot.dataset.drawn) Plotly.relayout(plot, { width: null, height: null, autosize: true });
    });
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
