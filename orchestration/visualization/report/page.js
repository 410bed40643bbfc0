// One time of the run, shown everywhere at once: body, cross-section, a line and the values in every chart.
const section = page.section && new SectionView(page.section);
if (section) section.attach(element("section"), element("probe"));
const body = page.body && new BodyView(element("body"), page.body, (row) => section && section.evaluate(row));
const charts = page.charts.map((data, k) => ({
  ...data,
  svg: element(`chart-${k}`).firstElementChild,
  values: data.values.map(floats),
}));

document.querySelectorAll(".scale").forEach((scale) => {
  const canvas = scale.querySelector("canvas"), context = canvas.getContext("2d"), pixels = context.createImageData(256, 1);
  for (let k = 0; k < 256; ++k) pixels.data.set([...palette.subarray(3 * k, 3 * k + 3), 255], 4 * k);
  context.putImageData(pixels, 0, 0);
  scale.querySelector(".low").textContent = page.range[0].toFixed(0);
  scale.querySelector(".high").textContent = page.range[1].toFixed(0);
});

let shown = -1;
function show(row) {
  if (row === shown) return;
  shown = row;
  const t = page.times[row], clock = `t = ${t.toFixed(page.decimals)} s`;
  element("time").value = row;
  element("time").setAttribute("aria-valuetext", clock);
  element("clock").textContent = clock;
  page.readings.forEach((reading, k) => (element(`reading-${k}`).textContent = reading[row]));
  charts.forEach((chart, k) => {
    const x = chart.left + ((t - chart.first) / (chart.last - chart.first || 1)) * (chart.right - chart.left);
    const cursor = chart.svg.querySelector(".cursor");
    cursor.setAttribute("x1", x), cursor.setAttribute("x2", x);
    chart.values.forEach((values, j) => (element(`value-${k}-${j}`).textContent = readable(values[row], chart.unit)));
  });
  redraw();
}
function readable(value, unit) {
  return Number.isFinite(value) ? `${Number(value.toPrecision(3))}${unit}`.replace("-", "−") : "";
}
function redraw() {
  if (body) body.draw(shown);
  if (section) section.draw(shown);
}
function nearest(t) {
  return page.times.reduce((best, other, k) => (Math.abs(other - t) < Math.abs(page.times[best] - t) ? k : best), 0);
}

charts.forEach((chart) => {
  const go = (event) => {
    const box = chart.svg.getBoundingClientRect(), x = ((event.clientX - box.left) / box.width) * chart.svg.viewBox.baseVal.width;
    stop();
    show(nearest(chart.first + ((x - chart.left) / (chart.right - chart.left)) * (chart.last - chart.first)));
  };
  chart.svg.addEventListener("pointerdown", go);
  chart.svg.addEventListener("pointermove", (event) => event.buttons && go(event));
});

// Playing takes ten seconds however long the run is; a slow machine leaves times out.
let playing = null;
function step() {
  if (!playing) return;
  const span = page.times[page.times.length - 1] - page.times[0];
  show(nearest(playing.t + ((performance.now() - playing.now) / 1e4) * span));
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
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
new ResizeObserver(redraw).observe(document.querySelector("main"));
show(page.times.length - 1);
