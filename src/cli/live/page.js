"use strict";
// Asks for facts twice a second, and for a picture when there is another or it is to be shown otherwise.
const $ = (id) => document.getElementById(id);
const base = location.pathname.replace(/\/?$/, "/");
const marks = document.documentElement.dataset;
marks.errors = 0;
addEventListener("error", () => marks.errors++);
addEventListener("unhandledrejection", () => marks.errors++);

const EVERY = 500, HIDDEN = 5000, PATIENCE = 10000, MISSES = 4;
const STATUS = { loading: "the scene is read and planned", rendering: "rendering", paused: "paused", complete: "complete",
  stopped: "stopped", ended: "halflight has ended" };
let state = null, shown = "", fetching = false, missed = 0, touched = false, over = false;

const percent = (x) => x === null ? "not known yet" : `${(100 * x).toPrecision(3)} %`;

function time(seconds) {
  if (seconds < 60) return `${seconds.toFixed(seconds < 10 ? 1 : 0)} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

function tell(next) {
  const { facts, pause, stop } = state = next;
  const waits = facts.status === "complete" || facts.status === "stopped";
  const words = facts.status !== "rendering" ? STATUS[facts.status]
    : stop ? "stopping" : pause ? "pausing after this pass" : "rendering";
  $("status").textContent = facts.render > 1 ? `${words} · render ${facts.render}` : words;
  $("scene").textContent = facts.scene || "halflight";
  document.title = `${facts.passes} · ${facts.scene || "halflight"}`;
  const of = facts.all_passes === null ? "" : ` of ${facts.all_passes}`;
  $("passes").textContent = `${facts.passes}${of}`;
  const wished = facts.all_error === null ? "" : `, to be ${percent(facts.all_error)}`;
  const parts = facts.bias ? ` (noise ${percent(facts.noise)}, bias ${percent(facts.bias)})` : "";
  const doubt = facts.trusted === false ? ", not to be trusted yet" : "";
  $("error").textContent = percent(facts.error) + wished + parts + doubt;
  $("time").textContent = time(facts.seconds) + (facts.all_seconds === null ? "" : ` of ${time(facts.all_seconds)}`);
  $("left").textContent = facts.left === null ? (waits ? "nothing" : "not known yet") : `about ${time(facts.left)}`;
  const done = waits ? 1 : facts.left === null ? 0 : facts.seconds / (facts.seconds + facts.left);
  $("done").value = done;
  $("note").hidden = facts.note === null;
  $("note").textContent = facts.note ?? "";
  $("plan").textContent = facts.plan;
  $("pause").textContent = pause ? "Go on" : "Pause";
  $("pause").disabled = over || waits || facts.status === "loading";
  $("stop").textContent = waits ? "Quit" : "Stop";
  $("stop").title = waits ? "Ends halflight" : "Keeps the picture";
  $("stop").disabled = over;
  $("more").disabled = over || !facts.takes_passes;
  $("more").title = facts.takes_passes || !facts.plan ? "" : "These passes were dealt out: others render the next ones.";
  const layers = facts.layers.join();
  if (layers && marks.layers !== layers) {
    const chosen = $("layer").value;
    $("layer").replaceChildren(...facts.layers.map((name) => new Option(name)));
    $("layer").value = facts.layers.includes(chosen) ? chosen : facts.layers[0];
    marks.layers = layers;
  }
  if (facts.view && !touched) {
    $("view").value = facts.view;
    $("auto").checked = facts.exposure === "auto";
    if (facts.exposure !== "auto") $("exposure").value = facts.exposure;
  }
  over ||= facts.status === "ended";
  Object.assign(marks, { status: facts.status, passes: facts.passes, render: facts.render, note: facts.note ?? "" });
}

function query() {
  const exposure = $("auto").checked ? "auto" : $("exposure").value;
  return `layer=${$("layer").value}&exposure=${exposure}&view=${$("view").value}`;
}

async function look() {
  if (!state?.picture || fetching || document.hidden) return;
  const wanted = query(), key = `${state.picture} ${wanted}`;
  if (key === shown) return;
  fetching = true;
  try {
    const answer = await fetch(`${base}picture?${wanted}`, { signal: AbortSignal.timeout(PATIENCE) });
    if (!answer.ok) return;
    const picture = $("picture"), before = picture.src, of = answer.headers.get("X-Picture");
    picture.src = URL.createObjectURL(await answer.blob());
    await picture.decode();
    if (before) URL.revokeObjectURL(before);
    picture.hidden = false;
    $("none").hidden = true;
    shown = `${of.replace(" ", ",")} ${wanted}`;
    const layer = $("layer").value, mapped = layer === "error" || layer === "bias";
    const passes = of.split(" ")[1], stops = answer.headers.get("X-Exposure");
    if ($("auto").checked && !mapped) $("stops").textContent = stops;
    $("key").hidden = !mapped;
    $("caption").textContent = `${layer}, ${passes} pass${passes === "1" ? "" : "es"}, ${picture.naturalWidth} × ${picture.naturalHeight}`;
    Object.assign(marks, { shown: wanted, of, stops });
  } catch {
    // The next look tries again.
  } finally {
    fetching = false;
    if (query() !== wanted) look();
  }
}

async function ask() {
  try {
    const answer = await fetch(`${base}state`, { signal: AbortSignal.timeout(PATIENCE) });
    if (!answer.ok) throw new Error(answer.statusText);
    tell(await answer.json());
    missed = 0;
    await look();
  } catch {
    if (++missed >= MISSES || over) {
      over = true;
      $("status").textContent = "halflight has ended; this is its last picture";
      for (const button of document.querySelectorAll("button")) button.disabled = true;
      marks.status = "gone";
      return;
    }
  }
  setTimeout(ask, document.hidden ? HIDDEN : EVERY);
}

async function wish(what) {
  const answer = await fetch(base + what, { method: "POST", signal: AbortSignal.timeout(PATIENCE) });
  if (answer.ok) tell(await answer.json());
}

function see(changed) {
  touched = true;
  if (changed === "exposure") $("auto").checked = false;
  if (!$("auto").checked) $("stops").textContent = Number($("exposure").value).toFixed(2);
  look();
}

$("pause").onclick = () => wish(state.pause ? "go" : "pause");
$("stop").onclick = () => wish($("stop").textContent === "Quit" ? "quit" : "stop");
$("take-passes").onclick = () => $("passes-more").reportValidity() && wish(`more?passes=${Number($("passes-more").value)}`);
$("take-error").onclick = () => $("error-more").reportValidity() && wish(`more?error=${$("error-more").value / 100}`);
for (const id of ["layer", "view", "exposure", "auto"]) $(id).oninput = () => see(id);
$("whole").oninput = () => document.body.classList.toggle("whole", $("whole").checked);
document.addEventListener("visibilitychange", look);
ask();
