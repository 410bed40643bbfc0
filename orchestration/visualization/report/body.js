// The body in space, drawn in parallel projection. In that projection the outline of a tube is its centreline drawn as
// wide as the tube, so lines are enough. Colours mean temperatures and are not shaded.
"use strict";
const page = JSON.parse(document.getElementById("data").textContent);
const element = (id) => document.getElementById(id);
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const floats = (text) => new Float32Array(bytes(text));
const scaled = ({ scale, data }) => Float32Array.from(new Int16Array(bytes(data)), (n) => n * scale);
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const palette = new Uint8Array(bytes(page.colours));

function colourIndex(celsius) {
  const [low, high] = page.range;
  return Math.max(0, Math.min(255, Math.round((255 * (celsius - low)) / (high - low))));
}
function colour(celsius) {
  const k = 3 * colourIndex(celsius);
  return `rgb(${palette[k]}, ${palette[k + 1]}, ${palette[k + 2]})`;
}
// Makes the canvas as fine as the screen; returns its context in units of CSS pixels.
function prepare(canvas) {
  const fine = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * fine)) canvas.width = Math.round(width * fine);
  if (canvas.height !== Math.round(height * fine)) canvas.height = Math.round(height * fine);
  const context = canvas.getContext("2d");
  context.setTransform(fine, 0, 0, fine, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height, fine };
}

class Shape {
  constructor({ p, d1, d2, stations }, radii) {
    this.p = scaled(p), this.d1 = scaled(d1), this.d2 = scaled(d2), this.stations = stations, this.radii = radii;
    this.last = stations - 1;
  }
  // The point with offsets a, b in the cross-section of a station.
  at(row, station, a = 0, b = 0) {
    const k = 3 * (row * this.stations + station);
    return [0, 1, 2].map((c) => this.p[k + c] + a * this.d1[k + c] + b * this.d2[k + c]);
  }
}

// One manipulator: its shape, TCAs and what it carries.
class Body {
  constructor(data) {
    Object.assign(this, data);
    this.shape = new Shape(data.shape, data.radii);
    this.centre = data.payload && scaled(data.payload.centre);
    this.temperatures = scaled(data.temperatures);
  }
}

