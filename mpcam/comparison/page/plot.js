// Error against time on two logarithmic axes, with the Pareto front; drawn anew for each width and choice.
const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";

function frontOf(error, time) {
  return data.fronts.find((front) => front.error === error && front.time === time);
}

function decadeLabel(exponent) {
  if (exponent >= -3 && exponent <= 4) return String(Number((10 ** exponent).toPrecision(1)));
  const digits = String(Math.abs(exponent)).replace(/\d/g, (d) => SUPERSCRIPTS[d]);
  return `10${exponent < 0 ? "⁻" : ""}${digits}`;
}

function logTicks(low, high) {
  const decades = Math.log10(high / low);
  const steps = decades < 1.2 ? [1, 2, 3, 5, 7] : decades < 2.6 ? [1, 2, 5] : [1];
  const skip = Math.max(1, Math.ceil(decades / 8));
  const ticks = [];
  for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); e++) {
    for (const step of steps) {
      const value = step * 10 ** e;
      if (value < low * 0.999 || value > high * 1.001 || (steps.length === 1 && e % skip)) continue;
      ticks.push([value, step === 1 ? decadeLabel(e) : formatNumber(value, 1)]);
    }
  }
  return ticks;
}

function drawPlot(state, choose) {
  const box = find("plot");
  const width = Math.max(box.clientWidth - 12, 260), narrow = width < 560;
  const height = narrow ? 340 : 440;
  const area = { left: 62, right: width - 18, top: 14, bottom: height - 50 };
  const points = data.rows
    .map((row) => ({ row, x: number(row[state.time]), y: amount(row, state.error) }))
    .filter((point) => point.x > 0 && Number.isFinite(point.x) && !Number.isNaN(point.y));
  box.replaceChildren();
  if (points.length === 0) {
    box.append(element("p", { class: "help" }, "No row has both this error and this time."));
    return;
  }
  const times = points.map((point) => point.x);
  const errors = points.map((point) => point.y).filter((y) => y > 0 && Number.isFinite(y));
  const hasZero = points.some((point) => point.y === 0), hasInfinite = points.some((point) => point.y === Infinity);
  const xLow = Math.min(...times) / 1.3, xHigh = Math.max(...times) * (narrow ? 1.9 : 1.5);
  const yLow = (errors.length ? Math.min(...errors) : 0.01) / 1.6, yHigh = (errors.length ? Math.max(...errors) : 1) * 1.8;
  const floor = area.bottom - (hasZero ? 40 : 0), ceiling = area.top + (hasInfinite ? 32 : 0);
  const x = (t) => area.left + (Math.log(t / xLow) / Math.log(xHigh / xLow)) * (area.right - area.left);
  const y = (e) => e === 0 ? area.bottom - 18 : e === Infinity ? area.top + 10
    : floor - (Math.log(e / yLow) / Math.log(yHigh / yLow)) * (floor - ceiling);

  const title = data.columns[state.error], timeTitle = data.columns[state.time].title;
  const svg = element("svg", { viewBox: `0 0 ${width} ${height}`, height, role: "group",
    "aria-label": `${title.title} against ${timeTitle}, both logarithmic` });
  drawAxes(svg, area, { x, y, xLow, xHigh, yLow, yHigh, floor, ceiling, hasZero, hasInfinite }, narrow);
  svg.append(
    element("text", { class: "axis-title", x: (area.left + area.right) / 2, y: height - 8, "text-anchor": "middle" },
      `${timeTitle}, median (ms)`),
    element("text", { class: "axis-title", transform: `translate(14 ${(area.top + area.bottom) / 2}) rotate(-90)`,
      "text-anchor": "middle" }, title.unit ? `${title.title} (${title.unit})` : title.title),
  );

  const front = frontOf(state.error, state.time);
  const onFront = front ? front.rows.map((label) => points.find((p) => p.row.label === label)).filter(Boolean) : [];
  if (onFront.length) {
    let path = `M${x(onFront[0].x)} ${y(onFront[0].y)}`;
    for (const point of onFront.slice(1)) path += `H${x(point.x)}V${y(point.y)}`;
    svg.append(element("path", { class: "front-line", d: `${path}H${area.right}` }));
  }
  for (const method of new Set(points.map((point) => point.row.method))) {
    const path = points.filter((p) => p.row.method === method).map((p) => `${x(p.x)} ${y(p.y)}`).join("L");
    const line = element("path", { class: "series", d: `M${path}` });
    line.style.stroke = color(method);
    svg.append(line);
  }
  for (const point of points) svg.append(drawPoint(point, x(point.x), y(point.y), state, choose));
  box.append(svg);
  placeLabels(svg, points.map((p) => ({ ...p, px: x(p.x), py: y(p.y) })), area);
}

