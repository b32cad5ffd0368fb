// The page: what the buttons do, and what is shown.

import { BoxDrawing } from "./box.js";
import { Camera, openCamera } from "./camera.js";
import { showVotes } from "./chart.js";
import { SampleClip } from "./clip.js";
import { openFile } from "./file.js";
import { Client, LocalClient, Problem } from "./js/bagtrack.js";
import { ObjectList } from "./list.js";
import { MOST_OBJECTS } from "./objects.js";
import { words } from "./problems.js";
import { encodes, extension, makeVideo } from "./recording.js";
import { Run } from "./run.js";
import { FORMATS, save } from "./save.js";
import { Stage } from "./stage.js";
import { Timeline } from "./timeline.js";

/**
 * @template {HTMLElement} T
 * @param {string} id
 * @returns {T}
 */
const get = (id) => /** @type {T} */ (document.getElementById(id));

const picture = /** @type {HTMLCanvasElement} */ (get("picture"));
const stage = new Stage(picture);
const timeline = new Timeline(/** @type {HTMLCanvasElement} */ (get("timeline")), seek);
const see = /** @type {HTMLInputElement} */ (get("see"));
/** What fails for longer is said. */
const client = new Client(new URL(".", location.href), { patience: 1500 });
/** Tracks in this page. */
const local = new LocalClient();
const here = /** @type {HTMLInputElement} */ (get("here"));
const DRAW = "Draw a box around what to follow.";
const TAP = matchMedia("(pointer: coarse)").matches ? "Tap Draw. " : "";
const FOLLOWING = "Following. Draw again to correct the box.";
const ADD = "Draw a box around the object to add.";
/** A status that held for fewer frames is not said. */
const SAID_AFTER = 5;

/** @type {Run | undefined} */
let run;
/** Whether the first box has been drawn. */
let isFollowing = false;
/** Whether the next box is that of a new object. */
let isAdding = false;
/** @type {import("./source.js").Picture | undefined} An earlier frame that is shown. */
let viewed;
/** Counts the frames that are to be shown: one that is overtaken by another is dropped. */
let view = 0;
/** @type {Promise<import("./source.js").Picture> | undefined} What the camera saw as the drawing began. */
let frozen;
/** Whether there are results that were not saved. */
let isUnsaved = false;
let hasKey = false;
/** Counts the choices: one that is overtaken by another is dropped. */
let choice = 0;
let lastStatus = "";
let saidStatus = "";
/** For how many frames the status has been the same. */
let held = 0;
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
  say(words(error, hasKey), true);
  finished();
}

/** Shows the first frame of a source and asks for a box.
 * @param {() => Promise<import("./source.js").Source>} open */
async function choose(open) {
  const own = (choice += 1);
  run?.stop();
  run = undefined;
  isFollowing = false;
  frozen = undefined;
  drawing.arm(false);
  add(false);
  leave();
  say("Opening…");
  try {
    const source = await open();
    const first = await source.first();
    if (own !== choice) return source.stop();
    if (here.checked) local.warm().catch(() => undefined);
    run = new Run(here.checked ? local : client, source, first, { answer: answered, fail, line, anew, end: ended });
    run.sees = see.checked;
    isUnsaved = false;
    for (const id of ["stage", "keys", "controls"]) get(id).hidden = false;
    for (const id of ["figures", "curve", "objects", "results", "seen"]) get(id).hidden = true;
    stage.draw(undefined);
    stage.show(first.image);
    preview();
    picture.scrollIntoView({ block: "nearest" });
    say(TAP + DRAW);
  } catch (error) {
    if (own === choice) fail(error);
  }
}

/** Shows what the camera sees, until a box is drawn. */
function preview() {
  if (run?.source instanceof Camera) run.source.preview((image) => stage.show(image));
}

const drawing = new BoxDrawing(picture, {
  start() {
    if (!run || run.isOver || run.isRedoing) return false;
    if (isFollowing) run.pause(true);
    else if (run.source.isLive) freeze(run);
    return true;
  },
  change(box) {
    stage.draw(box);
    if (box) return;
    if (isFollowing) run?.pause(isPaused);
    else preview();
  },
  finish(box) {
    stage.draw(undefined);
    if (!run) return;
    if (!isFollowing) return void follow(run, box);
    const object = isAdding ? undefined : run.chosen;
    const isNew = !object;
    add(false);
    const { frame } = viewed ?? run.picture;
    if (viewed || run.isResting) return void redo(run, object, frame, box);
    run.draw(box, object);
    run.pause(isPaused);
    say(isNew ? "Following another object." : "The box is corrected.");
  },
  tap() {
    if (run && !run.isOver) say(`${TAP}${isFollowing ? "Then draw the box anew." : DRAW}`);
  },
  arm(isArmed) {
    picture.classList.toggle("armed", isArmed);
    get("draw").setAttribute("aria-pressed", String(isArmed));
  },
});