class BodyView {
  constructor(canvas, data, picture) {
    this.canvas = canvas, this.data = data, this.picture = picture; // picture(row): canvas of the cross-section, or null
    this.bodies = data.manipulators.map((one) => new Body(one));
    this.others = data.others.map((one) => new Shape(one, one.radii));
    this.blocks = data.blocks.map(({ name, corners }) => ({ name, corners: scaled(corners) }));
    this.row = 0;
    this.reset();
    this.layer = document.createElement("canvas");
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) this.turn(-0.01 * event.movementX, 0.01 * event.movementY);
    });
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("keydown", (event) => {
      const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
      if (turns[event.key]) this.turn(...turns[event.key]);
      else if (event.key === "+" || event.key === "-") this.zoom *= event.key === "+" ? 1.15 : 1 / 1.15;
      else if (event.key === "0") this.reset();
      else return;
      event.preventDefault();
      this.draw(this.row);
    });
  }
  reset() {
    this.azimuth = this.data.azimuth, this.elevation = 0.32, this.zoom = 1;
  }
  turn(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = Math.max(-1.5, Math.min(1.5, this.elevation + elevation));
    this.draw(this.row);
  }
  // Screen coordinates and depth of a point [mm]; larger depths are nearer.
  project([x, y, z]) {
    const [u, v, w] = this.direction([x - this.centre[0], y - this.centre[1], z - this.centre[2]]);
    return [this.origin[0] + u, this.origin[1] + v, w];
  }
  direction([x, y, z]) {
    const ca = Math.cos(this.azimuth), sa = Math.sin(this.azimuth), ce = Math.cos(this.elevation), se = Math.sin(this.elevation);
    const f = this.factor, near = ca * x + sa * y;
    return [f * (ca * y - sa * x), f * (se * near - ce * z), ce * near + se * z];
  }
  // Scale and centre, so that the box around the whole motion fits.
  fit(width, height) {
    const { low, high } = this.data;
    const axes = [0, 1, 2].map((c) => [Math.min(low[c], c < 2 ? -10 : 0), Math.max(high[c], c < 2 ? 10 : 0)]);
    this.axes = axes.map(([a, b], c) => [10 * Math.floor(a / 10 + 0.05) * (c < 2 || a < -0.5), 10 * Math.ceil(b / 10 - 0.05)]);
    this.centre = this.axes.map(([a, b]) => 0.5 * (a + b));
    this.factor = 1, this.origin = [0, 0];
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => this.project(this.axes.map((ends, c) => ends[(k >> c) & 1])));
    const [x, y] = [0, 1].map((c) => corners.map((p) => p[c]));
    const span = [Math.max(...x) - Math.min(...x), Math.max(...y) - Math.min(...y)];
    this.factor = this.zoom * Math.min((width - 70) / span[0], (height - 50) / span[1]);
    const middle = [x, y].map((values) => 0.5 * (Math.max(...values) + Math.min(...values)));
    this.origin = [width / 2 - this.factor * middle[0], height / 2 - this.factor * middle[1] - 6];
  }
  draw(row) {
    this.row = row;
    const { context, width, height, fine } = prepare(this.canvas);
    if (!width) return;
    this.fit(width, height);
    this.ink = style("--ink"), this.soft = style("--soft"), this.line = style("--line");
    this.drawFloor(context);
    for (const body of this.bodies) this.drawPath(context, body, row);
    for (const body of this.bodies) this.drawFlesh(context, body, row, width, height, fine);
    for (const other of this.others) this.drawOutline(context, other, row, width, height, fine);
    this.drawInside(context, row);
    if (this.data.names) for (const body of this.bodies) this.drawName(context, body, row);
    this.drawGravity(context, row, width);
  }
  stroke(context, points, colour, width) {
    context.strokeStyle = colour, context.lineWidth = width;
    context.beginPath();
    points.forEach((p, k) => (k ? context.lineTo(p[0], p[1]) : context.moveTo(p[0], p[1])));
    context.stroke();
  }
  text(context, text, [x, y], align = "center") {
    context.font = "12px system-ui, 'DejaVu Sans', sans-serif";
    context.fillStyle = this.soft, context.textAlign = align, context.textBaseline = "middle";
    context.fillText(text, x, y);
  }
  drawFloor(context) {
    const [[x0, x1], [y0, y1], [z0, z1]] = this.axes;
    const range = (a, b) => Array.from({ length: Math.round((b - a) / 10) + 1 }, (_, k) => a + 10 * k);
    for (const x of range(x0, x1)) this.stroke(context, [[x, y0, z0], [x, y1, z0]].map((p) => this.project(p)), this.line, 1);
    for (const y of range(y0, y1)) this.stroke(context, [[x0, y, z0], [x1, y, z0]].map((p) => this.project(p)), this.line, 1);
    // Labels stand at the edges of the floor that are nearest to the viewer, outside.
    const nearX = Math.cos(this.azimuth) > 0 ? x1 : x0, nearY = Math.sin(this.azimuth) > 0 ? y1 : y0;
    const outX = nearX === x1 ? 4 : -4, outY = nearY === y1 ? 4 : -4;
    const every = (values) => (values.length > 6 ? values.filter((v) => v % 20 === 0) : values);
    for (const x of every(range(x0, x1))) this.text(context, `${x}`, this.project([x, nearY + outY, z0]));
    for (const y of every(range(y0, y1))) this.text(context, `${y}`, this.project([nearX + outX, y, z0]));
    this.text(context, "x [mm]", this.project([0.5 * (x0 + x1), nearY + 2.6 * outY, z0]));
    this.text(context, "y [mm]", this.project([nearX + 2.6 * outX, 0.5 * (y0 + y1), z0]));
    const corner = [[x0, y0], [x0, y1], [x1, y0], [x1, y1]].sort((a, b) => this.project([...a, z0])[0] - this.project([...b, z0])[0])[0];
    this.stroke(context, [[...corner, z0], [...corner, z1]].map((p) => this.project(p)), this.line, 1);
    for (const z of every(range(z0, z1)).slice(1)) {
      const [u, v] = this.project([...corner, z]);
      this.stroke(context, [[u - 4, v], [u, v]], this.soft, 1);
      this.text(context, `${z}`, [u - 7, v], "right");
    }
    const [u, v] = this.project([...corner, z1]);
    this.text(context, "z [mm]", [u, v - 14]);
  }
  drawPath(context, { shape }, row) {
    const points = page.times.map((_, k) => this.project(shape.at(k, shape.last)));
    context.setLineDash([2, 3]);
    this.stroke(context, points, this.soft, 1);
    context.setLineDash([]);
    this.stroke(context, points.slice(0, row + 1), this.soft, 2);
  }
  ring(context, shape, row, station, radius) {
    context.beginPath();
    for (let k = 0; k <= 40; ++k) {
      const angle = (2 * Math.PI * k) / 40;
      const [x, y] = this.project(shape.at(row, station, radius * Math.cos(angle), radius * Math.sin(angle)));
      k ? context.lineTo(x, y) : context.moveTo(x, y);
    }
  }
  // An opaque body on a canvas of its own, which is then laid over everything with little opacity: no seams are seen.
  onLayer(width, height, fine, draw) {
    this.layer.width = Math.round(width * fine), this.layer.height = Math.round(height * fine);
    const context = this.layer.getContext("2d");
    context.setTransform(fine, 0, 0, fine, 0, 0);
    context.lineJoin = "round";
    draw(context);
    return this.layer;
  }
  // The outline of a tube whose radius changes along it: a quadrangle for each piece, neighbours share corners.
  silhouette(context, shape, row, colour, extra = 0) {
    const last = shape.last;
    const points = Array.from({ length: shape.stations }, (_, k) => this.project(shape.at(row, k)));
    const sides = points.map(([x, y], k) => {
      const [x0, y0] = points[Math.max(0, k - 2)], [x1, y1] = points[Math.min(last, k + 2)];
      const length = Math.hypot(x1 - x0, y1 - y0) || 1, width = shape.radii[k] * this.factor + 0.5 * extra;
      const [u, v] = [(-(y1 - y0) * width) / length, ((x1 - x0) * width) / length];
      return [[x + u, y + v], [x - u, y - v]];
    });
    context.fillStyle = context.strokeStyle = colour;
    context.lineWidth = 0.7; // closes the seams between the pieces
    for (let k = 1; k <= last; ++k) {
      const [[a, b], [c, d]] = [sides[k - 1], sides[k]];
      context.beginPath();
      [a, c, d, b].forEach((p, n) => (n ? context.lineTo(...p) : context.moveTo(...p)));
      context.closePath();
      context.fill(), context.stroke();
    }
    context.lineWidth = extra;
    for (const end of [0, last]) {
      this.ring(context, shape, row, end, shape.radii[end]);
      context.fill();
      if (extra) context.stroke();
    }
  }
  drawFlesh(context, { shape, breaks }, row, width, height, fine) {
    const layer = this.onLayer(width, height, fine, (own) => this.silhouette(own, shape, row, style("--flesh")));
    context.globalAlpha = 0.4;
    context.drawImage(layer, 0, 0, width, height);
    const ring = (k) => this.ring(context, shape, row, k, shape.radii[k]);
    context.globalAlpha = 0.45;
    context.strokeStyle = this.soft, context.lineWidth = 0.8;
    for (let k = 0; k < shape.stations; k += 6) ring(k), context.stroke();
    context.globalAlpha = 1;
    context.strokeStyle = this.ink, context.lineWidth = 1.4;
    for (const k of breaks) for (const side of [k - 1, k]) ring(side), context.stroke();
  }
  drawOutline(context, other, row, width, height, fine) {
    const layer = this.onLayer(width, height, fine, (own) => {
      this.silhouette(own, other, row, this.ink, 2);
      own.globalCompositeOperation = "destination-out";
      this.silhouette(own, other, row, "#000", 0);
    });
    context.drawImage(layer, 0, 0, width, height);
  }
  // TCAs in short pieces, cross-sections at the tips, payloads and faces of blocks, the farthest first.
  drawInside(context, row) {
    const pieces = this.bodies.flatMap((body) => this.piecesOf(context, body, row));
    for (const block of this.blocks) pieces.push(...this.facesOf(context, block, row));
    for (const piece of pieces.sort((a, b) => a.depth - b.depth)) piece.draw();
    context.lineCap = "butt";
  }
  piecesOf(context, body, row) {
    const { shape, routes, tcaRadius, temperatures } = body, pieces = [];
    routes.forEach((route, i) => {
      const points = route.points.map(([a, b], k) => this.project(shape.at(row, route.first + k, a, b)));
      const fill = colour(temperatures[row * routes.length + i]), width = 2 * tcaRadius[i] * this.factor;
      for (let k = 1; k < points.length; ++k) {
        const ends = points.slice(k - 1, k + 1);
        pieces.push({ depth: 0.5 * (ends[0][2] + ends[1][2]), draw: () => this.drawPiece(context, ends, fill, width) });
      }
    });
    const tip = this.project(shape.at(row, shape.last));
    pieces.push({ depth: tip[2] + shape.radii[shape.last], draw: () => this.drawCap(context, body, row, tip) });
    if (body.payload) {
      const at = this.project([0, 1, 2].map((c) => body.centre[3 * row + c]));
      pieces.push({ depth: at[2], draw: () => this.drawPayload(context, body.payload, at) });
    }
    return pieces;
  }
  drawPiece(context, ends, fill, width) {
    context.lineCap = "butt";
    this.stroke(context, ends, this.ink, width + 1.6);
    context.lineCap = "round";
    this.stroke(context, ends, fill, width);
  }
  facesOf(context, { name, corners }, row) {
    const points = Array.from({ length: 8 }, (_, n) => this.project([0, 1, 2].map((c) => corners[24 * row + 3 * n + c])));
    const mean = (face, c) => face.reduce((sum, n) => sum + points[n][c], 0) / 4;
    const faces = this.data.faces.map((face) => ({
      depth: mean(face, 2),
      draw: () => this.drawFace(context, face.map((n) => points[n])),
    }));
    const nearest = Math.max(...points.map((p) => p[2])), low = points.reduce((a, b) => (b[1] > a[1] ? b : a));
    faces.push({ depth: nearest + 1, draw: () => this.text(context, name, [mean([0, 3, 4, 7], 0), low[1] + 12]) });
    return faces;
  }
  drawFace(context, corners) {
    context.beginPath();
    corners.forEach((p, n) => (n ? context.lineTo(p[0], p[1]) : context.moveTo(p[0], p[1])));
    context.closePath();
    context.fillStyle = this.soft, context.strokeStyle = this.ink, context.lineWidth = 1, context.lineJoin = "round";
    context.globalAlpha = 0.4, context.fill(), (context.globalAlpha = 1), context.stroke();
  }
  drawName(context, { name, shape }, row) {
    const [x, y] = this.project(shape.at(row, 0));
    this.text(context, name, [x, y + shape.radii[0] * this.factor * 0.5 + 14]);
  }
  drawPayload(context, { radius, label }, [x, y]) {
    const size = radius * this.factor;
    context.beginPath();
    context.arc(x, y, size, 0, 2 * Math.PI);
    context.fillStyle = this.soft, context.strokeStyle = this.ink, context.lineWidth = 1;
    context.globalAlpha = 0.85, context.fill(), (context.globalAlpha = 1), context.stroke();
    this.text(context, label, [x + size + 5, y], "left");
  }
  drawCap(context, { shape, section }, row, tip) {
    const last = shape.last, k = 3 * (row * shape.stations + last), { d1, d2, radii } = shape, R = radii[last];
    const [u, v] = [d1, d2].map((d) => this.direction([R * d[k], R * d[k + 1], R * d[k + 2]]));
    const picture = section && this.picture(row);
    if (picture && u[0] * v[1] - u[1] * v[0] < 0) { // the tip's face is seen: x to the right, y up
      context.save();
      context.transform(u[0], u[1], v[0], v[1], tip[0], tip[1]);
      context.beginPath();
      context.arc(0, 0, 1, 0, 2 * Math.PI);
      context.clip();
      context.drawImage(picture, -1, -1, 2, 2);
      context.restore();
    }
    this.ring(context, shape, row, last, R);
    context.strokeStyle = this.ink, context.lineWidth = 1;
    context.stroke();
  }
  drawGravity(context, row, width) {
    const { gravity } = this.data;
    if (!gravity.length) return;
    const g = gravity[Math.min(row, gravity.length - 1)], size = Math.hypot(...g);
    if (!size) return;
    const [x, y] = this.direction(g.map((c) => c / size)).map((c) => (46 * c) / this.factor);
    const from = [width - 70 - x / 2, 58 - y / 2], to = [from[0] + x, from[1] + y], angle = Math.atan2(y, x);
    const barb = (turn) => [to[0] - 9 * Math.cos(angle + turn), to[1] - 9 * Math.sin(angle + turn)];
    this.stroke(context, [from, to], this.ink, 2);
    this.stroke(context, [barb(0.45), to, barb(-0.45)], this.ink, 2);
    this.text(context, `g = ${Number(size.toPrecision(3))} m/s²`, [width - 70, 16]);
  }
}