function drawAxes(svg, area, scale, narrow) {
  if (scale.hasZero) {
    svg.append(element("rect", { class: "zero-band", x: area.left, y: scale.floor + 4, width: area.right - area.left,
      height: area.bottom - scale.floor - 4 }));
  }
  const across = (at, text) => svg.append(
    element("line", { class: "grid", x1: area.left, x2: area.right, y1: at, y2: at }),
    element("text", { x: area.left - 8, y: at + 4, "text-anchor": "end" }, text));
  for (const [value, text] of logTicks(scale.yLow, scale.yHigh)) across(scale.y(value), text);
  if (scale.hasZero) across(scale.y(0), "0");
  if (scale.hasInfinite) across(scale.y(Infinity), "∞");
  let last = -Infinity;
  for (const [value, text] of logTicks(scale.xLow, scale.xHigh)) {
    const at = scale.x(value);
    svg.append(element("line", { class: "grid", x1: at, x2: at, y1: area.top, y2: area.bottom }));
    if (at - last < (narrow ? 30 : 26)) continue;
    last = at;
    svg.append(element("text", { x: at, y: area.bottom + 18, "text-anchor": "middle" }, text));
  }
  svg.append(element("path", { class: "axis", fill: "none",
    d: `M${area.left} ${area.top}V${area.bottom}H${area.right}` }));
}

function drawPoint(point, px, py, state, choose) {
  const { row } = point;
  const spoken = `${row.label}: ${data.columns[state.error].title} ${withUnit(row, state.error)}, ` +
    `${data.columns[state.time].title} ${withUnit(row, state.time)}`;
  const group = element("g", { class: "point", transform: `translate(${px} ${py})`, tabindex: 0, role: "button",
    "aria-label": spoken, "data-row": row.label });
  group.style.color = color(row.method);
  const mark = element("path", { class: "mark", d: shape(row.method, 6.5) });
  mark.style.fill = color(row.method);
  group.append(element("circle", { class: "halo", r: 11 }), mark);
  if (row.label === state.shown) group.classList.add("chosen");
  const show = () => showTooltip(group, row, state);
  group.addEventListener("pointerenter", show);
  group.addEventListener("focus", show);
  group.addEventListener("pointerleave", hideTooltip);
  group.addEventListener("blur", hideTooltip);
  group.addEventListener("click", () => choose(row.label));
  group.addEventListener("keydown", (event) => {
    if (event.key === "Escape") hideTooltip();
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    choose(row.label);
  });
  return group;
}

// Each label goes to the first of eight places around its point that is free; where none is, the tooltip must do.
function placeLabels(svg, points, area) {
  const taken = points.map((p) => [p.px - 8, p.py - 8, p.px + 8, p.py + 8]);
  const free = (a, own) => a[0] > area.left && a[2] < area.right + 14 && a[1] > area.top - 6 && a[3] < area.bottom &&
    taken.every((b, k) => k === own || a[2] < b[0] || b[2] < a[0] || a[3] < b[1] || b[3] < a[1]);
  points.forEach((point, own) => {
    const text = element("text", { class: "label" }, (point.row.setting || point.row.method).replace("level ", "L"));
    text.style.fill = color(point.row.method);
    svg.append(text);
    const w = text.getComputedTextLength(), h = 12, g = 11, d = 7;
    const places = [[d, -d - h], [g, -h / 2], [-w / 2, -g - h], [-d - w, d], [-w / 2, g], [d, d], [-g - w, -h / 2], [-d - w, -d - h]];
    for (const [dx, dy] of places) {
      const left = point.px + dx, top = point.py + dy, place = [left, top, left + w, top + h];
      if (!free(place, own)) continue;
      taken.push(place);
      text.setAttribute("x", left);
      text.setAttribute("y", top + h - 2);
      return;
    }
    text.remove();
  });
}

function showTooltip(anchor, row, state) {
  const tip = find("tooltip");
  const list = element("dl");
  const columns = [...new Set([state.error, "flip", "hit_mismatch", "projection_p95"])];
  const lines = columns.map((name) => [data.columns[name].title, withUnit(row, name)]);
  for (const name of ["still_ms", "moving_ms"]) {
    if (!Number.isNaN(number(row[name]))) {
      lines.push([data.columns[name].title, `${formatTimed(row, name).join(" ")} ms`]);
    }
  }
  fillFacts(list, Object.fromEntries(lines));
  tip.replaceChildren(element("strong", {}, row.label), list);
  tip.hidden = false;
  const at = anchor.querySelector(".halo").getBoundingClientRect(), own = tip.getBoundingClientRect();
  const left = at.right + 8 + own.width > innerWidth - 8 ? at.left - 8 - own.width : at.right + 8;
  tip.style.left = `${Math.min(Math.max(left, 8), innerWidth - own.width - 8)}px`;
  tip.style.top = `${Math.min(Math.max(at.top - own.height / 2, 8), innerHeight - own.height - 8)}px`;
}

function hideTooltip() {
  find("tooltip").hidden = true;
}
