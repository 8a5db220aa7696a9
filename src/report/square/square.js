"use strict";
const root = document.documentElement;
let errors = 0;
window.addEventListener("error", (event) => { root.dataset.error = String(event.message); root.dataset.errors = ++errors; });
window.addEventListener("unhandledrejection", (event) => { root.dataset.error = String(event.reason); root.dataset.errors = ++errors; });
root.dataset.errors = "0";
const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const { width, height } = data;
const count = data.coefficients.length;

// ---- where images exist ----
// Straight lines in (ln t, ln κ) between what was measured: they lie above κ.
function kappa(t) {
  const samples = data.kappa;
  let above = samples.findIndex((sample) => sample[0] >= t);
  if (above < 0) above = samples.length - 1;
  const [bt, bk] = samples[above];
  if (above === 0) return bk;
  const [at, ak] = samples[above - 1];
  if (t >= bt || at === 0 || ak === 0) return bk;
  const way = Math.log(t / at) / Math.log(bt / at);
  return Math.exp(Math.log(ak) + way * Math.log(bk / ak));
}
const largestS = (t) => Math.min(1, data.reach / kappa(t));
const exists = (s, t) => s <= largestS(t);

// ---- numbers ----
const minus = (text) => text.replace("-", "−");
const fixed = (x, n) => minus(x.toFixed(n));
const digits = (x, n = 3) => x === 0 ? "0" : minus(Math.abs(x) < 1e-3 || Math.abs(x) >= 1e5 ? x.toExponential(n - 1) : x.toPrecision(n));
const srgb = (x) => x <= 0 ? 0 : x >= 1 ? 1 : x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;

// How much of each component is in the picture at (s, t).
function coefficients(s, t) {
  const across = data.m.map((m) => t ** m);
  const weights = data.n.flatMap((n) => across.map((b) => s ** n * b));
  return Float32Array.from(data.coefficients, (row) => row.reduce((sum, c, i) => sum + c * weights[i], 0));
}

// ---- pictures ----
function bytesOf(image) {
  const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, canvas.width, canvas.height).data;
}

// PNG of twice the height: low bytes above, high bytes below.
function component(q) {
  const bytes = bytesOf(byId(`component-${q}`));
  const out = new Int16Array(3 * width * height);
  const half = 4 * width * height;
  for (let i = 0, n = width * height; i < n; i++) {
    for (let c = 0; c < 3; c++) out[3 * i + c] = bytes[4 * i + c] | (bytes[half + 4 * i + c] << 8);
  }
  return out;
}

function exponentsOf() {
  const bytes = bytesOf(byId("exponents"));
  return Int16Array.from({ length: width * height }, (_, i) => bytes[4 * i] - 128);
}

// Standard errors of cells of pixels at the points of the grid, t by t.
function errorsOf() {
  const image = byId("errors");
  if (!image) return null;
  const bytes = bytesOf(image);
  const [across, n] = [image.naturalWidth, data.grid.length];
  const down = image.naturalHeight / (n * n);
  const at = (point, x, y, c) => {
    const byte = bytes[4 * ((point * down + Math.floor(y / data.cell)) * across + Math.floor(x / data.cell)) + c];
    return byte === 0 ? 0 : 2 ** ((byte - 128) / 8);
  };
  const cell = (x) => {
    const i = Math.min(data.grid.findLastIndex((g) => g <= x), n - 2);
    return [i, Math.min((x - data.grid[i]) / (data.grid[i + 1] - data.grid[i]), 1)];
  };
  return (s, t, x, y) => {
    const [[i, a], [j, b]] = [cell(t), cell(Math.min(s / largestS(t), 1))];
    return [0, 1, 2].map((c) =>
      (1 - a) * ((1 - b) * at(i * n + j, x, y, c) + b * at(i * n + j + 1, x, y, c)) +
      a * ((1 - b) * at((i + 1) * n + j, x, y, c) + b * at((i + 1) * n + j + 1, x, y, c)));
  };
}

