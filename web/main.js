// The page: what the buttons do, and what is shown.

import { BoxDrawing } from "./box.js";
import { Chart, showVotes } from "./chart.js";
import { SampleClip } from "./clip.js";
import { Client, Problem } from "./js/bagtrack.js";
import { words } from "./problems.js";
import { Run } from "./run.js";
import { asCsv, asJson, Recording, save } from "./save.js";
import { Stage } from "./stage.js";
import { openCamera, openFile } from "./video.js";

/**
 * @template {HTMLElement} T
 * @param {string} id
 * @returns {T}
 */
const get = (id) => /** @type {T} */ (document.getElementById(id));

const picture = /** @type {HTMLCanvasElement} */ (get("picture"));
const stage = new Stage(picture);
const chart = new Chart(/** @type {HTMLCanvasElement} */ (get("chart")));
const see = /** @type {HTMLInputElement} */ (get("see"));
const record = /** @type {HTMLInputElement} */ (get("record"));
/** What fails for longer is said. */
const client = new Client(new URL(".", location.href), { patience: 1500 });
const DRAW = "Draw a box around what to follow.";

/** @type {Run | undefined} */
let run;
/** Whether the first box has been drawn. */
let isFollowing = false;
/** @type {Recording | undefined} */
let recording;
/** Counts the choices: one that is overtaken by another is dropped. */
let choice = 0;
let lastStatus = "";
/** @type {(() => void) | undefined} What failed for want of a key. */
let again;

/**
 * @param {string} text
 * @param {boolean} [isBad]
 */
function say(text, isBad = false) {
  get("message").textContent = text;
  get("message").classList.toggle("bad", isBad);
}

/** @param {unknown} error */
function fail(error) {
  if (error instanceof Problem && error.slug === "unauthorized") {
    get("key-form").hidden = false;
    get("key").focus();
  }
  say(words(error), true);
  finished();
}

/** Shows the first frame of a source and asks for a box.
 * @param {() => Promise<import("./clip.js").Source>} open */
async function choose(open) {
  const own = (choice += 1);
  run?.stop();
  run = undefined;
  isFollowing = false;
  recording = undefined;
  say("Opening…");
  try {
    const source = await open();
    const first = await source.first();
    if (own !== choice) return source.stop();
    run = new Run(client, source, first, { answer: answered, fail, line, end: ended });
    run.sees = see.checked;
    for (const id of ["stage", "keys", "controls"]) get(id).hidden = false;
    for (const id of ["figures", "curve", "results", "seen"]) get(id).hidden = true;
    stage.draw(undefined);
    stage.show(first.bitmap);
    picture.scrollIntoView({ block: "nearest" });
    say(DRAW);
  } catch (error) {
    if (own === choice) fail(error);
  }
}

new BoxDrawing(picture, {
  start() {
    if (!run || run.isOver) return false;
    if (isFollowing) run.pause(true);
    return true;
  },
  change(box) {
    stage.draw(box);
    if (!box && isFollowing) run?.pause(isPaused);
  },
  finish(box) {
    stage.draw(undefined);
    if (!run) return;
    if (!isFollowing) return void follow(run, box);
    run.correct(box);
    run.pause(isPaused);
    say("The box is corrected.");
  },
});

/**
 * @param {Run} own
 * @param {import("./js/bagtrack.js").Box} box
 */
async function follow(own, box) {
  isFollowing = true;
  lastStatus = "";
  setPaused(false);
  for (const id of ["figures", "curve", "results"]) get(id).hidden = false;
  for (const id of ["pause", "stop"]) /** @type {HTMLButtonElement} */ (get(id)).disabled = false;
  stage.copyPatch(/** @type {HTMLCanvasElement} */ (get("first-patch")), box);
  if (record.checked && Recording.isPossible()) {
    recording = new Recording(picture);
    /** @type {HTMLButtonElement} */ (get("save-video")).disabled = false;
  }
  again = () => follow(own, box);
  try {
    await own.begin(box);
    say("Following. Draw again to correct the box.");
  } catch (error) {
    isFollowing = false;
    fail(error);
  }
}

