// Puts the parts together: what is chosen, and what is drawn again when a choice changes.
const usable = (name) => data.rows.some((row) => !Number.isNaN(number(row[name])));
const errorColumns = [...new Set(data.fronts.map((front) => front.error))];
const timeColumns = [...new Set(data.fronts.map((front) => front.time))];
const shownRows = data.rows.map((row) => row.label).filter((label) => label in data.images);
const state = {
  error: errorColumns.includes("flip") ? "flip" : errorColumns[0] ?? "flip",
  time: timeColumns[0] ?? "still_ms",
  shown: shownRows.find((label) => !/^(invert|raytrace)/.test(label)) ?? shownRows[0],
  against: "truth", zoom: "1", columns: "main", sort: null, descending: false,
};

const act = {
  choose(label) {
    if (!shownRows.includes(label)) return;
    const point = document.activeElement?.closest?.(".point")?.dataset.row;
    state.shown = label;
    find("shown").value = label;
    drawAll();
    if (point) document.querySelector(`.point[data-row="${CSS.escape(point)}"]`)?.focus({ preventScroll: true });
  },
  sort(name) {
    // first the direction that puts the better rows on top: PSNR is the only column where more is better
    const first = name === "psnr";
    state.descending = state.sort === name ? !state.descending : first;
    state.sort = name;
    drawTable(state, act);
  },
};

function drawWinners() {
  const front = frontOf(state.error, state.time);
  const winners = front?.winners ?? [];
  find("winners").replaceChildren(...winners.map((winner) => {
    const row = data.rows.find((candidate) => candidate.label === winner.row);
    return element("li", {},
      element("span", { class: "from" }, `from ${formatNumber(number(winner.start_ms))} ms`),
      element("span", { class: "who" }, swatch(row.method), row.label),
      element("span", { class: "quality" }, winner.quality));
  }));
  const { pixels, mismatch } = data.float_precision;
  find("below").textContent = winners.length
    ? `Below ${formatNumber(number(winners[0].start_ms))} ms no method finishes a frame. The list ends with the first ` +
      `row at float precision: 95% of its hits within ${pixels} pixels, and no more than ${formatNumber(mismatch * 100)}% ` +
      "of its pixels wrongly hit or missed."
    : "No row has both this error and this time.";
  find("error-help").textContent = state.error ? data.columns[state.error].help : "";
}

function drawAll() {
  hideTooltip();
  drawPlot(state, act.choose);
  drawWinners();
  drawTable(state, act);
  if (shownRows.length) drawViewer(state);
}

function start() {
  find("name").textContent = data.name;
  const subject = [data.scene.triangles && `${data.scene.triangles} triangles`, data.scene.camera, data.scene.image,
    data.machine.date].filter(Boolean);
  find("subject").textContent = subject.join(" · ");
  find("headline").textContent = data.headline;
  for (const name of errorColumns) find("error").append(element("option", { value: name }, data.columns[name].title));
  find("error").value = state.error ?? "";
  find("error").addEventListener("change", (event) => { state.error = event.target.value; drawAll(); });
  segments("time", timeColumns.map((name) => [name, data.columns[name].title]), state.time, (value) => { state.time = value; drawAll(); });
  segments("columns", [["main", "Main columns"], ["all", "All columns"]], "main", (value) => { state.columns = value; drawTable(state, act); });
  const methods = [...new Set(data.rows.map((row) => row.method))];
  find("legend").append(...methods.map((method) => element("li", {}, swatch(method), method)),
    element("li", {}, element("span", { class: "front-key" }), "Pareto front: nothing is both faster and nearer the truth"));
  fillFacts(find("scene"), data.scene);
  fillFacts(find("machine"), data.machine);
  fillFacts(find("measured"), data.measured);
  for (const [method, reason] of Object.entries(data.left_out)) {
    find("left-out").append(element("p", { class: "help" }, `${method} is left out: ${reason}.`));
  }
  if (shownRows.length && data.truth) {
    for (const label of shownRows) find("shown").append(element("option", { value: label }, label));
    find("shown").value = state.shown;
    find("shown").addEventListener("change", (event) => act.choose(event.target.value));
    segments("against", SIDES, state.against, (value) => { state.against = value; drawViewer(state); });
    segments("zoom", [["1", "1×"], ["2", "2×"], ["4", "4×"]], "1", (value) => { state.zoom = value; drawViewer(state); });
    startViewer();
  } else {
    find("viewer-section").hidden = true;
  }
  startTheme();
  drawAll();
  let width = innerWidth;
  addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; drawPlot(state, act.choose); } });
  addEventListener("scroll", hideTooltip, { passive: true });
}

start();