// ---- drawing ----
const VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;
// Where the numbers of a pixel stand in 32-bit integers, four to a texel: its exponent, and red, green and blue of every component in as
// many bits as the largest of them needs. A fetch costs more than taking its integers apart. Widest first, each into the first
// integer with room.
function fieldsOf(components) {
  const bits = components.map((all) => 1 + Math.ceil(Math.log2(1 + all.reduce((most, x) => Math.max(most, Math.abs(x)), 0))));
  const fields = bits.flatMap((bits, q) => [0, 1, 2].map((channel) => ({ q, channel, bits })));
  fields.push({ q: -1, channel: 0, bits: 8 });
  const used = [];
  for (const field of fields.sort((a, b) => b.bits - a.bits)) {
    const found = used.findIndex((word) => word + field.bits <= 32);
    field.word = found < 0 ? used.length : found;
    field.shift = used[field.word] ?? 0;
    used[field.word] = field.shift + field.bits;
  }
  return fields;
}

function fragment(fields, texels) {
  const number = ({ word, shift, bits }) => {
    const t = `t${word >> 2}.${"xyzw"[word & 3]}`;
    return shift + bits < 32 ? `((${t} << ${32 - shift - bits}) >> ${32 - bits})` : `(${t} >> ${shift})`;
  };
  const fetch = (k) => `ivec4 t${k} = texelFetch(packed, ivec3(gl_FragCoord.xy, ${k}), 0);`;
  const term = (field) => `sum.${"rgb"[field.channel]} += c[${field.q}] * float(${number(field)});`;
  return `#version 300 es
precision highp float;
precision highp int;
precision highp isampler2DArray;
uniform isampler2DArray packed;
uniform float c[${count}];
uniform float gain;
out vec4 colour;
void main() {
  ${Array.from({ length: texels }, (_, k) => fetch(k)).join("\n  ")}
  vec3 sum = vec3(0.0);
  ${fields.filter((field) => field.q >= 0).map(term).join("\n  ")}
  float unit = intBitsToFloat((${number(fields.find((field) => field.q < 0))} + 127) << 23); // two to the exponent
  vec3 x = clamp(gain * unit * sum, 0.0, 1.0);
  // 1.055 x^(1/2.4) - 0.055 within a hundredth of a step of eight bits, without powers.
  vec3 v = sqrt(sqrt(x));
  vec3 bright = -0.06461153 + v * (0.19613581 + v * (1.12268172 + v * (-0.33550162 + v * 0.08132998)));
  colour = vec4(mix(12.92 * x, bright, step(0.0031308, x)), 1.0);
}`;
}

// Layer k of the packed texture, the lowest row first.
function packedLayer(components, exponents, fields, k) {
  const out = new Int32Array(4 * width * height);
  for (const { q, channel, bits, word, shift } of fields.filter((field) => field.word >> 2 === k)) {
    const [from, stride, first] = q < 0 ? [exponents, 1, 0] : [components[q], 3, channel];
    const mask = 2 ** bits - 1;
    for (let y = 0, i = 0; y < height; y++) {
      const row = 4 * (height - 1 - y) * width + (word & 3);
      for (let x = 0; x < width; x++, i++) out[row + 4 * x] |= (from[stride * i + first] & mask) << shift;
    }
  }
  return out;
}

