"use strict";
// Shared drawing code. No library.
const SVG = "http://www.w3.org/2000/svg";

function element(name, attributes, parent, text) {
  const made = document.createElementNS(SVG, name);
  for (const key of Object.keys(attributes)) made.setAttribute(key, attributes[key]);
  if (text !== undefined) made.textContent = text;
  if (parent) parent.appendChild(made);
  return made;
}

function html(name, parent, text, kind) {
  const made = document.createElement(name);
  if (text) made.textContent = text;
  if (kind) made.className = kind;
  if (parent) parent.appendChild(made);
  return made;
}

// True minus sign, thin spaces as thousands separators.
function shown(text) {
  const [whole, part] = String(text).split(".");
  const size = whole.replace("-", "");
  const grouped = size.length > 3 && /^\d+$/.test(size) ? size.replace(/\B(?=(\d{3})+$)/g, "\u2009") : size;
  return (whole.startsWith("-") ? "\u2212" : "") + grouped + (part === undefined ? "" : "." + part);
}

// With a fixed number of decimals; zero has no minus sign.
function fixed(v, digits) { const text = v.toFixed(digits); return shown(Number(text) === 0 ? text.replace("-", "") : text); }

function number(v) {
  if (!isFinite(v)) return "–";
  const size = Math.abs(v);
  if (v !== 0 && (size < 1e-3 || size >= 1e6)) return v.toExponential(2).replace("e+", "e").replace("-", "\u2212");
  return shown(Number(v.toPrecision(4)));
}

// Decodes values: evenly spaced, scaled integers, or plain.
function values(packed) {
  if (Array.isArray(packed)) return packed.map(v => (v === null ? NaN : v));
  if (packed.v) return packed.v.map(v => (v === null ? NaN : v * packed.k));
  return Array.from({ length: packed.n }, (_, k) => packed.a + packed.d * k);
}

// Ticks and labels at round numbers; on a log axis positions are decades.
function ticks(low, high, log, wanted) {
  const list = [];
  if (log) {
    const span = high - low;
    const factors = span > 3.5 || wanted < 3 ? [1] : span > 1.2 ? [1, 3] : [1, 2, 3, 5, 7];
    for (let decade = Math.floor(low); decade <= Math.ceil(high); decade++)
      for (const factor of factors) {
        const at = decade + Math.log10(factor);
        if (at >= low - 1e-9 && at <= high + 1e-9) list.push([at, number(factor * Math.pow(10, decade))]);
      }
    if (list.length > 1) return list;
    return ticks(Math.pow(10, low), Math.pow(10, high), false, wanted).map(([v, text]) => [Math.log10(v), text]);
  }
  const rough = (high - low) / wanted;
  const decade = Math.pow(10, Math.floor(Math.log10(rough)));
  const step = [1, 2, 5, 10].find(f => f * decade >= rough * 0.999) * decade;
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  for (let k = Math.ceil(low / step - 0.02); k * step <= high + 0.02 * step && list.length < 30; k++) {
    const v = Math.abs(k * step) < 1e-12 * step ? 0 : k * step;
    list.push([v, digits > 6 || Math.abs(v) >= 1e6 ? number(v) : shown(v.toFixed(digits))]);
  }
  return list;
}

function axisText(axis) { return axis.unit ? axis.label + ", " + axis.unit : axis.label; }

// Places the labels of a column without overlap; each is [y, text, class].
function apart(labels, step, low, high) {
  const sorted = labels.map(l => [...l]).sort((a, b) => a[0] - b[0]);
  for (let k = 1; k < sorted.length; k++) sorted[k][0] = Math.max(sorted[k][0], sorted[k - 1][0] + step);
  let limit = high;
  for (let k = sorted.length - 1; k >= 0; k--) { sorted[k][0] = Math.max(low, Math.min(sorted[k][0], limit)); limit = sorted[k][0] - step; }
  return sorted;
}

function quoted(text) { return /[",\n]/.test(text) ? '"' + text.replace(/"/g, '""') + '"' : text; }

// Light or dark theme, as in the system until the user chooses; returns a function that applies it again.
function themed(button) {
  const root = document.documentElement, dark = window.matchMedia("(prefers-color-scheme: dark)");
  let chosen = null;
  const apply = () => root.classList.toggle("dark", chosen === null ? dark.matches : chosen);
  dark.addEventListener("change", apply);
  button.addEventListener("click", () => { chosen = !root.classList.contains("dark"); apply(); });
  apply();
  return apply;
}

// Counts script errors in the page, so that tests can detect them.
function counted() {
  const root = document.documentElement;
  let failed = 0;
  window.addEventListener("error", () => { root.dataset.errors = String(++failed); });
  root.dataset.errors = "0";
}

function download(name, text) { save(name, "data:text/csv;charset=utf-8," + encodeURIComponent(text)); }

function save(name, address) {
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
}