/** @type {import("./run.js").Told["answer"]} */
function answered(shown, answer) {
  if (!run) return;
  stage.show(shown.bitmap, answer);
  chart.show(run.rows);
  const set = (/** @type {string} */ id, /** @type {string} */ text) => (get(id).textContent = text);
  set("status", answer.status);
  get("status").className = answer.status;
  set("score", answer.score.toFixed(2));
  set("frames", String(run.rows.length));
  set("rate", run.rate.toFixed(0));
  set("trip", `${run.trip.toFixed(0)} ms`);
  set("skipped", String(run.skipped));
  if (answer.votes) {
    get("seen").hidden = false;
    showBag(run);
    showVotes(/** @type {HTMLCanvasElement} */ (get("votes")), answer.votes);
    if (answer.status !== "lost") stage.copyPatch(/** @type {HTMLCanvasElement} */ (get("patch")), answer.box);
  }
  if (answer.status !== lastStatus) {
    if (answer.status === "lost") say("The target is lost. Draw a box to show where it is, or wait for it.");
    else if (lastStatus === "lost") say("Found again.");
    lastStatus = answer.status;
  }
}

let bagShownAt = 0;

/** Shows the bag, at most every two seconds.
 * @param {Run} own */
async function showBag(own) {
  const now = performance.now();
  if (now - bagShownAt < 2000) return;
  bagShownAt = now;
  // The session may end meanwhile; then the last picture stays.
  const blob = await own.session?.bag().catch(() => undefined);
  const shown = /** @type {HTMLImageElement} */ (get("bag"));
  if (!blob) return;
  if (shown.src) URL.revokeObjectURL(shown.src);
  shown.src = URL.createObjectURL(blob);
  shown.hidden = false;
}

/** @param {boolean} isUp */
function line(isUp) {
  if (!isUp) say("The line is broken. Trying again…", true);
  else if (get("message").classList.contains("bad")) say("The line is back.");
}

function ended() {
  say("The video has ended. Save the results, or choose another one.");
  run?.stop();
  finished();
}

function finished() {
  for (const id of ["pause", "stop"]) /** @type {HTMLButtonElement} */ (get(id)).disabled = true;
}

let isPaused = false;

/** @param {boolean} paused */
function setPaused(paused) {
  isPaused = paused;
  get("pause").textContent = paused ? "Go on" : "Pause";
}

get("card").addEventListener("click", () => choose(async () => new SampleClip("card")));
get("leaves").addEventListener("click", () => choose(async () => new SampleClip("leaves")));
get("camera").addEventListener("click", () => choose(openCamera));
get("file").addEventListener("change", () => {
  const input = /** @type {HTMLInputElement} */ (get("file"));
  const file = input.files?.[0];
  if (file) choose(() => openFile(file));
  input.value = "";
});
get("pause").addEventListener("click", () => {
  setPaused(!isPaused);
  run?.pause(isPaused);
});
get("stop").addEventListener("click", () => {
  run?.stop();
  finished();
  say("Stopped. Save the results, or choose another video.");
});
see.addEventListener("change", () => {
  if (run) run.sees = see.checked;
  if (!see.checked) get("seen").hidden = true;
});
get("key-form").addEventListener("submit", (event) => {
  event.preventDefault();
  client.key = /** @type {HTMLInputElement} */ (get("key")).value;
  get("key-form").hidden = true;
  say("");
  again?.();
});
get("save-csv").addEventListener("click", () => run && save(asCsv(run.rows), "boxes.csv"));
get("save-json").addEventListener("click", () => run && save(asJson(run.rows), "boxes.json"));
get("save-video").addEventListener("click", async () => recording && save(await recording.finish(), "boxes.webm"));
if (!Recording.isPossible()) record.disabled = true;
for (const host of document.querySelectorAll(".host")) host.textContent = new URL(".", location.href).href.slice(0, -1);