// Draws with WebGL; null where there is none.
function webgl(canvas, components, exponents) {
  const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, depth: false, preserveDrawingBuffer: true });
  if (!gl || gl.getParameter(gl.MAX_TEXTURE_SIZE) < Math.max(width, height)) return null;
  const fields = fieldsOf(components);
  const texels = Math.ceil((1 + Math.max(...fields.map((field) => field.word))) / 4);
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, fragment(fields, texels)]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  gl.useProgram(program);
  gl.bindTexture(gl.TEXTURE_2D_ARRAY, gl.createTexture());
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D_ARRAY, filter, gl.NEAREST);
  gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA32I, width, height, texels);
  for (let k = 0; k < texels; k++) {
    const layer = packedLayer(components, exponents, fields, k);
    gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, k, width, height, 1, gl.RGBA_INTEGER, gl.INT, layer);
  }
  const uniform = (name) => gl.getUniformLocation(program, name);
  gl.uniform1i(uniform("packed"), 0);
  const [c, gain] = [uniform("c"), uniform("gain")];
  gl.viewport(0, 0, width, height);
  if (gl.getError() !== gl.NO_ERROR) return null;
  const read = (x, y) => {
    const rgba = new Uint8Array(4);
    gl.readPixels(x, height - 1 - y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
    return rgba;
  };
  const draw = (weights, exposure) => {
    gl.uniform1fv(c, weights);
    gl.uniform1f(gain, 2 ** exposure);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  };
  return { name: "webgl2", draw, read };
}

// The same without WebGL, some frames a second.
function plain(canvas, value) {
  const context = canvas.getContext("2d", { willReadFrequently: true });
  const out = new ImageData(width, height);
  const draw = (weights, exposure) => {
    const gain = 2 ** exposure;
    for (let i = 0, n = width * height; i < n; i++) {
      const rgb = value(weights, i);
      for (let k = 0; k < 3; k++) out.data[4 * i + k] = 255 * srgb(gain * rgb[k]);
      out.data[4 * i + 3] = 255;
    }
    context.putImageData(out, 0, 0);
  };
  return { name: "2d", draw, read: (x, y) => context.getImageData(x, y, 1, 1).data };
}

// ---- the square ----
const CELLS = 7;
// A contact sheet: small pictures from all over the square, to see where the point leads.
function contactSheet(weightsAt, value, size) {
  const sheet = new OffscreenCanvas(CELLS * size, CELLS * size);
  const context = sheet.getContext("2d");
  const gain = 2 ** state.exposure;
  const side = Math.min(width, height);
  const [left, top] = [(width - side) / 2, (height - side) / 2];
  // Means over a few pixels each: one alone would be all noise.
  const taps = Math.max(1, Math.min(4, Math.floor(side / size)));
  for (let v = 0; v < CELLS; v++) for (let u = 0; u < CELLS; u++) {
    const [s, t] = [u / (CELLS - 1), 1 - v / (CELLS - 1)];
    if (!exists(s, t)) continue;
    const [weights, out] = [weightsAt(s, t), new ImageData(size, size)];
    for (let y = 0; y < size; y++) for (let x = 0; x < size; x++) {
      const sum = [0, 0, 0];
      for (let b = 0; b < taps; b++) for (let a = 0; a < taps; a++) {
        const px = Math.floor(left + (x + (a + 0.5) / taps) * side / size);
        const py = Math.floor(top + (y + (b + 0.5) / taps) * side / size);
        const rgb = value(weights, py * width + px);
        for (let k = 0; k < 3; k++) sum[k] += Math.min(gain * rgb[k], 1) / (taps * taps);
      }
      out.data.set([255 * srgb(sum[0]), 255 * srgb(sum[1]), 255 * srgb(sum[2]), 255], 4 * (y * size + x));
    }
    context.putImageData(out, u * size, v * size);
  }
  return sheet;
}

function hatch(context) {
  const tile = new OffscreenCanvas(12, 12);
  const c = tile.getContext("2d");
  c.fillStyle = "#1c0f0bdd";
  c.fillRect(0, 0, 12, 12);
  c.strokeStyle = "#d9733c99";
  c.lineWidth = 1.5;
  for (const d of [-12, 0, 12]) { c.beginPath(); c.moveTo(d - 2, 14); c.lineTo(d + 14, -2); c.stroke(); }
  return context.createPattern(tile, "repeat");
}

const state = { s: 1, t: 0, exposure: 0, x: -1, y: -1 };
const WAYS = {
  "straight": [[0, 1], [1, 0]],
  "shadowless": [[0, 1], [1, 1], [1, 0]],
  "one-bounce": [[0, 1], [0, 0], [1, 0]],
};