/** Takes the picture that the camera sees now.
 * @param {Run} own */
function freeze(own) {
  frozen = own.source.first();
  frozen.then(({ image }) => !isFollowing && stage.show(image)).catch(fail);
}

/**
 * @param {Run} own
 * @param {import("./js/bagtrack.js").Box} box
 */
async function follow(own, box) {
  isFollowing = true;
  lastStatus = saidStatus = "tracking";
  setPaused(false);
  for (const id of ["figures", "curve", "objects", "results"]) get(id).hidden = false;
  for (const id of ["pause", "stop", "back", "forward"]) /** @type {HTMLButtonElement} */ (get(id)).disabled = false;
  stage.copyPatch(/** @type {HTMLCanvasElement} */ (get("first-patch")), box);
  again = () => follow(own, box);
  try {
    if (frozen) own.picture = await frozen;
    await own.begin(box);
    say(FOLLOWING);
  } catch (error) {
    isFollowing = false;
    fail(error);
  }
}

/** Shows a frame with the objects in it.
 * @param {Run} own
 * @param {import("./source.js").Picture} shown
 * @param {number[][]} [particles] */
function show(own, shown, particles) {
  stage.show(shown.image, own.shownIn(shown.frame, shown.image), particles);
  timeline.show([...(own.chosen?.rows.values() ?? [])], own.lastFrame, shown.frame);
  list.show(own.objects, own.chosen);
}

/** @type {import("./run.js").Told["answer"]} */
function answered(shown, answer) {
  if (!run) return;
  // Who looks at an earlier frame goes on doing so.
  if (!viewed) show(run, shown, answer?.particles);
  const set = (/** @type {string} */ id, /** @type {string} */ text) => (get(id).textContent = text);
  set("frames", String(run.tracked));
  set("rate", run.rate.toFixed(0));
  set("trip", `${run.trip.toFixed(0)} ms`);
  set("skipped", String(run.skipped));
  isUnsaved = run.frames.size > 1;
  if (!answer) return;
  set("status", answer.status);
  get("status").className = answer.status;
  set("score", answer.score.toFixed(2));
  if (answer.votes) {
    get("seen").hidden = false;
    showBag(run);
    showVotes(/** @type {HTMLCanvasElement} */ (get("votes")), answer.votes);
    if (answer.status !== "lost") stage.copyPatch(/** @type {HTMLCanvasElement} */ (get("patch")), answer.box);
  }
  held = answer.status === lastStatus ? held + 1 : 1;
  lastStatus = answer.status;
  if (answer.status !== saidStatus && (held >= SAID_AFTER || answer.status === "lost")) sayStatus(answer.status);
}

/** Shows a frame that was tracked, and pauses.
 * @param {number} frame */
async function seek(frame) {
  const own = run;
  if (!own || !isFollowing || own.isRedoing || frame === (viewed ?? own.picture).frame) return;
  const wanted = (view += 1);
  setPaused(true);
  own.pause(true);
  const numbers = [...own.frames.keys()];
  const nearest = numbers.reduce((one, other) => (Math.abs(other - frame) < Math.abs(one - frame) ? other : one));
  if (nearest === own.lastFrame) {
    leave();
    return repaint();
  }
  const picture = await own.kept(nearest);
  if (!picture || wanted !== view || own !== run) return;
  viewed = picture;
  show(own, picture);
}

/** Shows the last frame again. */
function leave() {
  view += 1;
  viewed = undefined;
}

/** Follows an object anew from an earlier frame on.
 * @param {Run} own
 * @param {import("./objects.js").FollowedObject | undefined} object
 * @param {number} frame
 * @param {import("./js/bagtrack.js").Box} box */
async function redo(own, object, frame, box) {
  isUnsaved = true;
  try {
    await own.redo(object, frame, box, (done) => say(`Following anew: frame ${done} of ${own.lastFrame}.`));
    if (own !== run) return;
    say(`Followed anew from frame ${frame}.`);
    if (viewed) show(own, viewed);
    else stage.show(own.picture.image, own.shownIn(own.lastFrame, own.picture.image));
    list.show(own.objects, own.chosen);
  } catch (error) {
    if (own === run) say(words(error, hasKey), true);
  }
}

/** Makes the next box that of a new object, or not.
 * @param {boolean} isOn */
function add(isOn) {
  isAdding = isOn;
  get("add").setAttribute("aria-pressed", String(isOn));
}

/** Shows again what is shown, after a change. */
function repaint() {
  if (run && isFollowing) show(run, viewed ?? run.picture);
}

const list = new ObjectList(get("list"), {
  choose(object) {
    if (run) run.chosen = object;
    repaint();
  },
  remove(object) {
    run?.remove(object);
    isUnsaved = true;
    repaint();
  },
  doubt(object) {
    if (!run) return;
    run.chosen = object;
    const frame = object.nextDoubtful((viewed ?? run.picture).frame);
    if (frame === undefined) say(`${object.name} is tracked in all frames.`);
    else seek(frame);
    repaint();
  },
  change: repaint,
});

