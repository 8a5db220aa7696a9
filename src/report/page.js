"use strict";
const root = document.documentElement;
let errors = 0;
window.addEventListener("error", (event) => { root.dataset.error = String(event.message); root.dataset.errors = ++errors; });
window.addEventListener("unhandledrejection", (event) => { root.dataset.error = String(event.reason); root.dataset.errors = ++errors; });
root.dataset.errors = "0";
const data = JSON.parse(document.getElementById("data").textContent);

// ---- numbers ----
const minus = (text) => text.replace("-", "−");
const digits = (x, n = 3) => x === null ? "–" : minus(x !== 0 && (Math.abs(x) < 1e-3 || Math.abs(x) >= 1e5) ? x.toExponential(n - 1) : String(Number(x.toPrecision(n))));
const fixed = (x, n) => x === null ? "–" : minus(x.toFixed(n));
const interval = (i, show) => i ? `${show(i.value)} <small>[${show(i.low)}, ${show(i.high)}]</small>` : "–";
const percent = (x, n = 1) => x === null ? "–" : minus(`${(100 * x).toFixed(n)} %`);
const escaped = (text) => text.replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c]);
const named = (method) => `<span class="name ${method}">${method}</span>`;
// Roles are said, because on a narrow page the style makes blocks of rows and that takes what they mean from them.
const table = (element, head, rows) => {
  const heads = head.map((cell) => `<th role="columnheader">${cell}</th>`).join("");
  const label = (i) => head[i].replace(/<.*?>/g, "");
  const row = (cells) => `<tr role="row">${cells.map((cell, i) => `<td role="cell" data-label="${label(i)}"><span>${cell}</span></td>`).join("")}</tr>`;
  element.setAttribute("role", "table");
  element.innerHTML = `<thead role="rowgroup"><tr role="row">${heads}</tr></thead><tbody role="rowgroup">${rows.map(row).join("")}</tbody>`;
};

function describe() {
  const { seeds, budgets, threads } = data;
  document.getElementById("facts").textContent = `${data.program}: ${data.methods.join(", ")}; ${data.width}×${data.height} pixels, ` +
    `${seeds.length} seeds, budgets ${budgets.map((b) => digits(b)).join(", ")} s, ${threads} thread${threads === 1 ? "" : "s"}. ` +
    "Medians over seeds; intervals are 95 %, bootstrap over seeds.";
  document.getElementById("definitions").innerHTML = data.definitions.map((line) => `<li>${escaped(line)}</li>`).join("");
  document.getElementById("command").textContent = data.command;
}

function tables(section, scene) {
  const { reference, mask } = scene;
  const bias = reference.own_error.bias;
  const biasWords = bias === null ? "its bias is not known" : bias === 0 && reference.method !== "photon" ? "no bias" : `bias at most ${digits(bias)}`;
  const noisy = reference.too_noisy_for;
  section.querySelector(".about").innerHTML = `Reference: ${escaped(reference.origin)}; ${reference.passes} passes, ${digits(reference.seconds)} s; ` +
    `its own error, as relMSE: noise ${digits(reference.own_error.noise)} (what it adds, ${digits(reference.noise_taken_off)}, is taken off), ${biasWords}; ` +
    `what may be left of both is ${digits(reference.margin)} times below the smallest error measured. ` +
    `Left out: ${percent(mask.share)} of the pixels (${escaped(mask.rule)}).` +
    (noisy.length ? `</p><p class="warning">Reference too noisy for ${escaped(noisy.join(", "))}.` : "");
  const ahead = scene.pairs.map((pair) => [`${named(pair.a)} against ${named(pair.b)}`, `${fixed(pair.seconds, 1)} s`,
    interval(pair.error_ratio, (x) => digits(x)), digits(pair.relmse),
    (pair.time_relation === "=" ? "" : `${pair.time_relation} `) + interval(pair.time_ratio, (x) => digits(x))]);
  table(section.querySelector(".pairs"), ["", "at equal time", "error ratio", "at equal relMSE", "time ratio"], ahead);
  const methods = scene.curves.map((curve) => {
    const last = curve.points[curve.points.length - 1];
    return [named(curve.method), `${digits(curve.setup_seconds, 2)} s`, `${fixed(last.seconds, 1)} s`, digits(last.passes),
      `${digits(last.relmse)} <small>[${digits(last.low)}, ${digits(last.high)}]</small>${last.reference_too_noisy ? " <small>reference too noisy</small>" : ""}`,
      fixed(last.flip, 4), percent(last.relative_bias, 2), interval(curve.slope, (x) => fixed(x, 2))];
  });
  table(section.querySelector(".methods"), ["", "set-up", "time", "passes", "relMSE <small>80 % band</small>", "FLIP", "bias", "slope"], methods);
}