function start() {
  const components = Array.from({ length: count }, (_, q) => component(q));
  const exponents = exponentsOf();
  const error = errorsOf();
  const value = (weights, i) => {
    const sum = [0, 0, 0];
    for (let q = 0; q < count; q++) for (let k = 0; k < 3; k++) sum[k] += weights[q] * components[q][3 * i + k];
    const scale = 2 ** exponents[i];
    return sum.map((x) => scale * x);
  };
  const picture = byId("picture");
  [picture.width, picture.height] = [width, height];
  const drawer = webgl(picture, components, exponents) ?? plain(picture, value);
  root.dataset.drawer = drawer.name;

  byId("facts").textContent = `${data.scene} · ${width} × ${height} · ${data.passes} passes` +
    (data.seconds ? ` · one run of ${digits(data.seconds)} s` : "");
  const whole = exists(1, 1);
  byId("about").textContent = "Every picture of the square is a sum of the same light, kept apart by its number n of reflections and m of " +
    "straight crossings: L(s, t) = Σ sⁿ tᵐ L[n][m]. " +
    (whole ? "" : "In the hatched part light multiplies faster than it is lost, and there is no picture. ") +
    `This page adds up ${count} components and is within ${digits(100 * data.off, 2)} % of the atlas (root mean square); ` +
    `error bars are those of cells of ${data.cell} × ${data.cell} pixels. Made by halflight.`;

  const square = byId("square");
  // The point runs over the whole square, the small pictures over their centres.
  const places = (side) => {
    const [inset, span] = [side / (2 * CELLS), side * (CELLS - 1) / CELLS];
    return [(s) => inset + span * s, (t) => inset + span * (1 - t)];
  };
  // What does not move is drawn once for each size and exposure.
  const ground = byId("ground");
  let groundExposure = NaN;
  const drawGround = (side) => {
    [ground.width, ground.height] = [side, side];
    const context = ground.getContext("2d");
    const sheet = contactSheet(coefficients, value, 40);
    const unit = side / 320;
    context.imageSmoothingQuality = "high";
    context.drawImage(sheet, 0, 0, side, side);
    context.fillStyle = "#10121466";
    context.fillRect(0, 0, side, side);
    const [px, py] = places(side);
    if (!whole) {
      context.beginPath();
      context.moveTo(side, 0);
      for (let i = 0; i <= 64; i++) {
        const t = 1 - i / 64;
        const s = largestS(t);
        if (s >= 1) { context.lineTo(side, py(t)); break; }
        if (i === 0) context.lineTo(px(s), 0);
        context.lineTo(px(s), py(t));
      }
      context.closePath();
      context.fillStyle = hatch(context);
      context.fill();
      context.strokeStyle = "#ff9a5a";
      context.lineWidth = 1.5 * unit;
      context.stroke();
    }
    context.font = `600 ${12 * unit}px system-ui, "DejaVu Sans", sans-serif`;
    context.lineWidth = 3 * unit;
    for (const [name, s, t] of [["local", 0, 1], ["shadowless", 1, 1], ["one bounce", 0, 0], ["global", 1, 0]]) {
      context.textAlign = s ? "right" : "left";
      context.textBaseline = t ? "top" : "bottom";
      const [x, y] = [s ? side - 7 * unit : 7 * unit, t ? 7 * unit : side - 7 * unit];
      context.strokeStyle = "#000b";
      context.strokeText(name, x, y);
      context.fillStyle = "#fff";
      context.fillText(name, x, y);
    }
  };
  const drawSquare = () => {
    const wide = square.clientWidth || 320;
    const side = Math.round(wide * devicePixelRatio);
    if (ground.width !== side || groundExposure !== state.exposure) {
      drawGround(side);
      groundExposure = state.exposure;
    }
    const [px, py] = places(wide);
    byId("point").style.transform = `translate(${px(state.s)}px, ${py(state.t)}px)`;
  };

  const probe = () => {
    const { s, t, x, y } = state;
    if (x < 0) return;
    const rgb = value(coefficients(s, t), y * width + x);
    const off = error ? error(s, t, x, y) : null;
    root.dataset.value = rgb.map((v) => v.toPrecision(7)).join(" ");
    root.dataset.shown = Array.from(drawer.read(x, y)).slice(0, 3).join(" ");
    if (off) root.dataset.off = off.map((v) => v.toPrecision(4)).join(" ");
    const channel = (k) => `<b class="${"rgb"[k]}">${digits(rgb[k])}</b>` + (off ? ` ± ${digits(off[k], 2)}` : "");
    byId("probe").innerHTML = exists(s, t) ?
      `<span>(${x}, ${y})</span> &nbsp;${[0, 1, 2].map(channel).join(" &nbsp; ")} &nbsp;<span>W m⁻² sr⁻¹</span>` :
      "No image, no value.";
  };

  let queued = false;
  const show = () => {
    queued = false;
    const { s, t, exposure } = state;
    const there = exists(s, t);
    // Where there is no image the last one before the frontier stays, below a note.
    drawer.draw(coefficients(there ? s : largestS(t), t), exposure);
    byId("none").hidden = there;
    picture.style.filter = there ? "" : "grayscale(1) brightness(.35)";
    if (!there) {
      byId("none").textContent = `No image exists here: each reflection multiplies light by ${digits(s * kappa(t))}. ` +
        `At this height images end at s = ${fixed(Math.floor(100 * largestS(t)) / 100, 2)}.`;
    }
    byId("where").innerHTML = `<b>s = ${fixed(s, 2)}</b> inter-reflection · <b>t = ${fixed(t, 2)}</b> shadowless`;
    square.setAttribute("aria-valuenow", s.toFixed(2));
    square.setAttribute("aria-valuetext", `s ${s.toFixed(2)}, t ${t.toFixed(2)}${there ? "" : ", no image"}`);
    byId("stops").textContent = `${exposure > 0 ? "+" : ""}${fixed(exposure, 1)}`;
    document.querySelectorAll("#presets button").forEach((button) => {
      button.classList.toggle("here", Number(button.dataset.s) === s && Number(button.dataset.t) === t);
      button.disabled = !exists(Number(button.dataset.s), Number(button.dataset.t));
    });
    root.dataset.s = s;
    root.dataset.t = t;
    root.dataset.exists = there ? "1" : "0";
    drawSquare();
    probe();
  };
  const update = (change) => {
    Object.assign(state, change);
    state.s = Math.min(Math.max(state.s, 0), 1);
    state.t = Math.min(Math.max(state.t, 0), 1);
    if (!queued) { queued = true; requestAnimationFrame(show); }
  };
  let keep = 0;
  const remember = () => {
    clearTimeout(keep);
    keep = setTimeout(() => {
      const { s, t, exposure, x, y } = state;
      const probed = x >= 0 ? `&x=${x}&y=${y}` : "";
      history.replaceState(null, "", `#s=${+s.toFixed(4)}&t=${+t.toFixed(4)}&exposure=${+exposure.toFixed(2)}${probed}`);
    }, 300);
  };

  // ---- the walk ----
  let [walking, begun] = [0, 0];
  const stop = () => {
    cancelAnimationFrame(walking);
    walking = 0;
    byId("play").setAttribute("aria-pressed", "false");
    byId("play").textContent = "▶ Local ↔ global";
    remember();
  };
  const step = (now) => {
    const way = WAYS[byId("way").value];
    // To and fro in 12 s, slowly at both ends.
    const phase = 0.5 - 0.5 * Math.cos(2 * Math.PI * (now - begun) / 12000);
    const along = phase * (way.length - 1);
    const i = Math.min(Math.floor(along), way.length - 2);
    const [a, b] = [way[i], way[i + 1]];
    const t = a[1] + (along - i) * (b[1] - a[1]);
    update({ s: Math.min(a[0] + (along - i) * (b[0] - a[0]), 0.97 * largestS(t) + (largestS(t) >= 1 ? 0.03 : 0)), t });
    walking = requestAnimationFrame(step);
  };
  const play = () => {
    if (walking) { stop(); return; }
    begun = performance.now();
    walking = requestAnimationFrame(step);
    byId("play").setAttribute("aria-pressed", "true");
    byId("play").textContent = "❚❚ Stop";
  };
  const go = (change) => { if (walking) stop(); update(change); remember(); };

  // ---- hands ----
  const drag = (event) => {
    const box = square.getBoundingClientRect();
    const place = (x) => (x * CELLS - 0.5) / (CELLS - 1);
    go({ s: place((event.clientX - box.left) / box.width), t: 1 - place((event.clientY - box.top) / box.height) });
  };
  square.addEventListener("pointerdown", (event) => { square.setPointerCapture(event.pointerId); drag(event); });
  square.addEventListener("pointermove", (event) => { if (event.buttons & 1) drag(event); });
  const point = (event) => {
    const box = picture.getBoundingClientRect();
    const scale = Math.min(box.width / width, box.height / height);
    const x = Math.floor((event.clientX - box.left - (box.width - scale * width) / 2) / scale);
    const y = Math.floor((event.clientY - box.top - (box.height - scale * height) / 2) / scale);
    if (x < 0 || y < 0 || x >= width || y >= height) return;
    Object.assign(state, { x, y });
    probe();
  };
  picture.addEventListener("pointermove", point);
  picture.addEventListener("pointerdown", (event) => { point(event); remember(); });
  const CORNERS = { 1: [0, 1], 2: [1, 1], 3: [0, 0], 4: [1, 0] };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT)$/.test(event.target.tagName)) return;
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (arrow && event.target === picture) {
      const [x, y] = state.x < 0 ? [width >> 1, height >> 1] : [state.x + arrow[0], state.y - arrow[1]];
      Object.assign(state, { x: Math.min(Math.max(x, 0), width - 1), y: Math.min(Math.max(y, 0), height - 1) });
      probe();
    } else if (arrow) {
      const by = event.shiftKey ? 0.1 : 0.01;
      const to = (x, d) => Math.round(100 * (x + by * d)) / 100;
      go({ s: to(state.s, arrow[0]), t: to(state.t, arrow[1]) });
    } else if (CORNERS[event.key]) {
      go({ s: CORNERS[event.key][0], t: CORNERS[event.key][1] });
    } else if (event.key === " " && event.target.tagName !== "BUTTON") {
      play();
    } else {
      return;
    }
    event.preventDefault();
  });
  document.querySelectorAll("#presets button").forEach((button) =>
    button.addEventListener("click", () => go({ s: Number(button.dataset.s), t: Number(button.dataset.t) })));
  byId("play").addEventListener("click", play);
  byId("exposure").addEventListener("input", (event) => { update({ exposure: Number(event.target.value) }); remember(); });

  // ---- the address keeps the point ----
  const recall = () => {
    const hash = new URLSearchParams(location.hash.slice(1));
    const number = (name, otherwise) => hash.has(name) && Number.isFinite(Number(hash.get(name))) ? Number(hash.get(name)) : otherwise;
    const inside = (x, n) => Math.min(Math.max(Math.round(x), -1), n - 1);
    update({ s: number("s", state.s), t: number("t", state.t), exposure: number("exposure", state.exposure),
      x: inside(number("x", state.x), width), y: inside(number("y", state.y), height) });
    byId("exposure").value = String(state.exposure);
  };
  window.addEventListener("hashchange", recall);
  // The average half-way into the square is shown at two fifths of white.
  state.exposure = Math.round(10 * Math.log2(0.4 / data.mean)) / 10 || 0;
  state.exposure = Math.min(Math.max(state.exposure, -6), 6);
  recall();
  new ResizeObserver(() => update({})).observe(square);
  show();
  root.dataset.ready = "1";
}
window.addEventListener("load", start);