/** @param {"tracking" | "uncertain" | "lost"} status */
function sayStatus(status) {
  if (status === "lost") say("The target is lost. Draw a box to show where it is, or wait for it.");
  else if (saidStatus === "lost") say("Found again. Draw again to correct the box.");
  else if (status === "uncertain") say("The box may be off. Draw again to correct it.");
  else say(FOLLOWING);
  saidStatus = status;
}

let bagShownAt = 0;

/** Shows the bag, at most every two seconds.
 * @param {Run} own */
async function showBag(own) {
  const now = performance.now();
  if (now - bagShownAt < 2000) return;
  bagShownAt = now;
  // The session may end meanwhile; then the last picture stays.
  const blob = await own.chosen?.follower.bag().catch(() => undefined);
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

function anew() {
  say("The service had lost the session. It goes on from the last box: draw again if it is off.");
}

function ended() {
  say("The video has ended. Save the results, or choose another one.");
  run?.rest();
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
get("camera").addEventListener("click", () => choose(() => openCamera(get("stage"))));
get("file").addEventListener("change", () => {
  const input = /** @type {HTMLInputElement} */ (get("file"));
  take(input.files?.[0]);
  input.value = "";
});

/** @param {File | undefined} file */
function take(file) {
  if (file) choose(() => openFile(file, get("stage")));
}

for (const kind of ["dragover", "dragleave", "drop"]) {
  addEventListener(kind, (event) => {
    // Without this the browser leaves the page for the file.
    event.preventDefault();
    document.body.classList.toggle("drop", kind === "dragover");
    if (kind === "drop") take(/** @type {DragEvent} */ (event).dataTransfer?.files[0]);
  });
}
addEventListener("beforeunload", (event) => {
  if (isUnsaved) event.preventDefault();
});
get("draw").addEventListener("click", () => drawing.arm(!drawing.isArmed));
get("pause").addEventListener("click", () => {
  setPaused(!isPaused);
  if (!isPaused) leave();
  repaint();
  run?.pause(isPaused);
});
get("add").addEventListener("click", () => {
  if (!run || run.isOver) return;
  if (run.objects.length >= MOST_OBJECTS) return say(`No more than ${MOST_OBJECTS} objects are followed.`);
  add(!isAdding);
  if (isAdding) drawing.arm(true);
  say(isAdding ? ADD : FOLLOWING);
});
/** Goes to the frame before or after the one that is shown.
 * @param {number} by */
function step(by) {
  if (run) timeline.go((viewed ?? run.picture).frame + by);
}
get("back").addEventListener("click", () => step(-1));
get("forward").addEventListener("click", () => step(1));
addEventListener("keydown", (event) => {
  const { target, key } = event;
  const isTaken = target instanceof HTMLElement && target.closest("input, button, a, #picture, summary");
  if (!isFollowing || isTaken || event.ctrlKey || event.metaKey || event.altKey) return;
  if (key === " ") {
    event.preventDefault();
    get("pause").click();
  } else if (key === "d") step(-1);
  else if (key === "f") step(1);
});
get("stop").addEventListener("click", () => {
  run?.rest();
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
  hasKey = true;
  get("key-form").hidden = true;
  say("");
  again?.();
});

/**
 * @param {(own: Run) => Blob | Promise<Blob>} make
 * @param {string} ending
 */
async function saveAs(make, ending) {
  const own = run;
  if (!own || own.objects.length === 0) return;
  save(await make(own), own, ending);
  isUnsaved = false;
}

for (const [format, { make, ending }] of Object.entries(FORMATS)) {
  get(`save-${format}`).addEventListener("click", () => saveAs(make, ending));
}
get("save-video").addEventListener("click", async () => {
  const button = /** @type {HTMLButtonElement} */ (get("save-video"));
  const label = button.textContent;
  button.disabled = true;
  const tell = (/** @type {number} */ done, /** @type {number} */ of) => {
    button.textContent = `Making the video: ${Math.floor((100 * done) / of)} %`;
  };
  try {
    await saveAs((own) => makeVideo(own, tell), extension);
    const [kept, of] = [run?.frames.size ?? 0, run?.tracked ?? 0];
    if (kept < of) say(`The video has the last ${kept} of ${of} frames: no more are kept.`);
  } catch (error) {
    say(words(error, hasKey), true);
  }
  button.textContent = label;
  button.disabled = false;
});
if (!encodes) {
  get("save-video").textContent = "Video (Matroska)";
  get("no-encoder").hidden = false;
}
for (const host of document.querySelectorAll(".host")) host.textContent = new URL(".", location.href).href.slice(0, -1);
