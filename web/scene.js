// The clip of the first screen, drawn frame by frame: a van on a road at dusk, seen from the side, behind trees.

/** @typedef {CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D} Context */

export const WIDTH = 640;
export const HEIGHT = 360;
/** Frames until the clip repeats. */
export const FRAMES = 240;
const ROAD = 292;
/** Hills from far to near: y of the base, height of the waves, upper and lower colour, passes in `FRAMES` frames. */
const HILLS = /** @type {const} */ ([
  [168, 20, "#6a5a86", "#8f6d8c", 1],
  [206, 24, "#453f6b", "#6b4f78", 2],
  [246, 15, "#29305a", "#3b3764", 4],
]);

/** Draws a frame.
 * @param {Context} context Of a canvas with `WIDTH` and `HEIGHT`.
 * @param {number} frame */
export function drawScene(context, frame) {
  const round = (frame % FRAMES) / FRAMES;
  drawSky(context);
  HILLS.forEach((hill, at) => drawHill(context, hill, round, at));
  drawRoad(context, round);
  const turn = 2 * Math.PI * round;
  const size = 1 + 0.14 * Math.sin(turn + 1);
  const bob = 1.2 * Math.sin(9 * turn) + 0.7 * Math.sin(23 * turn);
  drawVan(context, 320 + 150 * Math.sin(turn) + 24 * Math.sin(3 * turn), ROAD + 8 * Math.sin(turn + 1) + bob, size, 30 * turn);
  for (const at of [0.1, 0.46, 0.82]) drawTree(context, 860 - 1080 * ((round * 3 + at) % 1), at);
}

/** @param {Context} context
 * @param {number[]} box From x, y to x, y.
 * @param {[number, string][]} stops */
function shade(context, [x0, y0, x1, y1], stops) {
  const gradient = context.createLinearGradient(x0, y0, x1, y1);
  for (const [at, color] of stops) gradient.addColorStop(at, color);
  context.fillStyle = gradient;
}

/** @param {Context} context */
function drawSky(context) {
  shade(context, [0, 0, 0, 240], [[0, "#1c2350"], [0.45, "#6b4a86"], [0.75, "#e08a7a"], [1, "#ffd29a"]]);
  context.fillRect(0, 0, WIDTH, HEIGHT);
  const glow = context.createRadialGradient(455, 150, 8, 455, 150, 170);
  glow.addColorStop(0, "#fff3cf");
  glow.addColorStop(0.14, "#ffe2a6cc");
  glow.addColorStop(1, "#ffb07800");
  context.fillStyle = glow;
  context.fillRect(0, 0, WIDTH, HEIGHT);
}

/** @param {Context} context
 * @param {typeof HILLS[number]} hill
 * @param {number} round
 * @param {number} seed */
function drawHill(context, [base, height, above, below, rounds], round, seed) {
  shade(context, [0, base - 2 * height, 0, base + 90], [[0, above], [1, below]]);
  context.beginPath();
  context.moveTo(0, HEIGHT);
  for (let x = 0; x <= WIDTH; x += 4) {
    const place = 2 * Math.PI * (x / WIDTH + round * rounds);
    const wave = Math.sin(place + seed) + 0.5 * Math.sin(3 * place + 2 * seed) + 0.22 * Math.sin(11 * place + seed);
    context.lineTo(x, base - height * wave);
  }
  context.lineTo(WIDTH, HEIGHT);
  context.fill();
}

/** @param {Context} context
 * @param {number} round */
function drawRoad(context, round) {
  shade(context, [0, 262, 0, HEIGHT], [[0, "#1b2040"], [0.3, "#2c2b4d"], [1, "#0e1126"]]);
  context.fillRect(0, 268, WIDTH, HEIGHT);
  context.fillStyle = "#f3d9a455";
  for (let at = 0; at < 9; at += 1) context.fillRect(((at * 80 + 720 - round * 8640) % 720 + 720) % 720 - 80, 316, 38, 3);
}

/** @param {Context} context
 * @param {number} x
 * @param {number} y
 * @param {number} size
 * @param {number} turn Angle of the wheels in radians. */
function drawVan(context, x, y, size, turn) {
  context.save();
  context.translate(x, y);
  context.scale(size, size);
  context.fillStyle = "#05071455";
  context.beginPath();
  context.ellipse(0, 13, 62, 6, 0, 0, 7);
  context.fill();
  shade(context, [50, 0, 190, 0], [[0, "#ffedb0aa"], [1, "#ffedb000"]]);
  context.beginPath();
  context.moveTo(50, -12);
  context.lineTo(190, -2);
  context.lineTo(190, 18);
  context.lineTo(50, -4);
  context.fill();
  shade(context, [0, -58, 0, 8], [[0, "#fff4dd"], [0.34, "#f1dcb8"], [0.36, "#e8503a"], [0.7, "#c9302c"], [1, "#7c1720"]]);
  context.beginPath();
  context.roundRect(-54, -56, 106, 62, [14, 26, 8, 8]);
  context.fill();
  shade(context, [-40, -48, 40, -24], [[0, "#2b3358"], [0.5, "#8fa3c9"], [0.55, "#3a4470"], [1, "#c9b7b4"]]);
  for (const [left, width] of [[-46, 24], [-17, 24], [13, 30]]) {
    context.beginPath();
    context.roundRect(left, -49, width, 21, 5);
    context.fill();
  }
  context.fillStyle = "#fff1c4";
  context.fillRect(46, -14, 6, 9);
  context.fillStyle = "#fff4dd";
  context.fillRect(-54, -22, 106, 2.5);
  for (const wheel of [-30, 30]) drawWheel(context, wheel, 5, turn);
  context.restore();
}

/** @param {Context} context
 * @param {number} x
 * @param {number} y
 * @param {number} turn */
function drawWheel(context, x, y, turn) {
  for (const [radius, color] of /** @type {const} */ ([[12, "#12131f"], [6.5, "#d9d3c8"], [2.5, "#8b2024"]])) {
    context.fillStyle = color;
    context.beginPath();
    context.arc(x, y, radius, 0, 7);
    context.fill();
  }
  context.fillStyle = "#12131f";
  context.fillRect(x + 4.5 * Math.cos(turn) - 1, y + 4.5 * Math.sin(turn) - 1, 2, 2);
}

/** @param {Context} context
 * @param {number} x
 * @param {number} seed */
function drawTree(context, x, seed) {
  context.fillStyle = "#090b1c";
  context.fillRect(x - 7, 60, 13 + 6 * seed, HEIGHT);
  for (let at = 0; at < 14; at += 1) {
    const angle = 2.4 * at + 9 * seed;
    context.beginPath();
    context.arc(x + 46 * Math.cos(angle), 44 + 34 * Math.sin(angle * 1.3), 22 + 9 * Math.sin(5 * at), 0, 7);
    context.fill();
  }
}
