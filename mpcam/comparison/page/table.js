// The sortable table. Each heading is a button; aria-sort tells the order; rows keep their order among equals.
const MAIN = ["flip", "psnr", "hit_mismatch", "triangle_mismatch", "depth_p999", "projection_median", "projection_p95",
  "still_ms", "moving_ms", "shade_ms"];

const measuredColumns = () => Object.keys(data.columns)
  .filter((name) => !name.endsWith("_spread") && data.rows.some((row) => !Number.isNaN(number(row[name]))));

function tableColumns(state) {
  const all = measuredColumns();
  const names = state.columns === "all" ? all : MAIN.filter((name) => all.includes(name));
  return ["label", "front", ...names, ...(state.columns === "all" ? ["stages", "note"] : [])];
}

function drawTable(state, act) {
  const columns = tableColumns(state);
  const focused = document.activeElement?.closest?.("#table th")?.dataset.column;
  const front = new Set(frontOf(state.error, state.time)?.rows ?? []);
  const head = element("tr", {}, ...columns.map((name) => heading(name, state, act)));
  const body = element("tbody", {}, ...sortedRows(state, front).map((row) => tableRow(row, columns, front, state, act)));
  find("table").replaceChildren(element("thead", {}, head), body);
  if (focused) find("table").querySelector(`th[data-column="${focused}"] button`)?.focus({ preventScroll: true });
}

function heading(name, state, act) {
  const titles = { label: ["Method", ""], front: ["Front", ""], stages: ["Stages", "ms"], note: ["Note", ""] };
  const column = data.columns[name];
  const [title, unit] = column ? [column.title, column.unit] : titles[name];
  if (name === "stages" || name === "note") {
    return element("th", { scope: "col", class: "text" }, element("span", {}, title));
  }
  const order = state.sort === name ? (state.descending ? "descending" : "ascending") : "none";
  const arrow = element("span", { class: "arrow", "aria-hidden": "true" }, order === "descending" ? "▼" : "▲");
  const button = element("button", { type: "button", title: column?.help }, arrow, title,
    ...(unit ? [element("small", {}, unit)] : []));
  button.addEventListener("click", () => act.sort(name));
  return element("th", { scope: "col", "aria-sort": order, "data-column": name }, button);
}

function sortedRows(state, front) {
  const key = (row) => state.sort === "front" ? (front.has(row.label) ? 0 : 1) : number(row[state.sort]);
  if (!state.sort) return data.rows;
  const sign = state.descending ? -1 : 1;
  return [...data.rows].sort((a, b) => {
    if (state.sort === "label") return sign * a.label.localeCompare(b.label, "en", { numeric: true });
    const [p, q] = [key(a), key(b)];
    if (Number.isNaN(p) || Number.isNaN(q)) return Number.isNaN(p) - Number.isNaN(q); // not measured: last
    return p === q ? 0 : sign * (p < q ? -1 : 1);
  });
}

function tableRow(row, columns, front, state, act) {
  const made = element("tr", { "data-row": row.label, class: row.label === state.shown ? "chosen" : null });
  for (const name of columns) {
    if (name === "label") {
      const button = element("button", { type: "button", class: "row-name" }, swatch(row.method), row.label);
      button.addEventListener("click", () => act.choose(row.label));
      made.append(element("th", { scope: "row" }, button));
    } else if (name === "front") {
      const on = front.has(row.label);
      made.append(element("td", { class: "mark", "aria-label": on ? "on the front" : "not on the front" }, on ? "●" : ""));
    } else if (name === "stages") {
      const parts = Object.entries(row.stages_ms).map(([stage, time]) => `${stage} ${formatNumber(number(time))}`);
      made.append(element("td", { class: "text" }, parts.join(", ")));
    } else if (name === "note") {
      made.append(element("td", { class: "text" }, row.note));
    } else {
      const timed = name === "still_ms" || name === "moving_ms";
      const [text, spread] = timed ? formatTimed(row, name) : [formatAmount(row, name)];
      const cell = element("td", {}, text);
      if (spread) cell.append(" ", element("span", { class: "spread" }, spread));
      made.append(cell);
    }
  }
  return made;
}
