"use strict";
// Numbers, elements and the marks of methods: shared by the other parts of the page.
const data = JSON.parse(document.getElementById("data").textContent);
const METHODS = ["invert", "vertex", "cubemap", "hemicube", "raytrace", "camera_triangles", "environment"];
const find = (id) => document.getElementById(id);

function element(name, attributes = {}, ...children) {
  const svg = ["svg", "g", "path", "line", "circle", "rect", "text"].includes(name);
  const made = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined) made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

// JSON has no infinity: "inf" stands for it, null for a number that was not measured.
function number(value) {
  if (value === null || value === undefined) return NaN;
  return value === "inf" ? Infinity : value === "-inf" ? -Infinity : value;
}

function formatNumber(value, digits = 3) {
  if (Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  if (Number.isInteger(value) && Math.abs(value) >= 1000) return value.toLocaleString("en-US");
  const exponent = Math.floor(Math.log10(Math.abs(Number(value.toPrecision(digits)))));
  const strip = (text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
  if (exponent < -3 || exponent >= 6) return `${strip((value / 10 ** exponent).toFixed(digits - 1))}e${exponent}`;
  const decimals = Math.max(digits - 1 - exponent, 0);
  return strip(value.toLocaleString("en-US", { minimumFractionDigits: decimals, maximumFractionDigits: decimals }));
}

// The number of a row in the unit of its column: shares become percent.
function amount(row, column) {
  return number(row[column]) * (data.columns[column].unit === "%" ? 100 : 1);
}

function formatAmount(row, column, digits = 3) {
  return formatNumber(amount(row, column), digits);
}

function withUnit(row, column) {
  const unit = data.columns[column].unit;
  const text = formatAmount(row, column);
  return unit && /\d/.test(text) ? `${text} ${unit}` : text;
}

// A measured time and half its interquartile range, both with the time's decimals; only the time if there is no spread.
function formatTimed(row, column) {
  const value = number(row[column]), spread = number(row[column.replace("_ms", "_spread")]);
  if (Number.isNaN(spread) || !(value > 0)) return [formatAmount(row, column)];
  const decimals = Math.max(2 - Math.floor(Math.log10(value)), 0);
  return [value.toFixed(decimals), `±${(spread / 2).toFixed(decimals)}`];
}

const color = (method) => `var(--${METHODS.includes(method) ? method : "other"})`;

// One shape per method, so that color is never the only sign. r: radius in pixels.
function shape(method, r) {
  const s = r * 0.88, t = r * 1.15, w = r * 0.42;
  switch (method) {
    case "invert": return `M${-r} 0A${r} ${r} 0 1 0 ${r} 0A${r} ${r} 0 1 0 ${-r} 0Z`;
    case "vertex": return `M0 ${-t}L${t} ${t * 0.8}L${-t} ${t * 0.8}Z`;
    case "camera_triangles": return `M0 ${t}L${t} ${-t * 0.8}L${-t} ${-t * 0.8}Z`;
    case "cubemap": return `M${-s} ${-s}H${s}V${s}H${-s}Z`;
    case "environment":
    case "hemicube": return `M0 ${-t * 1.05}L${t * 1.05} 0L0 ${t * 1.05}L${-t * 1.05} 0Z`;
    case "raytrace":
      return `M${-r} ${-r + w}L${-r + w} ${-r}L0 ${-w}L${r - w} ${-r}L${r} ${-r + w}L${w} 0L${r} ${r - w}L${r - w} ${r}` +
        `L0 ${w}L${-r + w} ${r}L${-r} ${r - w}L${-w} 0Z`;
    default: return `M${-w} ${-r}H${w}V${-w}H${r}V${w}H${w}V${r}H${-w}V${w}H${-r}V${-w}H${-w}Z`;
  }
}

function swatch(method) {
  const picture = element("svg", { class: "swatch", viewBox: "-8 -8 16 16", "aria-hidden": "true" });
  const mark = element("path", { d: shape(method, 6) });
  mark.style.fill = color(method);
  picture.append(mark);
  return picture;
}

// A group of radio buttons that looks like one control. options: [value, text]; act(value) on a change.
function segments(id, options, chosen, act) {
  for (const [value, text] of options) {
    const input = element("input", { type: "radio", name: id, value });
    input.checked = value === chosen;
    input.addEventListener("change", () => act(value));
    find(id).append(element("label", {}, input, element("span", {}, text)));
  }
}

function fillFacts(list, facts) {
  list.replaceChildren(...Object.entries(facts).flatMap(([name, value]) => [
    element("dt", {}, name), element("dd", {}, value),
  ]));
}
