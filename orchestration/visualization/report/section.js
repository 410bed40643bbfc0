// The temperature of the cross-section as seen from the tip: T = zero + modes c(t), on a square grid.
class SectionView {
  constructor(data) {
    this.data = data;
    this.courses = floats(data.courses), this.raster = scaled(data.raster);
    this.values = new Float32Array(data.points ** 2);
    this.picture = document.createElement("canvas");
    this.picture.width = this.picture.height = data.points;
    this.pixels = this.picture.getContext("2d").createImageData(data.points, data.points);
    this.row = -1;
  }
  evaluate(row) {
    if (row === this.row) return this.picture;
    this.row = row;
    const { modes, zero } = this.data, course = this.courses.subarray(row * modes, (row + 1) * modes);
    for (let v = 0; v < this.values.length; ++v) {
      let T = zero;
      for (let m = 0; m < modes; ++m) T += this.raster[v * modes + m] * course[m];
      this.values[v] = T;
      const k = 3 * colourIndex(T);
      this.pixels.data.set([palette[k], palette[k + 1], palette[k + 2], 255], 4 * v);
    }
    this.picture.getContext("2d").putImageData(this.pixels, 0, 0); // its first row is that of the lowest y
    return this.picture;
  }
  attach(canvas, probe) {
    this.canvas = canvas, this.probe = probe, this.pointer = null;
    canvas.addEventListener("pointermove", (event) => {
      this.pointer = [(event.offsetX - this.centre[0]) / this.factor, (this.centre[1] - event.offsetY) / this.factor];
      this.read();
    });
    canvas.addEventListener("pointerleave", () => ((this.pointer = null), this.read()));
  }
  read() {
    const { radius, points } = this.data;
    if (!this.pointer || Math.hypot(...this.pointer) > radius) return;
    const [i, j] = this.pointer.map((c) => Math.round((0.5 + (0.5 * c) / radius) * (points - 1)));
    const [x, y] = this.pointer.map((c) => c.toFixed(2));
    this.probe.textContent = `x = ${x} mm, y = ${y} mm: ${this.values[j * points + i].toFixed(1)} °C`;
  }
  draw(row) {
    this.evaluate(row);
    const { context, width, height } = prepare(this.canvas), { radius, centres, outer, inner } = this.data;
    if (!width) return;
    this.centre = [width / 2, height / 2 - 10], this.factor = Math.min(0.5 * width - 46, 0.5 * height - 34) / radius;
    const circle = (x, y, r) => {
      context.beginPath();
      context.arc(this.centre[0] + this.factor * x, this.centre[1] - this.factor * y, this.factor * r, 0, 2 * Math.PI);
    };
    const ink = style("--ink"), R = this.factor * radius;
    context.save();
    circle(0, 0, radius);
    context.clip();
    context.translate(...this.centre);
    context.scale(R, -R);
    context.drawImage(this.picture, -1, -1, 2, 2);
    context.restore();
    context.strokeStyle = ink, context.lineWidth = 1;
    circle(0, 0, radius), context.stroke();
    context.font = "12px system-ui, 'DejaVu Sans', sans-serif", context.textAlign = "center", context.textBaseline = "middle";
    centres.forEach(([x, y], i) => {
      circle(x, y, outer[i]), context.stroke();
      circle(x, y, inner[i]), (context.fillStyle = style("--card")), context.fill(), context.stroke();
      const far = Math.hypot(x, y) || 1, out = (far + outer[i] + 10 / this.factor) / far;
      context.fillStyle = "#fff", context.strokeStyle = "#000c", context.lineWidth = 3;
      const at = [this.centre[0] + this.factor * out * x, this.centre[1] - this.factor * out * y];
      context.strokeText(`TCA ${i + 1}`, ...at), context.fillText(`TCA ${i + 1}`, ...at);
      context.strokeStyle = ink, context.lineWidth = 1;
    });
    this.drawAxes(context, ink);
    this.read();
  }
  drawAxes(context, ink) {
    const { radius } = this.data, below = this.centre[1] + this.factor * radius, left = this.centre[0] - this.factor * radius;
    const marks = [-1, -0.5, 0, 0.5, 1].map((share) => share * radius);
    context.fillStyle = style("--soft"), context.strokeStyle = ink;
    for (const mark of marks) {
      const label = `${Number(mark.toPrecision(2))}`, at = this.factor * mark;
      context.fillText(label, this.centre[0] + at, below + 12);
      context.textAlign = "right";
      context.fillText(label, left - 6, this.centre[1] - at);
      context.textAlign = "center";
    }
    context.fillText("x [mm]", this.centre[0], below + 27);
    context.save();
    context.translate(left - 34, this.centre[1]);
    context.rotate(-Math.PI / 2);
    context.fillText("y [mm]", 0, 0);
    context.restore();
  }
}
