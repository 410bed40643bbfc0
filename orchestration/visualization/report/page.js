// One moment of the run, shown everywhere at once: body, cross-section, a line in every chart. Numbers come from the
// element #data; geometry as in geometry.py: x = p + a d1 + b d2.
"use strict";
const page = JSON.parse(document.getElementById("data").textContent);
const element = (id) => document.getElementById(id);
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const floats = (text) => new Float32Array(bytes(text));
const config = { responsive: true, displaylogo: false, scrollZoom: false };

const charts = page.charts.map((figure, k) => {
  const place = element(`chart-${k}`);
  Plotly.newPlot(place, figure.data, figure.layout, config);
  place.on("plotly_click", (event) => show(nearest(event.points[0].x)));
  return place;
});
// Lines in charts move where someone sees them: redrawing all of them is most of the work.
const seen = new Set();
const watcher = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (isIntersecting) seen.add(target), mark(target);
    else seen.delete(target);
  }
});
function mark(place) {
  const t = page.times[shown];
  if (place.layout.shapes[0].x0 !== t) Plotly.relayout(place, { "shapes[0].x0": t, "shapes[0].x1": t });
}

const body = page.body && {
  place: element("body"),
  p: floats(page.body.p), d1: floats(page.body.d1), d2: floats(page.body.d2),
  surfaces: page.body.surfaces.map((s) => ({ offsets: floats(s.offsets), stations: new Int32Array(bytes(s.stations)) })),
  temperatures: floats(page.body.temperatures),
};
const field = page.field && {
  place: element("section"),
  courses: floats(page.field.courses), raster: floats(page.field.raster), cap: floats(page.field.cap),
};
if (body) Plotly.newPlot(body.place, page.body.figure.data, page.body.figure.layout, config);
if (field) Plotly.newPlot(field.place, page.field.figure.data, page.field.figure.layout, config);

function sweep(surface, row) {
  const n = surface.stations.length;
  const x = new Float32Array(n), y = new Float32Array(n), z = new Float32Array(n);
  for (let v = 0; v < n; ++v) {
    const k = 3 * (row * page.body.stations + surface.stations[v]);
    const a = surface.offsets[2 * v], b = surface.offsets[2 * v + 1];
    x[v] = body.p[k] + a * body.d1[k] + b * body.d2[k];
    y[v] = body.p[k + 1] + a * body.d1[k + 1] + b * body.d2[k + 1];
    z[v] = body.p[k + 2] + a * body.d1[k + 2] + b * body.d2[k + 2];
  }
  return { x, y, z };
}

function temperatures(modes, row) {
  const r = page.field.modes, course = field.courses.subarray(row * r, (row + 1) * r);
  const found = new Float32Array(modes.length / r);
  for (let v = 0; v < found.length; ++v) {
    found[v] = page.field.zero;
    for (let m = 0; m < r; ++m) found[v] += modes[v * r + m] * course[m];
  }
  return found;
}

function showBody(row) {
  const tcas = page.body.tcas;
  const data = body.place.data.slice();
  body.surfaces.forEach((surface, k) => {
    data[k] = { ...data[k], ...sweep(surface, row) };
    if (k === 0 && field) data[k].intensity = temperatures(field.cap, row);
    if (k > 0 && k <= tcas) data[k].intensity = new Float32Array(surface.stations.length).fill(body.temperatures[row * tcas + k - 1]);
  });
  Plotly.react(body.place, data, body.place.layout, config);
}

function showSection(row) {
  const flat = temperatures(field.raster, row), n = page.field.points;
  const z = Array.from({ length: n }, (_, k) => flat.subarray(k * n, (k + 1) * n));
  Plotly.restyle(field.place, { z: [z] }, [0]);
}

let shown = -1;
function show(row) {
  if (row === shown) return;
  shown = row;
  const t = page.times[row];
  element("time").value = row;
  element("clock").textContent = `t = ${t.toFixed(page.decimals)} s`;
  page.readings.forEach((reading, k) => (element(`reading-${k}`).textContent = reading[row]));
  if (body) showBody(row);
  if (field) showSection(row);
  seen.forEach(mark);
}

function nearest(t) {
  return page.times.reduce((best, other, k) => (Math.abs(other - t) < Math.abs(page.times[best] - t) ? k : best), 0);
}

// Playing takes ten seconds however long the run is; a slow machine leaves moments out.
let playing = null;
function step() {
  if (!playing) return;
  const span = page.times[page.times.length - 1] - page.times[0];
  const t = playing.t + ((performance.now() - playing.now) / 1e4) * span;
  show(nearest(t));
  if (shown === page.times.length - 1) stop();
  else requestAnimationFrame(step);
}
function stop() {
  playing = null;
  element("play").textContent = "▶ Play";
}
function play() {
  if (shown === page.times.length - 1) show(0);
  playing = { now: performance.now(), t: page.times[shown] };
  element("play").textContent = "❚❚ Pause";
  requestAnimationFrame(step);
}
element("play").addEventListener("click", () => (playing ? stop() : play()));
element("time").addEventListener("input", (event) => {
  stop();
  requestAnimationFrame(() => show(Number(event.target.value))); // of many moves between two pictures the last counts
});
show(page.times.length - 1);
charts.forEach((place) => watcher.observe(place));