// ---- pictures ----
// PNG of twice the height: mantissas above; below, red: the exponent, green: left out.
function decode(image) {
  const [width, height] = [image.naturalWidth, image.naturalHeight / 2];
  const canvas = new OffscreenCanvas(width, 2 * height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  const bytes = context.getImageData(0, 0, width, 2 * height).data;
  const [linear, leftOut] = [new Float32Array(3 * width * height), new Uint8Array(width * height)];
  for (let i = 0, n = width * height; i < n; i++) {
    const below = 4 * (n + i);
    const exponent = bytes[below];
    const scale = exponent === 255 ? NaN : exponent === 0 ? 0 : 2 ** (exponent - 128) / 256;
    for (let c = 0; c < 3; c++) linear[3 * i + c] = scale * bytes[4 * i + c];
    leftOut[i] = bytes[below + 1];
  }
  return { width, height, linear, leftOut };
}

const srgb = (x) => x <= 0 ? 0 : x >= 1 ? 255 : 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const mix = (stops, at) => {
  const place = Math.min(Math.max(at, 0), 1) * (stops.length - 1);
  const i = Math.min(Math.floor(place), stops.length - 2);
  return stops[i].map((c, k) => c + (stops[i + 1][k] - c) * (place - i));
};
const SIGNED = [[8, 48, 107], [66, 146, 198], [245, 245, 245], [239, 101, 72], [127, 0, 0]];
const SIZE = [[0, 0, 4], [59, 15, 112], [140, 41, 129], [222, 73, 104], [254, 159, 109], [252, 253, 191]];
const LEFT_OUT = [128, 128, 128];
const NOT_FINITE = [0, 255, 0];

// One colour for each pixel: what `show` asks for, at `stops` of exposure or gain.
function colours({ picture, reference, show, stops }) {
  const { width, height, linear, leftOut } = picture;
  const out = new ImageData(width, height);
  const gain = 2 ** stops;
  for (let i = 0; i < width * height; i++) {
    let colour;
    if (show === "picture") {
      colour = Number.isNaN(linear[3 * i]) ? [255, 0, 255] : [0, 1, 2].map((c) => srgb(gain * linear[3 * i + c]));
    } else if (leftOut[i]) {
      colour = LEFT_OUT;
    } else {
      let [sum, square] = [0, 0];
      for (let c = 0; c < 3; c++) {
        const r = reference.linear[3 * i + c];
        const error = (linear[3 * i + c] - r) / Math.sqrt(r * r + 1e-4);
        sum += error / 3;
        square += error * error / 3;
      }
      if (Number.isNaN(sum)) colour = NOT_FINITE;
      else if (show === "signed") colour = mix(SIGNED, 0.5 + 0.5 * gain * sum);
      else colour = mix(SIZE, (Math.log10(gain * Math.sqrt(square)) + 2) / 2);
    }
    out.data.set([colour[0], colour[1], colour[2], 255], 4 * i);
  }
  return out;
}

function viewer(section) {
  const view = { zoom: 1, x: 0.5, y: 0.5, show: "picture", stops: 0 };
  const panels = [...section.querySelectorAll("figure")].map((figure) => {
    const picture = decode(figure.querySelector("img"));
    const canvas = figure.querySelector("canvas");
    return { canvas, context: canvas.getContext("2d"), output: figure.querySelector("output"), picture, name: figure.dataset.name,
      shown: new OffscreenCanvas(picture.width, picture.height) };
  });
  const reference = panels[0].picture;
  const slider = section.querySelector("input[type=range]");
  const [key, keyCanvas, keyText] = [".key", ".key canvas", ".key span"].map((what) => section.querySelector(what));

  // The part of the picture that is seen, in pixels.
  const window_ = ({ width, height }) => {
    const half = 0.5 / view.zoom;
    view.x = Math.min(Math.max(view.x, half), 1 - half);
    view.y = Math.min(Math.max(view.y, half), 1 - half);
    return [(view.x - half) * width, (view.y - half) * height, width / view.zoom, height / view.zoom];
  };
  const draw = () => {
    for (const { canvas, context, picture, shown } of panels) {
      const wide = Math.max(picture.width, Math.round((canvas.clientWidth || picture.width) * devicePixelRatio));
      const high = Math.round(wide * picture.height / picture.width);
      if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
      context.imageSmoothingEnabled = false;
      context.drawImage(shown, ...window_(picture), 0, 0, wide, high);
    }
  };
  const recolour = () => {
    for (const { name, picture, shown } of panels) {
      // The reference has no error: its own picture stands there for orientation.
      const show = name === "reference" ? "picture" : view.show;
      const stops = name === "reference" && view.show !== "picture" ? 0 : view.stops;
      shown.getContext("2d").putImageData(colours({ picture, reference, show, stops }), 0, 0);
    }
    const stops = `${minus(String(view.stops))} stops`;
    section.querySelector(".exposure output").textContent = stops;
    section.querySelector(".exposure span").textContent = view.show === "picture" ? "Exposure" : "Gain";
    slider.setAttribute("aria-valuetext", stops);
    key.hidden = view.show === "picture";
    if (!key.hidden) {
      const full = 2 ** -view.stops;
      const stopsOf = view.show === "signed" ? SIGNED : SIZE;
      const strip = new ImageData(256, 1);
      for (let i = 0; i < 256; i++) strip.data.set([...mix(stopsOf, i / 255), 255], 4 * i);
      keyCanvas.getContext("2d").putImageData(strip, 0, 0);
      keyText.textContent = view.show === "signed" ? `relative error −${percent(full, 0)} … +${percent(full, 0)}` :
        `relative error ${percent(0.01 * full, 2)} … ${percent(full, 0)}, logarithmic`;
    }
    draw();
  };
  const zoomAt = (factor, fx, fy) => {
    const zoom = Math.min(Math.max(view.zoom * factor, 1), 64);
    view.x += (fx - 0.5) * (1 / view.zoom - 1 / zoom);
    view.y += (fy - 0.5) * (1 / view.zoom - 1 / zoom);
    view.zoom = zoom;
    draw();
  };
  const reset = () => { Object.assign(view, { zoom: 1, x: 0.5, y: 0.5, stops: 0 }); slider.value = "0"; recolour(); };
  const place = (event, canvas) => {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height, box];
  };
  const read = (fx, fy) => {
    for (const { picture, output } of panels) {
      const [left, top, wide, high] = window_(picture);
      const [x, y] = [Math.floor(left + fx * wide), Math.floor(top + fy * high)];
      const i = 3 * (y * picture.width + x);
      const inside = x >= 0 && y >= 0 && x < picture.width && y < picture.height;
      output.textContent = inside ? `(${x}, ${y}) ${[0, 1, 2].map((c) => digits(picture.linear[i + c])).join("  ")}` : "";
    }
  };
  for (const { canvas } of panels) {
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      zoomAt(2 ** (-event.deltaY / 240), ...place(event, canvas).slice(0, 2));
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      const [fx, fy, box] = place(event, canvas);
      if (event.buttons & 1) {
        view.x -= event.movementX / box.width / view.zoom;
        view.y -= event.movementY / box.height / view.zoom;
        draw();
      }
      read(fx, fy);
    });
    canvas.addEventListener("pointerleave", () => panels.forEach(({ output }) => { output.textContent = ""; }));
    canvas.addEventListener("keydown", (event) => {
      const step = 0.1 / view.zoom;
      const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
      if (moves[event.key]) { view.x += moves[event.key][0]; view.y += moves[event.key][1]; draw(); }
      else if (event.key === "+" || event.key === "=") zoomAt(1.5, 0.5, 0.5);
      else if (event.key === "-") zoomAt(1 / 1.5, 0.5, 0.5);
      else if (event.key === "0") reset();
      else return;
      event.preventDefault();
    });
  }
  slider.addEventListener("input", () => { view.stops = Number(slider.value); recolour(); });
  section.querySelectorAll("input[type=radio]").forEach((radio) =>
    radio.addEventListener("change", () => { view.show = radio.value; recolour(); }));
  section.querySelector(".reset").addEventListener("click", reset);
  new ResizeObserver(draw).observe(section.querySelector(".pictures"));
  recolour();
  return panels.length;
}

// After `load` all pictures are there, and drawing one decodes it at once: nothing to wait for.
function start() {
  describe();
  let pictures = 0;
  for (const section of document.querySelectorAll("section.scene")) {
    tables(section, data.scenes[Number(section.dataset.scene)]);
    pictures += viewer(section);
  }
  root.dataset.curves = document.querySelectorAll(".broad polyline.curve").length;
  root.dataset.pictures = pictures;
  root.dataset.ready = "1";
}
window.addEventListener("load", start);
